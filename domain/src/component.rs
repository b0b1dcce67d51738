//! The thing that has a remaining life: a unit, not the place where it is installed.

use serde::{Deserialize, Serialize};

use crate::{OperatorId, PartNumber, SerialNumber};

/// One physical actuator of one operator. Its history follows it from tail to tail.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Component {
    /// Who operates it.
    pub operator: OperatorId,
    /// Part number.
    pub part_number: PartNumber,
    /// Serial number.
    pub serial_number: SerialNumber,
}

/// A component between two overhauls. Filters, priors and generations belong to a life.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Life {
    /// The component.
    pub component: Component,
    /// 0 for the life that began when the component was new, then one more per overhaul.
    pub overhaul_index: u32,
}
