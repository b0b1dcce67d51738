//! Prandtl's lifting line by Fourier collocation.
//!
//! - What: circulation Gamma(theta) = 2 b V sum_n A_n sin(n theta), y = (b/2) cos theta, of a wing in
//!   incompressible flow, for any angle of attack, roll rate and deflections.
//! - Update rule: the section's lift follows its effective angle of attack alpha - w/V with the
//!   downwash w(y) = 1/(4 pi) PV int Gamma'(s)/(y - s) ds, positive down (Berri 2021, eq. 4.2 and 4.4,
//!   corrected). At theta_j = j pi/(N + 1), with mu = a0 c/(4 b):
//!   sum_n A_n sin(n theta_j) (sin theta_j + n mu_j) = mu_j alpha_j sin theta_j.
//!   One LU serves four unit bases, which superpose: the problem is linear.
//! - Requirements: attached flow, a straight wing of high aspect ratio. A deflection jumps at the
//!   ends of its surface; it is averaged over the cell of each theta_j, since its value at the point
//!   alone does not converge with N.
//! - Source: Glauert 1926, "The elements of aerofoil and airscrew theory", chapter 11.

#![allow(clippy::disallowed_methods, reason = "offline: a wing is described once")]

use std::f64::consts::PI;

use domain::AirData;
use nalgebra::DMatrix;

use crate::wing::{ControlSurface, Wing};

/// What changes the local angle of attack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Angle of attack from zero lift, per rad.
    Incidence,
    /// Flap deflection, per rad.
    Flap,
    /// Aileron deflection, per rad.
    Aileron,
    /// Roll rate over airspeed p/V, per 1/m: alpha = p y/V, since the right wing goes down.
    Roll,
}

const BASES: [Basis; 4] = [Basis::Incidence, Basis::Flap, Basis::Aileron, Basis::Roll];

/// The solved unit bases of a wing.
#[derive(Debug, Clone, PartialEq)]
pub struct LiftingLine {
    wing: Wing,
    /// A_n per unit of each basis, in the order of [`BASES`].
    unit_coefficients: [Vec<f64>; 4],
}

/// Lift over the span per dynamic pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Loading {
    span_m: f64,
    aspect_ratio: f64,
    /// A_1, A_2, ...
    coefficients: Vec<f64>,
}

impl LiftingLine {
    /// Solves the four bases of `wing` with `points` collocation points (80 are within 0.2 % of the
    /// limit).
    pub fn new(wing: Wing, points: usize) -> Self {
        assert!(points > 0, "a lifting line needs collocation points");
        let cell = PI / (points + 1) as f64;
        let theta = |j: usize| (j + 1) as f64 * cell;
        let mu = |j: usize| wing.section_lift_slope_per_rad * wing.chord_m(theta(j).cos()) / (4.0 * wing.span_m);
        let matrix = DMatrix::from_fn(points, points, |j, column| {
            let n = (column + 1) as f64;
            (n * theta(j)).sin() * (theta(j).sin() + n * mu(j))
        });
        let right_hand_sides = DMatrix::from_fn(points, BASES.len(), |j, basis| {
            mu(j) * theta(j).sin() * unit_angle(&wing, BASES[basis], theta(j), cell)
        });
        let solution = matrix.lu().solve(&right_hand_sides).expect("downwash only adds to a regular matrix");
        let unit_coefficients = std::array::from_fn(|basis| solution.column(basis).iter().copied().collect());
        Self { wing, unit_coefficients }
    }

    /// The loading of one unit of a basis.
    pub fn unit_loading(&self, basis: Basis) -> Loading {
        self.superpose(|other| if other == basis { 1.0 } else { 0.0 })
    }

    /// The loading in a flight condition.
    pub fn loading(&self, air_data: &AirData) -> Loading {
        self.superpose(|basis| match basis {
            Basis::Incidence => air_data.angle_of_attack_rad - self.wing.zero_lift_angle_rad,
            Basis::Flap => air_data.flap_rad,
            Basis::Aileron => air_data.aileron_rad,
            Basis::Roll => air_data.roll_rate_rad_s / air_data.airspeed_m_s,
        })
    }

    /// The wing that was solved.
    pub fn wing(&self) -> &Wing {
        &self.wing
    }

    /// Hinge moment of the right flap per dynamic pressure and deflection, m^3/rad: the whole lift
    /// that the flaps add to the right wing, at half the flap's chord (Berri 2021, section 4.1.1).
    pub fn flap_hinge_moment_m3_per_rad(&self) -> f64 {
        0.5 * self.wing.flap.chord_m * self.unit_loading(Basis::Flap).right_wing_lift_m2()
    }

    /// The same for the right aileron.
    pub fn aileron_hinge_moment_m3_per_rad(&self) -> f64 {
        0.5 * self.wing.aileron.chord_m * self.unit_loading(Basis::Aileron).right_wing_lift_m2()
    }

    fn superpose(&self, amount: impl Fn(Basis) -> f64) -> Loading {
        let mut coefficients = vec![0.0; self.unit_coefficients[0].len()];
        for (basis, unit) in BASES.into_iter().zip(&self.unit_coefficients) {
            let amount = amount(basis);
            coefficients.iter_mut().zip(unit).for_each(|(sum, a)| *sum += amount * a);
        }
        Loading { span_m: self.wing.span_m, aspect_ratio: self.wing.aspect_ratio(), coefficients }
    }
}

/// Angle of attack that one unit of `basis` adds at `theta`; deflections averaged over the cell.
fn unit_angle(wing: &Wing, basis: Basis, theta: f64, cell: f64) -> f64 {
    let (flap, aileron) = (&wing.flap, &wing.aileron);
    let mirrored = PI - theta;
    match basis {
        Basis::Incidence => 1.0,
        Basis::Flap => {
            let share = covered_share(wing, flap, theta, cell) + covered_share(wing, flap, mirrored, cell);
            flap.effectiveness() * share
        }
        Basis::Aileron => {
            let share = covered_share(wing, aileron, theta, cell) - covered_share(wing, aileron, mirrored, cell);
            aileron.effectiveness() * share
        }
        Basis::Roll => 0.5 * wing.span_m * theta.cos(),
    }
}

/// Share of the cell around `theta` that the surface on the right wing covers.
fn covered_share(wing: &Wing, surface: &ControlSurface, theta: f64, cell: f64) -> f64 {
    let theta_of = |y_m: f64| (2.0 * y_m / wing.span_m).acos();
    let from = theta_of(surface.outboard_m).max(theta - 0.5 * cell);
    let to = theta_of(surface.inboard_m).min(theta + 0.5 * cell);
    (to - from).max(0.0) / cell
}

impl Loading {
    /// CL = pi AR A_1.
    pub fn lift_coefficient(&self) -> f64 {
        PI * self.aspect_ratio * self.coefficients[0]
    }

    /// CDi = pi AR sum n A_n^2.
    pub fn induced_drag_coefficient(&self) -> f64 {
        let sum: f64 = self.coefficients.iter().enumerate().map(|(i, a)| (i + 1) as f64 * a * a).sum();
        PI * self.aspect_ratio * sum
    }

    /// Cl = -int y L' dy/(q S b) = -pi AR A_2 / 4, positive right wing down.
    pub fn roll_moment_coefficient(&self) -> f64 {
        -0.25 * PI * self.aspect_ratio * self.coefficients.get(1).copied().unwrap_or(0.0)
    }

    /// Lift per length over dynamic pressure, L'/q = 4 b sum A_n sin(n theta), m.
    pub fn lift_per_length_m(&self, y_m: f64) -> f64 {
        let theta = (2.0 * y_m / self.span_m).acos();
        4.0 * self.span_m * self.sum(|n| (n * theta).sin())
    }

    /// Lift of the whole wing over dynamic pressure, m^2.
    pub fn lift_m2(&self) -> f64 {
        PI * self.span_m * self.span_m * self.coefficients[0]
    }

    /// Lift of the right wing (y > 0) over dynamic pressure, m^2.
    pub fn right_wing_lift_m2(&self) -> f64 {
        self.outboard_lift_m2(0.0)
    }

    /// Lift from y to the right tip over dynamic pressure, int_y L' ds / q, m^2.
    pub fn outboard_lift_m2(&self, y_m: f64) -> f64 {
        let theta = (2.0 * y_m / self.span_m).acos();
        2.0 * self.span_m * self.span_m * self.sum(|n| sine_sine(n, theta))
    }

    /// Moment about y of the lift from y to the right tip over dynamic pressure,
    /// int_y (s - y) L' ds / q, m^3, positive tip-up. Integrated by parts it is the integral of
    /// [`Loading::outboard_lift_m2`].
    pub fn outboard_moment_m3(&self, y_m: f64) -> f64 {
        let theta = (2.0 * y_m / self.span_m).acos();
        let integral = |n: f64| {
            let inner =
                if n == 1.0 { theta.sin() - theta * theta.cos() } else { sine_sine(n - 1.0, theta) / (n - 1.0) };
            0.5 * (inner - sine_sine(n + 1.0, theta) / (n + 1.0))
        };
        self.span_m.powi(3) * self.sum(integral)
    }

    /// delta = sum_{n > 1} n (A_n / A_1)^2: induced drag above that of an elliptic loading.
    pub fn induced_drag_excess(&self) -> f64 {
        let ratio = |a: &f64| a / self.coefficients[0];
        self.coefficients.iter().enumerate().skip(1).map(|(i, a)| (i + 1) as f64 * ratio(a) * ratio(a)).sum()
    }

    fn sum(&self, factor: impl Fn(f64) -> f64) -> f64 {
        self.coefficients.iter().enumerate().map(|(i, a)| a * factor((i + 1) as f64)).sum()
    }
}

/// int_0^theta sin(n phi) sin(phi) dphi, n a whole number.
fn sine_sine(n: f64, theta: f64) -> f64 {
    let sine = |m: f64| if m == 0.0 { theta } else { (m * theta).sin() / m };
    0.5 * (sine(n - 1.0) - sine(n + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wing::Planform;

    const POINTS: usize = 80;

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
    }

    fn thin_airfoil_wing(aspect_ratio: f64, planform: impl Fn(f64) -> Planform) -> Wing {
        Wing {
            span_m: aspect_ratio,
            planform: planform(1.0),
            section_lift_slope_per_rad: 2.0 * PI,
            zero_lift_angle_rad: 0.0,
            ..Wing::reference()
        }
    }

    /// Berri 2021, section 4.1.1: 50 m/s, alpha 5, aileron 5, flap 10 degrees.
    fn thesis_case() -> AirData {
        AirData {
            dynamic_pressure_pa: 0.5 * 1.225 * 50.0 * 50.0,
            airspeed_m_s: 50.0,
            angle_of_attack_rad: 5.0_f64.to_radians(),
            roll_rate_rad_s: 0.0,
            flap_rad: 10.0_f64.to_radians(),
            aileron_rad: 5.0_f64.to_radians(),
        }
    }

    /// CL = a0 alpha / (1 + a0/(pi AR)), CDi = CL^2/(pi AR).
    #[test]
    fn elliptic_wing_has_its_closed_solution() {
        let wing = thin_airfoil_wing(10.0, |_| Planform::Elliptic { root_chord_m: 4.0 / PI });
        let alpha = AirData { flap_rad: 0.0, aileron_rad: 0.0, ..thesis_case() };
        let loading = LiftingLine::new(wing, POINTS).loading(&alpha);
        close(loading.lift_coefficient(), 0.456_926_1, 1e-7);
        close(loading.induced_drag_coefficient(), 0.006_645_72, 1e-7);
        close(loading.induced_drag_excess(), 0.0, 1e-12);
    }

    /// 1/CL_alpha = 1/a0 + (1 + tau)/(pi AR).
    #[test]
    fn rectangular_wings_have_glauerts_factors() {
        for (aspect_ratio, slope, tau, delta, [a3, a5]) in [
            (4.0, 4.028_387, 0.119_455, 0.028_477, [0.030_327, 0.005_460]),
            (6.0, 4.530_425, 0.160_660, 0.048_290, [0.029_257, 0.006_223]),
            (8.0, 4.837_704, 0.195_180, 0.067_611, [0.027_408, 0.006_565]),
            (10.0, 5.046_791, 0.224_931, 0.085_907, [0.025_502, 0.006_683]),
            (12.0, 5.199_085, 0.251_105, 0.103_073, [0.023_734, 0.006_677]),
            (20.0, 5.544_274, 0.332_747, 0.161_734, [0.018_351, 0.006_191]),
        ] {
            let wing = thin_airfoil_wing(aspect_ratio, |chord_m| Planform::Rectangular { chord_m });
            let loading = LiftingLine::new(wing, POINTS).unit_loading(Basis::Incidence);
            let lift_slope = loading.lift_coefficient();
            close(lift_slope, slope, 1e-4);
            close((1.0 / lift_slope - 0.5 / PI) * PI * aspect_ratio - 1.0, tau, 1e-4);
            close(loading.induced_drag_excess(), delta, 1e-4);
            close(loading.coefficients[2], a3, 1e-5);
            close(loading.coefficients[4], a5, 1e-5);
        }
    }

    #[test]
    fn thesis_case_has_the_reference_coefficients() {
        let (line, case) = (LiftingLine::new(Wing::reference(), POINTS), thesis_case());
        let loading = line.loading(&case);
        close(loading.lift_coefficient(), 0.829_305, 5e-4);
        close(loading.induced_drag_coefficient(), 0.025_640, 1e-4);
        close(loading.roll_moment_coefficient(), -0.028_855, 1e-4);
        let lift_n = case.dynamic_pressure_pa * loading.lift_m2();
        close(lift_n, 12_698.7, 12_698.7 * 5e-4 / 0.829_305);
        close(lift_n, case.dynamic_pressure_pa * 10.0 * loading.lift_coefficient(), 1e-8);
    }

    /// Lift that flaps and ailerons add to the right wing, carry-over included, and hinge moments.
    #[test]
    fn thesis_case_has_the_reference_surface_loads() {
        let (line, case) = (LiftingLine::new(Wing::reference(), POINTS), thesis_case());
        let (q, flap, aileron) = (case.dynamic_pressure_pa, case.flap_rad, case.aileron_rad);
        let lift_n = |basis, deflection: f64| q * deflection * line.unit_loading(basis).right_wing_lift_m2();
        close(lift_n(Basis::Flap, flap), 1730.48, 0.002 * 1730.48);
        close(lift_n(Basis::Aileron, aileron), 619.18, 0.002 * 619.18);
        close(q * flap * line.flap_hinge_moment_m3_per_rad(), 216.31, 0.002 * 216.31);
        close(q * aileron * line.aileron_hinge_moment_m3_per_rad(), 77.40, 0.002 * 77.40);
    }

    #[test]
    fn hinge_law_converges_to_the_reference() {
        for (points, tolerance) in [(POINTS, 1e-3), (400, 2e-4)] {
            let line = LiftingLine::new(Wing::reference(), points);
            close(line.flap_hinge_moment_m3_per_rad(), 0.809_379, tolerance);
            close(line.aileron_hinge_moment_m3_per_rad(), 0.579_210, tolerance);
        }
    }

    /// Lift slope of the wing and what an aileron rolls, per rad.
    #[test]
    fn wing_has_its_lift_slope_and_aileron_its_power() {
        let line = LiftingLine::new(Wing::reference(), 400);
        close(line.unit_loading(Basis::Incidence).lift_coefficient(), 4.868_398, 1e-5);
        close(line.unit_loading(Basis::Aileron).roll_moment_coefficient(), -0.330_650, 1e-5);
    }

    /// Roll damping per p b/(2 V); the reference is a solution with 2000 points.
    #[test]
    fn roll_is_damped() {
        let loading = LiftingLine::new(Wing::reference(), POINTS).unit_loading(Basis::Roll);
        close(loading.roll_moment_coefficient() / 5.0, -0.624_036, 1e-4);
        close(loading.lift_coefficient(), 0.0, 1e-12);
    }

    /// At every collocation point a section lifts by its effective angle of attack alpha - w/V, with the
    /// downwash integrated numerically. The midpoint rule, staggered about the singularity, is exact for
    /// the principal value of a trigonometric polynomial.
    #[test]
    fn downwash_turns_the_flow() {
        let (points, fine) = (20, 84);
        let line = LiftingLine::new(Wing::reference(), points);
        let case = AirData { flap_rad: 0.0, roll_rate_rad_s: 0.7, aileron_rad: 0.0, ..thesis_case() };
        let loading = line.loading(&case);
        let half_span_m = 0.5 * line.wing.span_m;
        for j in 1..=points {
            let theta = PI * j as f64 / (points + 1) as f64;
            let y_m = half_span_m * theta.cos();
            // w/V = 1/(4 pi) sum over s of d(Gamma/V)/(y - s), where Gamma/V = (L'/q)/2.
            let downwash: f64 = (0..fine)
                .map(|i| {
                    let phi = PI * (i as f64 + 0.5) / f64::from(fine);
                    let slope = -2.0 * line.wing.span_m * loading.sum(|n| n * (n * phi).cos());
                    slope * PI / f64::from(fine) / (y_m - half_span_m * phi.cos())
                })
                .sum::<f64>()
                / (4.0 * PI);
            let angle = case.angle_of_attack_rad - line.wing.zero_lift_angle_rad + 0.7 * y_m / 50.0;
            let lift_per_length_m = line.wing.section_lift_slope_per_rad * (angle - downwash);
            close(loading.lift_per_length_m(y_m), lift_per_length_m, 1e-10);
        }
    }

    /// Lift and moment outboard of a point, in closed form, are the integrals of the lift per length.
    #[test]
    fn outboard_lift_and_moment_are_integrals() {
        let loading = LiftingLine::new(Wing::reference(), POINTS).loading(&thesis_case());
        for y_m in [0.0_f64, 1.2, 3.1, 4.6] {
            let (strips, angle) = (20_000, (y_m / 5.0).acos());
            let (mut lift_m2, mut moment_m3) = (0.0, 0.0);
            for i in 0..strips {
                let theta = angle * (f64::from(i) + 0.5) / f64::from(strips);
                let s_m = 5.0 * theta.cos();
                let strip_m2 = loading.lift_per_length_m(s_m) * 5.0 * theta.sin() * angle / f64::from(strips);
                lift_m2 += strip_m2;
                moment_m3 += (s_m - y_m) * strip_m2;
            }
            close(loading.outboard_lift_m2(y_m), lift_m2, 1e-6);
            close(loading.outboard_moment_m3(y_m), moment_m3, 1e-6);
        }
    }

    /// Flaps load both wings alike, ailerons oppositely.
    #[test]
    fn surfaces_keep_their_symmetry() {
        let line = LiftingLine::new(Wing::reference(), POINTS);
        let (flap, aileron) = (line.unit_loading(Basis::Flap), line.unit_loading(Basis::Aileron));
        for y_m in [0.4, 1.3, 2.75, 3.9, 4.9] {
            close(flap.lift_per_length_m(y_m), flap.lift_per_length_m(-y_m), 1e-10);
            close(aileron.lift_per_length_m(y_m), -aileron.lift_per_length_m(-y_m), 1e-10);
            assert!(flap.lift_per_length_m(y_m) > 0.0 && aileron.lift_per_length_m(y_m) > 0.0);
        }
    }
}
