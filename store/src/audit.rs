//! Chains of the audit log, checked.

use domain::{ContentHash, OperatorId};

/// A chain of the audit log, as it was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditChain {
    /// Its operator; `None` is that of the installation.
    pub operator: Option<OperatorId>,
    /// Number of records that follow each other from the first one on.
    pub records: u64,
    /// The hash of the last of them. Who has noted it elsewhere can tell whether newer records were cut off.
    pub newest: ContentHash,
    /// The damage after them.
    pub damage: Option<AuditDamage>,
}

/// The place where a chain is broken: records behind that place prove nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditDamage {
    /// The place in the chain.
    pub sequence: u64,
    /// The sign of it.
    pub detail: String,
}
