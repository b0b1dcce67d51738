//! Least-squares fit of the closed form of the map: nothing learned, the reference that a chain has to meet.
//!
//! What: y' = 1/2 sum over the active pair of N_j (1 + (u cos(theta + psi_j) - v sin(theta + psi_j))/(1 + r)), with
//! psi = 0, +120, -120 degrees, u = zeta cos phi, v = zeta sin phi, fitted in N_1..N_3, u and v.
//! Update rule: Gauss-Newton from the healthy motor; a noise of equal size on y weighs (1 + r)^2 on y'.

use domain::FaultVector;
use ema::commutation::{ACTIVE_PAIRS, bin_centre_rad, sector};
use numerics::Symmetric;
use reduction::load_invariant;

/// Steps; the fifth already changes nothing that matters.
const STEPS: usize = 8;
/// Keeps the normal equations definite, far below the information of one sample.
const RIDGE: f64 = 1e-9;

/// A sample of the raw map: its bin, its value in units of k_nom, and the load ratio there.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub bin: usize,
    pub y: f64,
    pub r: f64,
}

/// The fault vector of the closed form that is nearest to the samples.
pub fn fit(samples: &[Sample]) -> FaultVector {
    let mut p = [1.0, 1.0, 1.0, 0.0, 0.0];
    for _ in 0..STEPS {
        let mut information = Symmetric::diagonal(&[RIDGE; 5]);
        let mut score = [0.0; 5];
        for sample in samples {
            let (value, gradient) = closed_form(&p, sample.bin, sample.r);
            let residual = load_invariant::from_raw(sample.y, sample.r) - value;
            let weight = (1.0 + sample.r) * (1.0 + sample.r);
            information.add_outer(&gradient, weight);
            score.iter_mut().zip(gradient).for_each(|(sum, g)| *sum += weight * g * residual);
        }
        let step = information.cholesky().expect("a ridge is positive definite").solve(&score);
        p.iter_mut().zip(step).for_each(|(p, step)| *p += step);
    }
    let [a, b, c, u, v] = p;
    let faults = [1.0 - a, 1.0 - b, 1.0 - c, 0.5 * (1.0 + u), 0.5 * (1.0 + v)];
    FaultVector(faults.map(|k| k.clamp(0.0, 1.0)).to_vec())
}

/// y' and its derivatives by the parameters.
fn closed_form(p: &[f64; 5], bin: usize, r: f64) -> (f64, [f64; 5]) {
    const THIRD: f64 = std::f64::consts::TAU / 3.0;
    let (mut value, mut gradient) = (0.0, [0.0; 5]);
    let (positive, negative) = ACTIVE_PAIRS[sector(bin)];
    for phase in [positive, negative] {
        let (sin, cos) = (bin_centre_rad(bin) + [0.0, THIRD, -THIRD][phase]).sin_cos();
        let flux = 1.0 + (p[3] * cos - p[4] * sin) / (1.0 + r);
        value += 0.5 * p[phase] * flux;
        gradient[phase] = 0.5 * flux;
        gradient[3] += 0.5 * p[phase] * cos / (1.0 + r);
        gradient[4] -= 0.5 * p[phase] * sin / (1.0 + r);
    }
    (value, gradient)
}
