//! A contest of estimators over recorded lives.

use std::collections::BTreeMap;

use domain::FaultModel;
use prognosis::{Estimator, FailureTimeError, Paced};
use rayon::prelude::*;

use crate::{
    Knowledge, Oracle, Recorded, Terms,
    backtest::{Replay, ReplaySettings, RunScore, replay, replay_until},
};

/// An estimator that is judged. Only the oracle is told the law of a run.
pub enum Contestant<'a> {
    /// An estimator that knows what earlier lives have taught.
    Estimator(Box<dyn Estimator + 'a>),
    /// The same by the pace of each life, and the plan of what it will fly.
    Paced(Paced<'a>),
    /// An estimator that is told the law of each life as well.
    Oracle(&'a Knowledge),
}

impl Contestant<'_> {
    /// Its name in files and reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Estimator(estimator) => estimator.name(),
            Self::Paced(paced) => paced.inner.name(),
            Self::Oracle(_) => Oracle::NAME,
        }
    }

    /// Nothing where the oracle is not told the law.
    fn replay(&self, recorded: &Recorded, settings: &ReplaySettings) -> Replay {
        match self {
            Self::Estimator(estimator) => replay_until(&recorded.run, estimator.as_ref(), settings, recorded.goes_on),
            Self::Paced(paced) => replay_until(&recorded.run, &paced.told(&recorded.plan), settings, recorded.goes_on),
            Self::Oracle(Knowledge { faults: model, surrogate: boundary, prior, .. }) => {
                let of_law = |law| replay(&recorded.run, &Oracle { model, prior, boundary, law }, settings);
                recorded.law.as_ref().map_or_else(Replay::default, of_law)
            }
        }
    }
}

/// What one estimator made of all runs.
#[derive(Debug)]
pub struct Replays {
    /// Its name.
    pub estimator: &'static str,
    /// One per run, in their order.
    pub runs: Vec<Replay>,
}

impl Replays {
    /// Scores by run, of those of `runs` that have one.
    pub fn scores(&self, runs: &[usize]) -> BTreeMap<usize, &RunScore> {
        runs.iter().filter_map(|&run| Some((run, self.runs[run].score.as_ref()?))).collect()
    }
}

/// Feeds all runs to all contestants; `done` is told of each run of each.
pub fn replay_all(
    recorded: &[Recorded],
    contestants: &[Contestant],
    settings: &ReplaySettings,
    done: &(dyn Fn() + Sync),
) -> Vec<Replays> {
    let of_contestant = |contestant: &Contestant| {
        let of_run = |recorded: &Recorded| {
            let replayed = contestant.replay(recorded, settings);
            done();
            replayed
        };
        Replays { estimator: contestant.name(), runs: recorded.par_iter().map(of_run).collect() }
    };
    contestants.par_iter().map(of_contestant).collect()
}

/// All there is to write about.
#[derive(Debug, Clone, Copy)]
pub struct Judged<'a> {
    /// The runs.
    pub recorded: &'a [Recorded],
    /// What each estimator made of them.
    pub replays: &'a [Replays],
    /// What the faults are.
    pub faults: &'a FaultModel,
    /// Standard deviation of one observation of each, as the estimators know it.
    pub sigma: &'a [f64],
    /// Error of the boundary that was carried into the predictions.
    pub failure_time_error: Option<FailureTimeError>,
    /// How results are told.
    pub terms: &'a Terms,
}

impl<'a> Judged<'a> {
    /// What an estimator made of the runs, if it is judged.
    pub fn of(&self, estimator: &str) -> Option<&'a Replays> {
        self.replays.iter().find(|replays| replays.estimator == estimator)
    }
}
