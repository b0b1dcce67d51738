//! What a fleet alone tells: how long earlier lives went on from here.
//!
//! - What: the remaining lives of the earlier lives that were at least as old as this one is now, removed ones as far
//!   as they went. No observation is looked at.
//! - Update rule: none. The older lives count one each, by Kaplan and Meier; a Weibull distribution that all lives taught
//!   counts as one life more, so that a few are not taken for all that can be, and alone tells of ages beyond the oldest.
//! - Requirements: at least one life that ended in failure.
//! - Source: Kaplan and Meier 1958, with one life of a parametric guess as in Susarla and Van Ryzin 1976; the rival
//!   that a forecast has to beat (Murphy 1992 on climatology as the reference of a skill score).

use numerics::Stream;
use serde::{Deserialize, Serialize};

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::{
    block::Observation,
    ended::Ending,
    survival::{NoFailure, Weibull, kaplan_meier},
};

/// Lives that the Weibull distribution counts as.
const GUESSED_LIVES: f64 = 1.0;

/// The remaining lives of a fleet as an [`Estimator`]. Its draws are at even steps of probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Climatology {
    /// Length and ending of earlier lives, ascending; of the same length failures first.
    lives: Vec<(f64, Ending)>,
    tail: Weibull,
}

impl Climatology {
    /// Whether it can have been learned.
    pub(crate) fn is_sound(&self) -> bool {
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        self.lives.iter().all(|life| is_positive(life.0))
            && self.lives.is_sorted_by(|a, b| a.0 <= b.0)
            && self.lives.iter().any(|life| life.1 == Ending::Failed)
            && is_positive(self.tail.scale_fh)
            && is_positive(self.tail.shape)
    }

    /// What earlier lives, given by their lengths in hours and endings, teach; lives without length do not count.
    pub fn learn(lives: impl IntoIterator<Item = (f64, Ending)>) -> Result<Self, NoFailure> {
        let mut lives: Vec<(f64, Ending)> = lives.into_iter().filter(|life| life.0 > 0.0).collect();
        lives.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1 == Ending::Removed).cmp(&(b.1 == Ending::Removed))));
        let tail = Weibull::fit(&lives)?;
        Ok(Self { lives, tail })
    }

    /// What earlier lives teach that all ended in failure.
    pub fn of_failures(lives_fh: &[f64]) -> Result<Self, NoFailure> {
        Self::learn(lives_fh.iter().map(|life_fh| (*life_fh, Ending::Failed)))
    }

    /// Draws of the remaining life at an age, at even steps of probability; `None` beyond the horizon.
    pub fn ends_fh(&self, now_fh: f64, settings: &PredictionSettings) -> Vec<Option<f64>> {
        let ends_fh = self.remaining_fh(now_fh, settings.draws).into_iter();
        ends_fh.map(|end_fh| Some(end_fh).filter(|end_fh| *end_fh < settings.horizon_fh)).collect()
    }

    /// Remaining lives at the age `now_fh`, at even steps of probability.
    fn remaining_fh(&self, now_fh: f64, draws: usize) -> Vec<f64> {
        let older = &self.lives[self.lives.partition_point(|life| life.0 <= now_fh)..];
        let guessed = draws as f64 * GUESSED_LIVES / (GUESSED_LIVES + older.len() as f64);
        let guessed = libm::round(guessed) as usize;
        let mut ends_fh: Vec<f64> = levels(guessed).map(|level| self.tail.remaining_fh(now_fh, level)).collect();
        let ordered: Vec<(f64, Ending)> = older.iter().map(|life| (1.0, life.1)).collect();
        let (shares, left) = kaplan_meier(&ordered);
        let (mut index, mut before) = (0, 0.0);
        for level in levels(draws - guessed) {
            while index < older.len() && before + shares[index] < level {
                before += shares[index];
                index += 1;
            }
            ends_fh.push(match older.get(index) {
                Some(life) => life.0 - now_fh,
                None => self.beyond_fh(now_fh, (level - (1.0 - left)) / left),
            });
        }
        ends_fh
    }

    /// What is left at `now_fh` of a life that outlasts all earlier ones.
    fn beyond_fh(&self, now_fh: f64, level: f64) -> f64 {
        let oldest_fh = self.lives[self.lives.len() - 1].0;
        oldest_fh - now_fh + self.tail.remaining_fh(oldest_fh, level.clamp(0.0, 1.0 - f64::EPSILON))
    }
}

/// The middles of `count` steps of probability.
fn levels(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |index| (index as f64 + 0.5) / count as f64)
}

impl Estimator for Climatology {
    fn name(&self) -> &'static str {
        "climatology"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { climatology: self })
    }
}

struct Life<'a> {
    climatology: &'a Climatology,
}

impl Follower for Life<'_> {
    fn observe(&mut self, _: &Observation) {}

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, _: &Stream) -> RulEstimate {
        RulEstimate { ends_fh: self.climatology.ends_fh(now_fh, settings), propagation: None, doubted: false }
    }
}
