//! Hinge moments of the control surfaces from the flight-condition products: the rows C_z.
//!
//! Two models. The thesis's takes the whole lift that a surface adds to its wing, at half the surface's
//! chord, so that the moment knows the deflection alone. Thin-airfoil theory integrates the pressure
//! over the surface itself: M = q S_c c_a (h_0 + h_alpha alpha + h_delta delta), in two dimensions and
//! therefore without correction for the finite span; the usual coefficients are b_0 = -h_0,
//! b_1 = -h_alpha, b_2 = -h_delta. It gives several times less, and an angle of attack counts.
//!
//! Thin airfoil: at x/c = (1 - cos theta)/2 the mean line's slope s, seen from the free stream, makes
//! the pressure difference 4 [A_0 (1 + cos theta)/sin theta + sum A_n sin(n theta)] q with
//! A_0 = -1/pi int s dtheta, A_n = 2/pi int s cos(n theta) dtheta. Here s is linear in cos theta piece
//! by piece, so that all integrals are closed. Source: Glauert 1927, "Theoretical relationships for an
//! aerofoil with hinged flap", R. & M. 1095.
//!
//! A hinge moment has the sign of the surface's lift.

use std::f64::consts::PI;

use domain::sensor_configuration::HingeRows;

use crate::{
    lifting_line::LiftingLine,
    wing::{Camber, ControlSurface},
};

/// The source of hinge moments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HingeModel {
    /// M = L c_a/2 with the surface's whole lift, carry-over included (Berri 2021, section 4.1.1).
    WholeLift,
    /// The pressure on the surface itself, after thin-airfoil theory.
    ThinAirfoil,
}

/// C_z of the right wing's surfaces.
pub fn hinge_rows(line: &LiftingLine, model: HingeModel) -> HingeRows {
    match model {
        HingeModel::WholeLift => HingeRows {
            flap: [0.0, 0.0, 0.0, line.flap_hinge_moment_m3_per_rad(), 0.0],
            aileron: [0.0, 0.0, 0.0, 0.0, line.aileron_hinge_moment_m3_per_rad()],
        },
        HingeModel::ThinAirfoil => {
            let wing = line.wing();
            let row = |surface: &ControlSurface| thin_airfoil_row(surface, &wing.camber);
            let ([q, q_alpha, q_roll, own], aileron) = (row(&wing.flap), row(&wing.aileron));
            HingeRows {
                flap: [q, q_alpha, q_roll, own, 0.0],
                aileron: [aileron[0], aileron[1], aileron[2], 0.0, aileron[3]],
            }
        }
    }
}

/// Moment per q, q alpha, q p/V and q times the surface's own deflection. Roll is an angle of attack
/// p y/V, on average that of the middle of the surface.
fn thin_airfoil_row(surface: &ControlSurface, camber: &Camber) -> [f64; 4] {
    let ThinAirfoilHinge { camber, incidence, deflection } = ThinAirfoilHinge::new(surface, camber);
    let volume_m3 = surface.area_m2() * surface.chord_m;
    let middle_m = 0.5 * (surface.inboard_m + surface.outboard_m);
    [camber, incidence, incidence * middle_m, deflection].map(|h| h * volume_m3)
}

/// Hinge moment coefficients M/(q S_c c_a) of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinAirfoilHinge {
    /// h_0: at no angle of attack and no deflection.
    pub camber: f64,
    /// h_alpha, 1/rad.
    pub incidence: f64,
    /// h_delta, 1/rad.
    pub deflection: f64,
}

impl ThinAirfoilHinge {
    /// The hinge of a surface at the trailing edge of a section with this mean line.
    pub fn new(surface: &ControlSurface, camber: &Camber) -> Self {
        let fraction = surface.chord_m / surface.wing_chord_m;
        let hinge = libm::acos(2.0 * fraction - 1.0);
        let coefficient = |slope: &[SlopePiece]| moment_behind(hinge, slope) / (fraction * fraction);
        Self {
            camber: coefficient(&camber_slope(camber)),
            incidence: coefficient(&[SlopePiece { from: 0.0, to: PI, constant: -1.0, cosine: 0.0 }]),
            deflection: coefficient(&[SlopePiece { from: hinge, to: PI, constant: -1.0, cosine: 0.0 }]),
        }
    }
}

/// Slope of the mean line: constant + cosine cos(theta) for theta in [from, to].
struct SlopePiece {
    from: f64,
    to: f64,
    constant: f64,
    cosine: f64,
}

/// The slope is linear in x before and behind the crest.
fn camber_slope(camber: &Camber) -> [SlopePiece; 2] {
    let crest = libm::acos(1.0 - 2.0 * camber.place);
    let piece = |from, to, reach: f64| {
        let factor = 2.0 * camber.height / (reach * reach);
        SlopePiece { from, to, constant: factor * (camber.place - 0.5), cosine: 0.5 * factor }
    };
    [piece(0.0, crest, camber.place), piece(crest, PI, 1.0 - camber.place)]
}

/// Glauert's A_n of a mean line.
fn glauert_coefficient(n: i32, slope: &[SlopePiece]) -> f64 {
    let integral = |piece: &SlopePiece| {
        let at =
            |theta| piece.constant * sine(n, theta) + 0.5 * piece.cosine * (sine(n - 1, theta) + sine(n + 1, theta));
        at(piece.to) - at(piece.from)
    };
    let sum: f64 = slope.iter().map(integral).sum();
    if n == 0 { -sum / PI } else { 2.0 * sum / PI }
}

/// Moment about the hinge of the pressure behind it, over q c^2, positive as the lift. Its terms fall
/// as n^-3.
fn moment_behind(hinge: f64, slope: &[SlopePiece]) -> f64 {
    const TERMS: i32 = 1000;
    let cos = libm::cos(hinge);
    let leading =
        |theta: f64| cos * (theta + libm::sin(theta)) - libm::sin(theta) - 0.5 * theta - 0.25 * libm::sin(2.0 * theta);
    let harmonic = |n, theta| {
        0.5 * cos * (sine(n - 1, theta) - sine(n + 1, theta)) - 0.25 * (sine(n - 2, theta) - sine(n + 2, theta))
    };
    let series = (1..=TERMS).map(|n| glauert_coefficient(n, slope) * (harmonic(n, PI) - harmonic(n, hinge)));
    glauert_coefficient(0, slope) * (leading(PI) - leading(hinge)) + series.sum::<f64>()
}

/// int_0^theta cos(n phi) dphi.
fn sine(n: i32, theta: f64) -> f64 {
    if n == 0 { theta } else { libm::sin(f64::from(n) * theta) / f64::from(n) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wing::Wing;

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
    }

    /// b_1 and b_2 of a quarter-chord surface.
    #[test]
    fn thin_airfoil_has_its_hinge_coefficients() {
        let wing = Wing::reference();
        let hinge = ThinAirfoilHinge::new(&wing.aileron, &wing.camber);
        close(hinge.incidence, 0.5653, 5e-5);
        close(hinge.deflection, 0.9436, 5e-5);
    }

    /// A surface as deep as the wing is a flat plate: its lift 2 pi acts at a quarter of the chord, and
    /// deflection is incidence.
    #[test]
    fn a_surface_as_deep_as_the_wing_is_a_flat_plate() {
        let wing = Wing::reference();
        let plate = ControlSurface { chord_m: 1.0, ..wing.flap };
        let hinge = ThinAirfoilHinge::new(&plate, &wing.camber);
        close(hinge.incidence, 0.5 * PI, 1e-12);
        close(hinge.deflection, 0.5 * PI, 1e-6);
    }

    /// The mean line of NACA 2412 by thin-airfoil theory: zero lift at -2.077 degrees, moment about the
    /// quarter chord -0.0531 (Abbott and von Doenhoff 1959).
    #[test]
    fn mean_line_has_its_zero_lift_angle_and_moment() {
        let slope = camber_slope(&Wing::reference().camber);
        let a = [0, 1, 2].map(|n| glauert_coefficient(n, &slope));
        close((-(a[0] + 0.5 * a[1])).to_degrees(), -2.077, 1e-3);
        close(-0.25 * PI * (a[1] - a[2]), -0.0531, 5e-5);
    }

    /// A cambered section at its zero-lift angle still loads its tail, and the rows say so.
    #[test]
    fn rows_hold_camber_incidence_roll_and_their_own_deflection() {
        let line = LiftingLine::new(Wing::reference(), 20);
        let rows = hinge_rows(&line, HingeModel::ThinAirfoil);
        let [flap, aileron] = [rows.flap, rows.aileron];
        assert!(flap[0] > 0.0 && aileron[0] > 0.0);
        close(flap[1], 0.5653 * 0.5 * 0.25, 1e-5);
        close(flap[2], flap[1] * 1.6, 1e-12);
        close(aileron[2], aileron[1] * 3.8, 1e-12);
        close(aileron[4], 0.9436 * 0.45 * 0.25, 1e-5);
        assert_eq!((flap[4], aileron[3]), (0.0, 0.0));
    }
}
