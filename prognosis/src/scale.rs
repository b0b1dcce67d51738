//! The measure of a fleet: how long its lives are, and what a fault amounts to that ends one.
//!
//! - What: times as shares of a characteristic life, severities as shares of the way from nominal to limit.
//! - Update rule: both are rounded to 2^-40 of that, so neither the unit of time nor that of severity changes a result:
//!   a power of two changes no bit, any other factor no more than rounding does. All that learns and follows counts in
//!   *reference hours* and *reference deviations*, in which actuators have always counted: their own are one of each.
//! - Requirements: a characteristic life above zero.

use domain::{FaultGroup, FaultModel};
use serde::{Deserialize, Serialize};

/// Reference hours of a characteristic life.
pub const REFERENCE_LIFE_FH: f64 = 5000.0;
/// Reference deviation at the limit of a fault.
pub const REFERENCE_LIMIT: f64 = 0.25;
/// Shares are whole multiples of one part in this.
const GRAIN: f64 = (1_u64 << 40) as f64;

/// A fleet's measure of time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// The characteristic life, in the user's unit of time; above zero, finite.
    pub characteristic_life: f64,
}

impl Scale {
    /// A time in reference hours.
    pub fn reference_fh(&self, time: f64) -> f64 {
        rounded(time / self.characteristic_life) * REFERENCE_LIFE_FH
    }

    /// A time in the user's unit, from reference hours.
    pub fn time(&self, reference_fh: f64) -> f64 {
        reference_fh / REFERENCE_LIFE_FH * self.characteristic_life
    }
}

/// The reference deviation of a severity, the share of the way from nominal (0) to the limit (1).
pub fn reference_deviation(severity: f64) -> f64 {
    rounded(severity) * REFERENCE_LIMIT
}

/// Faults of these names, each by itself, in reference deviations.
pub fn reference_faults(names: Vec<String>) -> FaultModel {
    let groups = (0..names.len()).map(|index| FaultGroup::Free { index }).collect();
    FaultModel { nominal: vec![0.0; names.len()], names, groups }
}

fn rounded(share: f64) -> f64 {
    (share * GRAIN).round() / GRAIN
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_unit_of_time_changes_nothing(share in 0.0..5.0f64, life in 1e-3..1e9f64, doublings in -20..20i32, factor in 0.01..100.0f64) {
            let (scale, time) = (Scale { characteristic_life: life }, share * life);
            let in_units = |factor: f64| Scale { characteristic_life: factor * life }.reference_fh(factor * time);
            prop_assert_eq!(in_units(2.0_f64.powi(doublings)).to_bits(), scale.reference_fh(time).to_bits());
            prop_assert!((in_units(factor) - scale.reference_fh(time)).abs() <= REFERENCE_LIFE_FH / GRAIN);
            prop_assert!((scale.time(scale.reference_fh(time)) - time).abs() <= 1e-9 * life);
        }
    }
}
