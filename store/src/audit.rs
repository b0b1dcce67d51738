//! What was checked of the audit log.

use domain::{ContentHash, OperatorId};

/// A chain of the audit log, as it was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditChain {
    /// Whose; `None` is that of the installation.
    pub operator: Option<OperatorId>,
    /// How many records follow each other from the first one on.
    pub records: u64,
    /// The hash of the last of them. Who has noted it elsewhere can tell whether newer records were cut off.
    pub newest: ContentHash,
    /// What is wrong after them.
    pub damage: Option<AuditDamage>,
}

/// Where a chain is broken: records behind that place prove nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditDamage {
    /// The place in the chain.
    pub sequence: u64,
    /// What shows it.
    pub detail: String,
}
