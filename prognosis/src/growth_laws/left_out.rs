//! The laws of a fleet as they would be without some of its lives.
//!
//! - What: what a fleet's laws know, with what some lives taught taken out again.
//! - Update rule: expectations of each life are kept; the sums over the others, and over the lives that a parent counts as, are
//!   maximised once more. The errors of the failure time likewise.
//! - Requirements: offline; which measures there are, and the noise of growth, are those of all lives.

use domain::FaultModel;

use super::{GrowthLaw, GrowthLaws};
use crate::{
    boundary::Boundary,
    ended::EndedLife,
    failure_time::{FinishedLife, Residuals, error_over, late_forecasts},
    fit::{Summary, statistics},
    prior::{FailureTimeError, FleetPrior},
};

/// What every life taught of each law.
pub struct LawsWithout<'a> {
    lives: &'a [EndedLife],
    laws: &'a GrowthLaws,
    model: &'a FaultModel,
    taught: Vec<Vec<Taught>>,
    /// What a parent adds to each law.
    parents: Vec<Parent>,
}

/// What a parent teaches of one law: nothing, unless it counts as some lives.
#[derive(Default)]
struct Parent {
    statistics: Summary,
    error: Option<(FailureTimeError, f64)>,
}

/// What one life taught of one law.
struct Taught {
    statistics: Summary,
    late: Vec<Residuals>,
}

impl<'a> LawsWithout<'a> {
    /// Takes apart what these lives have taught.
    pub fn new(
        lives: &'a [EndedLife],
        laws: &'a GrowthLaws,
        model: &'a FaultModel,
        boundary: &dyn Boundary,
        seed: u64,
    ) -> Self {
        let taught = laws.laws.iter().map(|law| taught(lives, law, model, boundary, seed)).collect();
        let parents = laws.laws.iter().map(|_| Parent::default()).collect();
        Self { lives, laws, model, taught, parents }
    }

    /// The same where the laws were learned from a parent's, which counts as so many lives.
    pub fn under(self, parent: &GrowthLaws, lives: f64) -> Self {
        let of = |law: &GrowthLaw| Parent {
            statistics: Summary::of_parent(&law.prior, lives, self.model),
            error: law.prior.failure_time_error.map(|error| (error, lives)),
        };
        Self { parents: parent.laws.iter().map(of).collect(), ..self }
    }

    /// The laws by some of the lives, each of them one of those that were given.
    pub fn of(&self, kept: &[&EndedLife]) -> GrowthLaws {
        let is_kept: Vec<bool> =
            self.lives.iter().map(|life| kept.iter().any(|other| std::ptr::eq(*other, life))).collect();
        let without = |((law, taught), parent): ((&GrowthLaw, &Vec<Taught>), &Parent)| {
            let others = || taught.iter().zip(&is_kept).filter_map(|(taught, kept)| kept.then_some(taught));
            let prior = Summary::prior(&law.prior, others().map(|taught| &taught.statistics), &parent.statistics);
            let failure_time_error = error_over(others().map(|taught| &taught.late), parent.error);
            GrowthLaw { prior: FleetPrior { failure_time_error, ..prior }, ..law.clone() }
        };
        GrowthLaws { laws: self.laws.laws.iter().zip(&self.taught).zip(&self.parents).map(without).collect() }
    }
}

fn taught(lives: &[EndedLife], law: &GrowthLaw, model: &FaultModel, boundary: &dyn Boundary, seed: u64) -> Vec<Taught> {
    let finished = law.finished(lives);
    let failed: Vec<FinishedLife> = finished.iter().flatten().cloned().collect();
    let mut late = late_forecasts(&failed, model, &law.prior, boundary, seed).into_iter();
    let statistics = statistics(&law.measured(lives), model, &law.prior).into_iter();
    let of_life = |(life, statistics): (&Option<FinishedLife>, Summary)| Taught {
        late: life.as_ref().and_then(|_| late.next()).unwrap_or_default(),
        statistics,
    };
    finished.iter().zip(statistics).map(of_life).collect()
}
