//! The elevator of a fighter: hinge moment of an all-moving tail while the aircraft answers to it.
//!
//! - What: the linearised longitudinal motion x' = A x + B delta of the F-16 at sea level and 153 m/s, and the hinge
//!   moment H = C x + D delta; x = [dV, d alpha, d theta, d q].
//! - Update rule: exact zero-order hold, x+ = Phi x + Gamma delta with [Phi Gamma; 0 1] = exp([A B; 0 0] dt).
//! - Units: A and B are in ft/s and per degree, C and D in SI and per radian; here the deflection is in degrees, the
//!   moment in N m. The throttle stays where it is.
//! - Source: Berri 2021, eq. 3.17; the matrices as printed, whose signs in A(4,2) and B(4,2) make the aircraft stable.

const FOOT_M: f64 = 0.3048;

/// A: ft/s, rad, rad, rad/s.
pub const STATE_MATRIX: [[f64; 4]; 4] = [
    [-1.9311e-2, 8.8157, -32.170, -0.57499],
    [-2.5389e-4, -1.0189, 0.0, 0.90506],
    [0.0, 0.0, 0.0, 1.0],
    [0.0, -0.82225, 0.0, -1.0774],
];
/// The elevator's column of B, per degree.
const CONTROL: [f64; 4] = [0.17370, -2.1499e-3, 0.0, 0.17555];
/// C: N m per m/s, rad, rad, rad/s.
const MOMENT: [f64; 4] = [-5.9978, -8.9812e3, 0.0, -2.6102e2];
/// The elevator's entry of D, N m/rad.
const FEEDTHROUGH_NM_PER_RAD: f64 = 9.4643e3;

/// Elevator deflections up and then down, or the other way round, degrees about the trimmed one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doublet {
    /// The first deflection; the second is its opposite.
    pub amplitude_deg: f64,
    /// When it begins, s.
    pub from_s: f64,
    /// How long each deflection is held, s.
    pub half_s: f64,
}

impl Doublet {
    /// Deflection at the `step`-th of steps of `step_s`, degrees.
    fn at(&self, step: usize, step_s: f64) -> f64 {
        let index = |time_s: f64| (time_s / step_s).round() as usize;
        let (begins, turns, ends) =
            (index(self.from_s), index(self.from_s + self.half_s), index(self.from_s + 2.0 * self.half_s));
        match step {
            _ if (begins..turns).contains(&step) => self.amplitude_deg,
            _ if (turns..ends).contains(&step) => -self.amplitude_deg,
            _ => 0.0,
        }
    }

    /// Hinge moments of the elevator at the steps from time zero, N m, positive against a positive deflection; each
    /// with the deflection that begins at its step.
    pub fn hinge_moments_nm(&self, step_s: f64, steps: usize) -> Vec<f64> {
        let mut aircraft = Longitudinal::new(step_s);
        (0..steps).map(|step| aircraft.next_moment_nm(self.at(step, step_s))).collect()
    }
}

/// The aircraft, in steps of one length.
#[derive(Debug, Clone)]
struct Longitudinal {
    transition: [[f64; 5]; 5],
    /// State, ft/s and rad, and the held deflection.
    state: [f64; 5],
}

impl Longitudinal {
    /// The trimmed aircraft.
    fn new(step_s: f64) -> Self {
        let mut rate = [[0.0; 5]; 5];
        for ((row, state), control) in rate.iter_mut().zip(STATE_MATRIX).zip(CONTROL) {
            row[..4].copy_from_slice(&state);
            row[4] = control;
        }
        Self { transition: exponential(rate, step_s), state: [0.0; 5] }
    }

    /// The moment under a deflection; the state moves on by a step.
    fn next_moment_nm(&mut self, deflection_deg: f64) -> f64 {
        self.state[4] = deflection_deg;
        let [speed, rest @ ..] = self.state;
        let felt = [speed * FOOT_M, rest[0], rest[1], rest[2]];
        let moment: f64 = MOMENT.iter().zip(felt).map(|(c, x)| c * x).sum();
        self.state = self.transition.map(|row| row.iter().zip(self.state).map(|(a, x)| a * x).sum());
        moment + FEEDTHROUGH_NM_PER_RAD * deflection_deg.to_radians()
    }
}

/// exp(A t): its Taylor series at t / 2^s, squared s times.
fn exponential(matrix: [[f64; 5]; 5], t: f64) -> [[f64; 5]; 5] {
    const SQUARINGS: i32 = 10;
    const TERMS: i32 = 18;
    let scaled = matrix.map(|row| row.map(|entry| entry * t / f64::from(1 << SQUARINGS)));
    let identity: [[f64; 5]; 5] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    // Horner: I + S/1 (I + S/2 (I + ...)).
    let mut result = identity;
    for term in (1..=TERMS).rev() {
        let product = product(&scaled, &result);
        result = std::array::from_fn(|i| std::array::from_fn(|j| identity[i][j] + product[i][j] / f64::from(term)));
    }
    (0..SQUARINGS).fold(result, |power, _| product(&power, &power))
}

fn product(a: &[[f64; 5]; 5], b: &[[f64; 5]; 5]) -> [[f64; 5]; 5] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..5).map(|k| a[i][k] * b[k][j]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
    }

    /// Computed by an independent prototype.
    const GOLDEN: [(usize, f64); 7] = [
        (100, 330.3663927929986),
        (199, -383.1353387068054),
        (201, -1060.2877248345242),
        (299, -274.26125519375825),
        (301, 83.11292864084503),
        (500, 198.33248660554952),
        (1000, 2.327411884751096),
    ];

    fn two_degrees() -> Vec<f64> {
        Doublet { amplitude_deg: 2.0, from_s: 1.0, half_s: 1.0 }.hinge_moments_nm(0.01, 2001)
    }

    #[test]
    fn a_doublet_has_its_golden_hinge_moments() {
        let moments = two_degrees();
        for (step, moment_nm) in GOLDEN {
            close(moments[step], moment_nm, 1e-8);
        }
        close(moments.iter().copied().fold(f64::INFINITY, f64::min), -1109.5750556848086, 1e-8);
        close(moments.iter().copied().fold(f64::NEG_INFINITY, f64::max), 472.81397031760935, 1e-8);
    }

    /// The hold is exact: other steps, the same moments.
    #[test]
    fn moments_do_not_depend_on_the_step() {
        let fine = Doublet { amplitude_deg: 2.0, from_s: 1.0, half_s: 1.0 }.hinge_moments_nm(0.001, 10_001);
        for (coarse, fine) in two_degrees().iter().zip(fine.iter().step_by(10)) {
            close(*coarse, *fine, 1e-7);
        }
    }

    /// Short period and phugoid: the trace, the determinant, and the characteristic polynomial at each of them.
    #[test]
    fn the_aircraft_has_its_two_golden_modes() {
        let eigenvalues = [(-1.0495552821550413, 0.8630344776438972), (-0.008250217844958767, 0.05974284479720585)];
        let matrix = nalgebra::Matrix4::from_fn(|i, j| STATE_MATRIX[i][j]);
        for (re, im) in eigenvalues {
            let root = nalgebra::Complex::new(re, im);
            let shifted = nalgebra::Matrix4::from_fn(|i, j| {
                nalgebra::Complex::from(matrix[(i, j)]) - if i == j { root } else { nalgebra::Complex::from(0.0) }
            });
            close(shifted.determinant().norm(), 0.0, 1e-9);
        }
        let product: f64 = eigenvalues.iter().map(|(re, im)| re * re + im * im).product();
        close(matrix.trace(), 2.0 * (eigenvalues[0].0 + eigenvalues[1].0), 1e-12);
        close(matrix.determinant(), product, 1e-12);
    }
}
