//! The walk of a filter along a life, block by block, and the states on its way.
//!
//! What: the states of the blocks that do not stand, and the filters worth keeping.
//! Update rule: the filter goes on alone; what it knew before and after a block is all that a state rests on, so states
//! are drawn side by side on all cores, with the bits that they have one by one.
//! Requirements: a course, and how many of its states stand.

use std::sync::Arc;

use domain::{Ahead, Doubt, FaultTrend, RulDistribution, State};
use prognosis::{Expectation, Known, LifeFilter};
use rayon::prelude::*;

use crate::{
    Course, LifeContext, Model,
    checkpoint::Checkpoint,
    draws::{self, FEW},
    paced::Paced,
    shift::Step,
};

/// Every so many blocks of a life its filter is worth keeping for good; so many blocks are drawn side by side.
const CHECKPOINT_BLOCKS: usize = 25;

/// Why a life has no outlook.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OutlookError {
    /// An intermediate was not finite.
    #[error("the {what} of block {block} is {value}")]
    NotFinite {
        /// The figure.
        what: &'static str,
        /// The block.
        block: u64,
        /// Its value.
        value: f64,
    },
}

/// Walks along a life, block by block.
pub(crate) struct Walk<'a> {
    /// The bundle.
    pub model: &'a Model,
    /// Whose life, and its prior.
    pub context: &'a LifeContext<'a>,
    /// The life's blocks.
    pub course: &'a Course,
    /// A filter that was kept after one of them.
    pub recalled: Option<Checkpoint>,
}

/// What the filter knew around a block.
struct Passage {
    index: usize,
    /// Before it, with what that led one to expect of its entries.
    before: Option<(Arc<Known>, Vec<Expectation>)>,
    after: Arc<Known>,
    doubts: Vec<Doubt>,
}

impl Walk<'_> {
    /// Follows the life to its last closed block; writes states of all blocks but the first `standing`.
    pub fn follow(
        &mut self,
        standing: usize,
        states: &mut Vec<State>,
        checkpoints: &mut Vec<Checkpoint>,
    ) -> Result<Option<Checkpoint>, OutlookError> {
        let (mut filter, begun) = self.begin(standing);
        let life = &self.course.measured;
        let mut known = (begun > 0 && begun == standing).then(|| Arc::new(filter.known(life, begun - 1)));
        let mut passages = Vec::new();
        let clock = self.course.wear_clock.as_ref();
        let flight_hours = |worn_h: f64| clock.map_or(worn_h, |clock| clock.flight_hours(worn_h));
        for index in begun..self.course.blocks.len() {
            let before = known.take().map(|known| (known, filter.expect(life, index)));
            filter.update(life, index);
            if index + 1 < standing {
                continue;
            }
            let after = Arc::new(filter.known(life, index));
            known = Some(after.clone());
            if index >= standing {
                passages.push(Passage {
                    index,
                    before,
                    after,
                    doubts: filter.doubt(&flight_hours).into_iter().collect(),
                });
                if (index + 1).is_multiple_of(CHECKPOINT_BLOCKS) {
                    checkpoints.push(self.checkpoint(index, &filter));
                    states.append(&mut self.states(&passages)?);
                    passages.clear();
                }
            }
        }
        states.append(&mut self.states(&passages)?);
        let last = self.course.blocks.len().checked_sub(1);
        Ok(last.map(|index| self.checkpoint(index, &filter)))
    }

    /// The filter from which to follow, and how many blocks it has seen: at most as many as stand.
    fn begin(&mut self, standing: usize) -> (LifeFilter, usize) {
        let seen = |checkpoint: &Checkpoint| {
            let place = self.course.digests[..standing].iter().position(|digest| *digest == checkpoint.digest);
            place.map(|index| index + 1)
        };
        match self.recalled.take().and_then(|checkpoint| seen(&checkpoint).map(|seen| (checkpoint.filter, seen))) {
            Some(recalled) => recalled,
            None => {
                let Self { model, context, .. } = self;
                let began_fh = model.units.reference_fh(context.began_fh);
                (LifeFilter::new(&model.followed, &context.prior.body, began_fh), 0)
            }
        }
    }

    fn checkpoint(&self, index: usize, filter: &LifeFilter) -> Checkpoint {
        let (block, digest) = (self.course.blocks[index].index, self.course.digests[index]);
        Checkpoint { block, digest, filter: filter.clone() }
    }

    /// The states behind some blocks; of several errors, that of the first.
    fn states(&self, passages: &[Passage]) -> Result<Vec<State>, OutlookError> {
        let states: Vec<_> = passages.par_iter().map(|passage| self.state(passage)).collect();
        states.into_iter().collect()
    }

    fn state(&self, passage: &Passage) -> Result<State, OutlookError> {
        let Passage { index, before, after, doubts } = passage;
        let (block, digest) = (&self.course.blocks[*index], self.course.digests[*index]);
        let inside = self.course.inside(block);
        let last = &inside[inside.len() - 1];
        let units = &self.model.units;
        let life = draws::Life { context: self.context, course: self.course, ahead: &Ahead::default() };
        let paced = Paced::new(self.model, &life, last);
        let faults = units.trends(paced.trends(after));
        check_finite(&faults, block.index)?;
        let ends_fh = self.model.draw(&life, after, last, last, FEW).ends_fh;
        let shift = before.as_ref().map(|(before, expected)| {
            Step { course: self.course, index: *index, before, expected, after_fh: &ends_fh }
                .shift(self.model, self.context)
        });
        let rul = RulDistribution::from_draws(&ends_fh, self.model.horizon_fh(self.context));
        Ok(State {
            block: block.index,
            from_fh: inside[0].flight_hours,
            as_of: last.as_of(),
            observations: inside.len(),
            faults,
            propagation: units.propagation(paced.propagation(after)),
            rul_quantiles_fh: rul.quantiles_fh(),
            rul_mean_fh: rul.mean_fh(),
            censored_fraction: rul.censored_fraction(),
            horizon_fh: rul.horizon_fh(),
            growth: units.growth(paced.growth(after)),
            shift,
            doubts: doubts.clone(),
            digest,
        })
    }
}

/// Refuses trends that are no numbers.
pub(crate) fn check_finite(faults: &[FaultTrend], block: u64) -> Result<(), OutlookError> {
    for fault in faults {
        for (what, value) in [("value", fault.value), ("sigma", fault.sigma), ("trend", fault.trend_per_1000_fh)] {
            if !value.is_finite() {
                return Err(OutlookError::NotFinite { what, block, value });
            }
        }
    }
    Ok(())
}
