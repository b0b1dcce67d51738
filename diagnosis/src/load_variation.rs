//! Raw maps under loads that the training maps were not made at.
//!
//! What: the raw map of another load, from the load-invariant one.
//! Rule: r_new = r + a + b cos theta + c sin theta, a ~ N(shift, spread), b and c ~ N(0, swing), then
//! y_new = y'(1 + r_new) - r_new. The eccentricity that y' shows stands for a true one of
//! zeta (1 + mean r_new)/(1 + mean r).
//! Source: closed form of the map at load ratio r, see [`reduction::load_invariant`].

use numerics::Stream;
use serde::{Deserialize, Serialize};

/// How the load ratio in service differs from that of the training maps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoadVariation {
    /// Mean difference.
    pub shift: f64,
    /// Standard deviation of the difference between flights.
    pub spread: f64,
    /// Standard deviation of its variation around a turn of the rotor.
    pub swing: f64,
}

impl LoadVariation {
    /// Training maps that already cover the loads of service.
    pub const NONE: Self = Self { shift: 0.0, spread: 0.0, swing: 0.0 };

    /// Loads of up to 0.5 N m at the shaft of the 48 V reference actuator on unloaded training maps:
    /// passes over each angle average aiding and opposing load to about an eighth of the back-EMF.
    pub const REFERENCE_ACTUATOR: Self = Self { shift: 0.02, spread: 0.12, swing: 0.02 };

    /// Load ratios of another flight, a map of as many bins as `r`.
    pub fn vary(&self, r: &[f64], stream: &mut Stream) -> Vec<f64> {
        let common = self.shift + self.spread * stream.normal();
        let (b, c) = (self.swing * stream.normal(), self.swing * stream.normal());
        let width_rad = std::f64::consts::TAU / r.len() as f64;
        let at = |(bin, r): (usize, &f64)| {
            let angle_rad = (bin as f64 + 0.5) * width_rad;
            r + common + b * libm::cos(angle_rad) + c * libm::sin(angle_rad)
        };
        r.iter().enumerate().map(at).collect()
    }
}
