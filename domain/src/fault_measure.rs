//! How a fleet measures faults of its own.

use serde::{Deserialize, Serialize};

/// What the figures of an own diagnosis mean, for faults that no map is read for: a crack's length, a health index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultMeasure {
    /// The value of each fault at which the component has failed, in the faults' own units; on which side of nominal it
    /// lies says in which direction faults grow.
    pub limits: Vec<f64>,
    /// Standard deviation of one reading of each fault where an upload does not tell it, in the faults' own units;
    /// above zero.
    pub sigma: Vec<f64>,
    /// How long a usual life of the fleet is, flight hours.
    pub characteristic_life_fh: f64,
}
