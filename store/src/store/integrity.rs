//! The whole database: its digest, its checks, and its copies.

use std::path::Path;

use domain::{Component, Timestamp};

use super::{Backend, Store, backend};
use crate::{Digest, StoreError, Verification, sqlite};

impl Store {
    /// The digest of all estimates and states.
    pub async fn digest(&self) -> Result<Digest, StoreError> {
        backend!(self, digest())
    }

    /// Compares every row that carries a checksum with it, over all operators. Damaged rows are part of the
    /// answer; an error is what keeps the rows from being read at all.
    pub async fn verify(&self) -> Result<Verification, StoreError> {
        backend!(self, verify())
    }

    /// Compares only those tables from which all others can be made anew: bundles, masks, priors, uploads,
    /// events and sensor configurations.
    pub async fn verify_sources(&self) -> Result<Verification, StoreError> {
        backend!(self, verify_sources())
    }

    /// Throws away what follows from uploads and events, for workers to find it anew: of each operator where
    /// its components were installed (which is found anew at once), and of the next components behind
    /// `after` all results of the generations that answer and will answer. Returns the last of these
    /// components, to go on behind it, or `None` when there is none. Prognoses that were issued stay, and so do
    /// generations that answered before.
    pub async fn forget_derived(
        &self,
        after: Option<&Component>,
        now: Timestamp,
    ) -> Result<Option<Component>, StoreError> {
        backend!(self, forget_derived(after, now))
    }

    /// Takes an SQLite file, a copy, for all there is: also one that was not closed by whoever wrote it, which
    /// [`Store::open`] refuses without its log. Whether it is such a one.
    pub async fn adopt(url: &str) -> Result<bool, StoreError> {
        sqlite::adopt(url).await
    }

    /// Writes a copy of an SQLite database as of one moment to a new file; whoever writes to the database is
    /// not held up.
    pub async fn copy_to(&self, path: &Path) -> Result<(), StoreError> {
        backend!(self, copy_to(path))
    }

    /// The faults in the structure of an SQLite file, in its own words; nothing if it is sound.
    pub async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        backend!(self, check_structure())
    }
}
