//! The wing as aerodynamics sees it: planform, section and control surfaces.

#![allow(clippy::disallowed_methods, reason = "offline: a wing is described once")]

use serde::{Deserialize, Serialize};

/// A straight wing, symmetric about y = 0; y in metres, positive to the right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wing {
    /// Span b, m.
    pub span_m: f64,
    /// Chord over the span.
    pub planform: Planform,
    /// Lift slope a0 of the section, 1/rad.
    pub section_lift_slope_per_rad: f64,
    /// Angle of attack at which the section has no lift, rad.
    pub zero_lift_angle_rad: f64,
    /// Pitching moment coefficient c_m of the section about its aerodynamic centre, nose-up.
    pub pitching_moment_coefficient: f64,
    /// Aerodynamic centre and reference axis of the beam, as a fraction of the chord from the nose.
    pub axis_chord_fraction: f64,
    /// Mean line of the section: NACA four-digit camber m and its place p, as fractions of the chord.
    pub camber: Camber,
    /// Flaps: both go down with a positive deflection.
    pub flap: ControlSurface,
    /// Ailerons: the right one goes down with a positive deflection, the left one up.
    pub aileron: ControlSurface,
}

/// Chord over the span.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Planform {
    /// The same chord everywhere.
    Rectangular {
        /// Chord, m.
        chord_m: f64,
    },
    /// A half-ellipse over the span.
    Elliptic {
        /// Chord at y = 0, m.
        root_chord_m: f64,
    },
}

/// Mean line of a NACA four-digit section: two parabolas that meet at the crest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camber {
    /// Height of the crest over the chord.
    pub height: f64,
    /// Place of the crest along the chord.
    pub place: f64,
}

/// A trailing-edge surface of the right wing and its mirror image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlSurface {
    /// Inboard end, m from the plane of symmetry.
    pub inboard_m: f64,
    /// Outboard end, m.
    pub outboard_m: f64,
    /// Chord of the surface c_a, m.
    pub chord_m: f64,
    /// Chord of the wing where the surface is, m.
    pub wing_chord_m: f64,
    /// Hinges, m from the plane of symmetry; each takes half of the surface's lift.
    pub hinges_m: [f64; 2],
    /// The place where the actuator holds the surface, m from the plane of symmetry.
    pub actuator_m: f64,
}

impl Wing {
    /// The wing of Berri 2021, section 4.1.1: rectangular, NACA 2412, span 10 m, chord 1 m.
    pub fn reference() -> Self {
        let surface = |[inboard_m, outboard_m]: [f64; 2], hinges_m: [f64; 2]| ControlSurface {
            inboard_m,
            outboard_m,
            chord_m: 0.25,
            wing_chord_m: 1.0,
            hinges_m,
            actuator_m: hinges_m[0],
        };
        Self {
            span_m: 10.0,
            planform: Planform::Rectangular { chord_m: 1.0 },
            section_lift_slope_per_rad: 0.105_f64.to_degrees(),
            zero_lift_angle_rad: -2.1_f64.to_radians(),
            pitching_moment_coefficient: -0.047,
            axis_chord_fraction: 0.25,
            camber: Camber { height: 0.02, place: 0.4 },
            flap: surface([0.6, 2.6], [1.0, 2.2]),
            aileron: surface([2.9, 4.7], [3.3, 4.3]),
        }
    }

    /// Chord at a fraction eta = 2 y / b of the half span, m.
    pub fn chord_m(&self, eta: f64) -> f64 {
        match self.planform {
            Planform::Rectangular { chord_m } => chord_m,
            Planform::Elliptic { root_chord_m } => root_chord_m * (1.0 - eta * eta).max(0.0).sqrt(),
        }
    }

    /// Integral of the squared chord from y to the right tip, m^3.
    pub fn outboard_chord_squared_m3(&self, y_m: f64) -> f64 {
        let half_span_m = 0.5 * self.span_m;
        let eta = y_m / half_span_m;
        match self.planform {
            Planform::Rectangular { chord_m } => chord_m * chord_m * (half_span_m - y_m),
            Planform::Elliptic { root_chord_m } => {
                root_chord_m * root_chord_m * half_span_m * (2.0 / 3.0 - eta + eta * eta * eta / 3.0)
            }
        }
    }

    /// Area S, m^2.
    pub fn area_m2(&self) -> f64 {
        match self.planform {
            Planform::Rectangular { chord_m } => self.span_m * chord_m,
            Planform::Elliptic { root_chord_m } => std::f64::consts::FRAC_PI_4 * self.span_m * root_chord_m,
        }
    }

    /// Aspect ratio b^2 / S.
    pub fn aspect_ratio(&self) -> f64 {
        self.span_m * self.span_m / self.area_m2()
    }
}

impl Camber {
    /// Height of the mean line over the chord at a fraction `x` of the chord.
    pub fn line(&self, x: f64) -> f64 {
        let (m, p) = (self.height, self.place);
        if x < p {
            m / (p * p) * (2.0 * p * x - x * x)
        } else {
            m / ((1.0 - p) * (1.0 - p)) * (1.0 - 2.0 * p + 2.0 * p * x - x * x)
        }
    }

    /// Slope of the mean line.
    pub fn slope(&self, x: f64) -> f64 {
        let (m, p) = (self.height, self.place);
        let reach = if x < p { p } else { 1.0 - p };
        2.0 * m / (reach * reach) * (p - x)
    }
}

impl ControlSurface {
    /// Area of the surface S_c, m^2.
    pub fn area_m2(&self) -> f64 {
        self.chord_m * (self.outboard_m - self.inboard_m)
    }

    /// Change of the section's zero-lift angle per deflection: tau = 1 - (theta - sin theta)/pi with
    /// the hinge at x/c = (1 - cos theta)/2 (Glauert's thin airfoil with a flap).
    pub fn effectiveness(&self) -> f64 {
        let theta = (2.0 * self.chord_m / self.wing_chord_m - 1.0).acos();
        1.0 - (theta - theta.sin()) / std::f64::consts::PI
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effectiveness_of_a_quarter_chord_surface() {
        assert!((Wing::reference().flap.effectiveness() - 0.608_997_781).abs() < 1e-9);
    }

    #[test]
    fn a_surface_as_deep_as_the_wing_turns_all_of_it() {
        let surface = ControlSurface { chord_m: 0.8, wing_chord_m: 0.8, ..Wing::reference().flap };
        assert!((surface.effectiveness() - 1.0).abs() < 1e-15);
    }

    /// From a point to the tip, by the midpoint rule.
    #[test]
    fn squared_chord_is_integrated_to_the_tip() {
        let elliptic = Planform::Elliptic { root_chord_m: 1.3 };
        for planform in [Planform::Rectangular { chord_m: 0.9 }, elliptic] {
            let wing = Wing { planform, ..Wing::reference() };
            for y_m in [-2.0, 0.0, 1.7] {
                let (strips, length_m) = (10_000, 5.0 - y_m);
                let y = |i: i32| y_m + length_m * (f64::from(i) + 0.5) / f64::from(strips);
                let squares = (0..strips).map(|i| wing.chord_m(y(i) / 5.0).powi(2));
                let integral = squares.sum::<f64>() * length_m / f64::from(strips);
                assert!((integral - wing.outboard_chord_squared_m3(y_m)).abs() < 1e-6);
            }
        }
    }

    /// The mean line runs from nose to tail through its crest, with the slope that it has.
    #[test]
    fn mean_line_has_its_crest_and_its_slope() {
        let camber = Wing::reference().camber;
        assert!(camber.line(0.0).abs() < 1e-15 && camber.line(1.0).abs() < 1e-15);
        assert!((camber.line(0.4) - 0.02).abs() < 1e-15 && camber.slope(0.4).abs() < 1e-15);
        for x in [0.1, 0.39, 0.41, 0.9] {
            let slope = (camber.line(x + 1e-6) - camber.line(x - 1e-6)) / 2e-6;
            assert!((slope - camber.slope(x)).abs() < 1e-8);
        }
    }

    #[test]
    fn area_is_the_integral_of_the_chord() {
        let wing = Wing { planform: Planform::Elliptic { root_chord_m: 1.3 }, ..Wing::reference() };
        let strips = 100_000;
        let eta = (0..strips).map(|i| (2.0 * f64::from(i) + 1.0) / f64::from(strips) - 1.0);
        let mean = eta.map(|eta| wing.chord_m(eta)).sum::<f64>() / f64::from(strips);
        assert!((mean * wing.span_m - wing.area_m2()).abs() < 1e-6);
    }
}
