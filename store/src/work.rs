//! What a worker leases, reads and writes.
//!
//! Workers lease components, not uploads: whoever holds a lease is alone with the component, and
//! what it writes is refused once another holds a later one.

use domain::{Component, ContentHash, Estimate, Life, Prognosis, State, Timestamp, Upload, UploadId};

/// The right to process one component for a while.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lease {
    /// The component.
    pub component: Component,
    /// How many inputs of the component had been stored when it was leased.
    pub input_revision: i64,
    /// Number of this lease among all of the component: a later lease makes this one worthless.
    pub fence: i64,
    /// Attempts since the last completed one that ended without a result; 0 at first.
    pub attempts: u32,
}

/// Which (bundle, prior) pair judges a life.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Generation {
    /// 1 for the first of a life.
    pub number: u32,
    /// The bundle.
    pub model: ContentHash,
    /// The fleet prior.
    pub prior: ContentHash,
}

/// Everything that the results of a life are computed from.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeInputs {
    /// The newest life of the leased component.
    pub life: Life,
    /// Its active generation.
    pub generation: Generation,
    /// Uploads that wait for their estimate, in the order of the life.
    pub unestimated: Vec<Upload>,
    /// Estimates of the generation so far, in the order of the life.
    pub estimates: Vec<Estimate>,
    /// States of the generation so far, by block.
    pub states: Vec<State>,
}

/// What a worker found; written in one transaction.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeResults {
    /// Estimates of uploads that waited for them.
    pub estimates: Vec<Estimate>,
    /// Uploads that cannot be processed, each with the reason.
    pub set_aside: Vec<(UploadId, String)>,
    /// The states of this block and all later ones are replaced by `states`; `None` keeps all.
    pub states_from: Option<u64>,
    /// States, none of them of a block before `states_from`.
    pub states: Vec<State>,
    /// The prognosis that is served from now on, if there is a new one.
    pub prognosis: Option<Prognosis>,
    /// When the prognosis was issued.
    pub now: Timestamp,
}

/// Whether results were written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Completion {
    /// They were.
    Done,
    /// The lease had expired or another one superseded it: nothing was written.
    Fenced,
}
