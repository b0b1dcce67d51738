//! The laws of a fleet as they would be without some of its lives.
//!
//! - What: what a fleet's laws know, with what some lives taught taken out again.
//! - Update rule: expectations of each life are kept; the sums over the others are maximised once more. The errors of the
//!   failure time likewise.
//! - Requirements: offline; which measures there are, and the noise of growth, are those of all lives.

use domain::FaultModel;

use super::{GrowthLaw, GrowthLaws};
use crate::{
    boundary::Limits,
    ended::EndedLife,
    failure_time::{FinishedLife, Residuals, error_over, late_forecasts},
    fit::{Summary, statistics},
    prior::FleetPrior,
};

/// What every life taught of each law.
pub struct LawsWithout<'a> {
    lives: &'a [EndedLife],
    laws: &'a GrowthLaws,
    taught: Vec<Vec<Taught>>,
}

/// What one life taught of one law.
struct Taught {
    statistics: Summary,
    late: Vec<Residuals>,
}

impl<'a> LawsWithout<'a> {
    /// Takes apart what these lives have taught.
    pub fn new(lives: &'a [EndedLife], laws: &'a GrowthLaws, model: &FaultModel, seed: u64) -> Self {
        let taught = laws.laws.iter().map(|law| taught(lives, law, model, seed)).collect();
        Self { lives, laws, taught }
    }

    /// The laws by some of the lives, each of them one of those that were given.
    pub fn of(&self, kept: &[&EndedLife]) -> GrowthLaws {
        let is_kept: Vec<bool> =
            self.lives.iter().map(|life| kept.iter().any(|other| std::ptr::eq(*other, life))).collect();
        let without = |(law, taught): (&GrowthLaw, &Vec<Taught>)| {
            let others = || taught.iter().zip(&is_kept).filter_map(|(taught, kept)| kept.then_some(taught));
            let prior = Summary::prior(&law.prior, others().map(|taught| &taught.statistics));
            let failure_time_error = error_over(others().map(|taught| &taught.late));
            GrowthLaw { prior: FleetPrior { failure_time_error, ..prior }, ..law.clone() }
        };
        GrowthLaws { laws: self.laws.laws.iter().zip(&self.taught).map(without).collect() }
    }
}

fn taught(lives: &[EndedLife], law: &GrowthLaw, model: &FaultModel, seed: u64) -> Vec<Taught> {
    let finished = law.finished(lives);
    let failed: Vec<FinishedLife> = finished.iter().flatten().cloned().collect();
    let mut late = late_forecasts(&failed, model, &law.prior, &Limits::reference(model.len()), seed).into_iter();
    let statistics = statistics(&law.measured(lives), model, &law.prior).into_iter();
    let of_life = |(life, statistics): (&Option<FinishedLife>, Summary)| Taught {
        late: life.as_ref().and_then(|_| late.next()).unwrap_or_default(),
        statistics,
    };
    finished.iter().zip(statistics).map(of_life).collect()
}
