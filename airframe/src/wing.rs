//! The wing as aerodynamics sees it: planform, section and control surfaces.

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
}

impl Wing {
    /// The wing of Berri 2021, section 4.1.1: rectangular, NACA 2412, span 10 m, chord 1 m.
    pub fn reference() -> Self {
        let surface =
            |inboard_m, outboard_m| ControlSurface { inboard_m, outboard_m, chord_m: 0.25, wing_chord_m: 1.0 };
        Self {
            span_m: 10.0,
            planform: Planform::Rectangular { chord_m: 1.0 },
            section_lift_slope_per_rad: 0.105_f64.to_degrees(),
            zero_lift_angle_rad: -2.1_f64.to_radians(),
            flap: surface(0.6, 2.6),
            aileron: surface(2.9, 4.7),
        }
    }

    /// Chord at a fraction eta = 2 y / b of the half span, m.
    pub fn chord_m(&self, eta: f64) -> f64 {
        match self.planform {
            Planform::Rectangular { chord_m } => chord_m,
            Planform::Elliptic { root_chord_m } => root_chord_m * (1.0 - eta * eta).max(0.0).sqrt(),
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

impl ControlSurface {
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
        let surface = ControlSurface { inboard_m: 0.0, outboard_m: 1.0, chord_m: 0.8, wing_chord_m: 0.8 };
        assert!((surface.effectiveness() - 1.0).abs() < 1e-15);
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
