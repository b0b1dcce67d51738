//! Versions that were asked for since the last commit: one process owns the file, so nothing has changed since.

use std::{
    collections::HashMap,
    sync::{Mutex, PoisonError},
};

use domain::{OperatorId, TailNumber};

use crate::{Scope, Version};

/// Most versions in memory; after that they are forgotten and read again.
const MOST: usize = 20_000;

/// Versions as of a number of commits.
#[derive(Default)]
pub(super) struct Versions(Mutex<Known>);

#[derive(Default)]
struct Known {
    commits: u64,
    fleets: HashMap<OperatorId, Version>,
    tails: HashMap<OperatorId, HashMap<TailNumber, Version>>,
}

impl Versions {
    /// The version of a scope, if it is known as of so many commits.
    pub(super) fn get(&self, commits: u64, operator: &OperatorId, scope: Scope<'_>) -> Option<Version> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = match scope {
            Scope::Fleet => known.fleets.get(operator),
            Scope::Tail(tail) => known.tails.get(operator).and_then(|tails| tails.get(tail)),
        };
        found.copied().filter(|_| known.commits == commits)
    }

    /// Keeps a version that was read after so many commits.
    pub(super) fn keep(&self, commits: u64, operator: &OperatorId, scope: Scope<'_>, version: Version) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if known.commits > commits {
            return;
        }
        let held = known.fleets.len() + known.tails.values().map(HashMap::len).sum::<usize>();
        if known.commits < commits || held >= MOST {
            *known = Known { commits, ..Known::default() };
        }
        match scope {
            Scope::Fleet => {
                known.fleets.insert(operator.clone(), version);
            }
            Scope::Tail(tail) => {
                known.tails.entry(operator.clone()).or_default().insert(tail.clone(), version);
            }
        }
    }
}
