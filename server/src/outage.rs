//! Outages as callers are told of them.

use store::StoreError;

/// A reason why nothing can be stored now; whoever runs the service has to see to it, whoever sends has to come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outage {
    /// A full disk, or an exhausted quota.
    StorageFull,
    /// A standby, or a file that must not be written.
    ReadOnly,
    /// Another process holds the database.
    Locked,
    /// A failing disk.
    IoError,
    /// A file that was moved, deleted or replaced while it was open.
    Displaced,
}

impl Outage {
    /// The words for callers.
    pub fn words(self) -> &'static str {
        match self {
            Self::StorageFull => "there is no room left to store anything",
            Self::ReadOnly => "the database takes no writes, it is read-only",
            Self::Locked => "someone else has held the database for too long",
            Self::IoError => "the storage of the database fails",
            Self::Displaced => "the file of the database was moved, deleted or replaced",
        }
    }

    /// The outage that an error of the store is, if it is one.
    pub fn from_error(error: &StoreError) -> Option<Self> {
        match error {
            StoreError::StorageFull(_) => Some(Self::StorageFull),
            StoreError::ReadOnly => Some(Self::ReadOnly),
            StoreError::Busy(_) => Some(Self::Locked),
            StoreError::StorageFails(_) => Some(Self::IoError),
            StoreError::Displaced { .. } => Some(Self::Displaced),
            _ => None,
        }
    }
}
