//! Leases, and what a worker reads and writes for one.
//!
//! Workers lease components, not uploads: whoever holds a lease is alone with the component, and
//! what it writes is refused once another holds a later one.

use std::{sync::Arc, time::Duration};

use domain::{
    Component, ContentHash, Estimate, Life, Prognosis, SensorConfiguration, SetAside, State, Timestamp, Upload,
};

use crate::{Checkpoint, Planned};

/// The right to process one component for a while.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lease {
    /// The component.
    pub component: Component,
    /// Number of inputs of the component that had been stored when it was leased.
    pub input_revision: i64,
    /// Number of this lease among all of the component: a later lease makes this one worthless.
    pub fence: i64,
    /// Attempts since the last completed one that ended without a result; 0 at first.
    pub attempts: u32,
}

impl Lease {
    /// Most doublings of the time of a lease.
    const DOUBLINGS: u32 = 3;

    /// Time for which a component is claimed: `first`, twice as long after each attempt that ended without a result,
    /// and 8 times as long at most. So an analysis that outlasts a lease ends within a later one, and a worker that
    /// dies does not keep a component for ever.
    pub fn duration(first: Duration, attempts: u32) -> Duration {
        first.saturating_mul(1 << attempts.min(Self::DOUBLINGS))
    }
}

/// The (bundle, prior) pair that judges a life.
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
    /// A life of the leased component that has something to process.
    pub life: Life,
    /// Its newest generation. While that is not the one that answers, it has still to be made: from all
    /// uploads of the life.
    pub generation: Generation,
    /// The component's hours since new at which the life began: 0, or those of an overhaul.
    pub began_fh: f64,
    /// Uploads that have no estimate in this generation yet, in the order of the life.
    pub unestimated: Vec<Unestimated>,
    /// Estimates of the generation so far, in the order of the life: also those that were excluded
    /// before, because whether they are is found anew from the whole life.
    pub estimates: Vec<Estimate>,
    /// States of the generation so far, by block.
    pub states: Vec<State>,
    /// What is planned for the tail that the component is on; `None` where nothing is, and of an earlier life.
    pub planned: Option<Planned>,
}

/// An upload that waits for its estimate, with everything that the estimate is a function of.
#[derive(Debug, Clone, PartialEq)]
pub struct Unestimated {
    /// The upload.
    pub upload: Upload,
    /// Time at which it was received, or last tried again: by the clock of then it must not come from the future.
    pub received_at: Timestamp,
    /// The configuration of the tail that was in force at `upload.recorded_at`; `None` when the tail
    /// has none of that time, so that the bundle's default applies.
    pub sensor_configuration: Option<Arc<SensorConfiguration>>,
}

/// Results of a worker about one life; written in one transaction with that of the component's others.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeResults {
    /// The life of the component, by its number.
    pub overhaul_index: u32,
    /// The generation that they are of; it answers for the life from now on.
    pub generation: u32,
    /// Estimates of uploads that waited for them.
    pub estimates: Vec<Estimate>,
    /// Uploads that waited for an estimate and have none. They stay set aside until they are tried
    /// again or voided.
    pub set_aside: Vec<SetAside>,
    /// All uploads of the life that have an estimate (old or new) and that a rule over the whole life
    /// excludes. The list replaces the previous one: an upload that is no longer in it counts again.
    pub excluded: Vec<SetAside>,
    /// The states of this block and all later ones are replaced by `states`; `None` keeps all.
    pub states_from: Option<u64>,
    /// States, none of them of a block before `states_from`.
    pub states: Vec<State>,
    /// Checkpoints to keep. Earlier ones stay as long as they are of a block before `states_from` or have
    /// the digest of their block's state in `states`; of each run of [`Checkpoint::RUN`] blocks the last.
    pub checkpoints: Vec<Checkpoint>,
    /// The prognosis that is served from now on; `None` keeps the previous one, unless no estimate of
    /// the life counts any longer: then nothing is served.
    pub prognosis: Option<Prognosis>,
    /// Time at which the prognosis was issued.
    pub now: Timestamp,
}

/// The outcome of writing results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Completion {
    /// They were.
    Done,
    /// The lease had expired or another one superseded it: nothing was written.
    Fenced,
}

/// Work that waits, over all operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkFigures {
    /// Uploads that wait to be processed.
    pub pending: u64,
    /// Since when the oldest of them waits: its receipt, or when it was last sent back into the queue.
    pub oldest_pending_since: Option<Timestamp>,
    /// Uploads that are set aside, for whatever reason.
    pub set_aside: u64,
    /// Uploads of a Postgres database that lie in no partition of their month, counted up to 1000: it should
    /// be 0.
    pub without_partition: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leases_double_with_each_attempt_and_end_at_last() {
        let seconds = |first, attempts| Lease::duration(Duration::from_secs(first), attempts).as_secs();
        assert_eq!(
            [0, 1, 2, 3, 4, 5, u32::MAX].map(|attempts| seconds(120, attempts)),
            [120, 240, 480, 960, 960, 960, 960]
        );
        assert_eq!(Lease::duration(Duration::MAX, 1), Duration::MAX);
    }
}
