//! How long earlier lives went on from the level that this one has reached.
//!
//! - What: each earlier life gives the time from the same level to its end, times (its pace / the pace of this life) to a
//!   learned power: how long it took to the level, over how long this life took. Lives whose pace is like this one's may
//!   count more. The times are smoothed by a kernel in their logarithm, whose width is Silverman's; their spread is kept and
//!   drawn towards a tenth or so, as if one more life had it, so that a few lives are not taken for all that can be.
//! - Update rule: none but that of the level, [`level`](crate::level).
//! - Requirements: at least one life that ended in failure. A life that failed below the level counts from where it failed;
//!   one that was removed counts as far as it went, by Kaplan and Meier among the others, and not at levels that it never
//!   reached. What outlasts all failures is exponential.
//! - Source: Wang, Yu, Siegel and Lee 2008 for similarity of trajectories; Silverman 1986 for the width.

mod learn;

use std::{borrow::Cow, cmp::Ordering};

use domain::FaultModel;
use numerics::Stream;
use serde::{Deserialize, Serialize};

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::{
    block::Observation,
    boundary::Boundary,
    ended::Ending,
    level::{Ascent, Gauge},
    scale::REFERENCE_LIFE_FH,
    survival::kaplan_meier,
};

/// Added to the times that are compared as paces: what half a characteristic life tells is half believed.
const PACE_FH: f64 = 0.5 * REFERENCE_LIFE_FH;
/// Least remaining time of an earlier life, reference hours: below, its logarithm says nothing.
const LEAST_FH: f64 = 1.0;
/// Spread of the logarithm that counts as one more life's.
const USUAL_SPREAD: f64 = 0.25;
/// Parts of what outlasts all failures.
const BEYOND_PARTS: usize = 8;

/// What earlier lives tell of how long one goes on from a level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LevelLives {
    /// In an order that does not depend on that in which they were given.
    lives: Vec<LevelLife>,
    /// Distance of the levels.
    step: f64,
    /// The power of the ratio of paces.
    pub power: f64,
    /// Weight of the squared log of that ratio: how much less a life counts the less its pace is like this one's.
    pub pace_precision: f64,
}

/// One earlier life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LevelLife {
    /// When it was at each level, from zero on.
    reached_fh: Vec<f64>,
    /// The greatest level that it reached.
    greatest: f64,
    end_fh: f64,
    ending: Ending,
}

impl LevelLife {
    /// When it was at the level, or where it failed if that was below; `None` of one removed below.
    fn at_fh(&self, level: f64, step: f64) -> Option<f64> {
        if level > self.greatest && self.ending == Ending::Removed {
            return None;
        }
        let place = level.min(self.greatest) / step;
        let below = (place as usize).min(self.reached_fh.len() - 1);
        let above = (below + 1).min(self.reached_fh.len() - 1);
        let [from_fh, to_fh] = [below, above].map(|place| self.reached_fh[place]);
        Some((from_fh + (to_fh - from_fh) * (place - below as f64).min(1.0)).min(self.end_fh))
    }
}

/// A possible log of the remaining life.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Atom {
    log_fh: f64,
    weight: f64,
    ending: Ending,
}

/// The remaining life of one that is at a level.
#[derive(Debug, Clone, PartialEq)]
struct Remaining {
    /// Ascending.
    atoms: Vec<Atom>,
    mean: f64,
    /// By which the distances of the atoms from their mean are stretched.
    stretch: f64,
    /// Width of the kernel.
    width: f64,
}

impl LevelLives {
    /// Whether it can have been learned.
    pub(crate) fn is_sound(&self) -> bool {
        let ascending = |times: &[f64]| times.iter().all(|t_fh| t_fh.is_finite()) && times.is_sorted();
        let is_life = |life: &LevelLife| {
            !life.reached_fh.is_empty()
                && ascending(&life.reached_fh)
                && life.greatest.is_finite()
                && life.end_fh.is_finite()
        };
        let is_positive = |value: f64| value.is_finite() && value >= 0.0;
        self.lives.iter().all(is_life)
            && self.lives.iter().any(|life| life.ending == Ending::Failed)
            && [self.step, self.power, self.pace_precision].into_iter().all(is_positive)
            && self.step > 0.0
    }

    /// Lives that tell something here.
    fn atoms(&self, level: f64, now_fh: f64, but: Option<usize>) -> Vec<Atom> {
        let atom = |(_, life): (usize, &LevelLife)| {
            let at_fh = life.at_fh(level, self.step)?;
            let log_pace = libm::log((now_fh.max(0.0) + PACE_FH) / (at_fh.max(0.0) + PACE_FH));
            let log_fh = libm::log((life.end_fh - at_fh).max(LEAST_FH)) + self.power * log_pace;
            let weight = libm::exp(-0.5 * self.pace_precision * log_pace * log_pace) + 1e-3;
            Some(Atom { log_fh, weight, ending: life.ending })
        };
        let lives = self.lives.iter().enumerate().filter(|(index, _)| Some(*index) != but);
        let mut atoms: Vec<Atom> = lives.filter_map(atom).collect();
        let removed = |atom: &Atom| atom.ending == Ending::Removed;
        let order = |a: &Atom, b: &Atom| a.log_fh.total_cmp(&b.log_fh).then(removed(a).cmp(&removed(b)));
        atoms.sort_by(|a, b| order(a, b).then(a.weight.total_cmp(&b.weight)));
        atoms
    }

    /// Draws of the remaining life at a level and age, at even steps of the lives' probability; `None` beyond the horizon.
    pub fn ends_fh(
        &self,
        level: f64,
        now_fh: f64,
        settings: &PredictionSettings,
        stream: &mut Stream,
    ) -> Vec<Option<f64>> {
        let draws_fh = match self.remaining(level, now_fh, None) {
            Some(remaining) => remaining.draws_fh(settings.draws, stream),
            None => vec![f64::INFINITY; settings.draws],
        };
        draws_fh.into_iter().map(|end_fh| Some(end_fh).filter(|end_fh| *end_fh < settings.horizon_fh)).collect()
    }

    /// The remaining life at a level and age, but for what one of the lives says; `None` where no failed life is left.
    fn remaining(&self, level: f64, now_fh: f64, but: Option<usize>) -> Option<Remaining> {
        let atoms = self.atoms(level, now_fh, but);
        let failed = |atom: &&Atom| atom.ending == Ending::Failed;
        atoms.iter().find(failed)?;
        let (shares, left) = kaplan_meier(&atoms.iter().map(|atom| (atom.weight, atom.ending)).collect::<Vec<_>>());
        let mut sure: Vec<Atom> = atoms.iter().zip(&shares).map(|(atom, &weight)| Atom { weight, ..*atom }).collect();
        sure.retain(|atom| atom.weight > 0.0);
        if left > 0.0 {
            sure.extend(beyond(&atoms, left));
        }
        Some(Remaining::smooth(sure))
    }
}

/// What outlasts the last failure: exponential from the longest life on, at the hazard that all have shown.
fn beyond(atoms: &[Atom], left: f64) -> impl Iterator<Item = Atom> {
    let longest_fh = libm::exp(atoms[atoms.len() - 1].log_fh);
    let lived_fh: f64 = atoms.iter().map(|atom| atom.weight * libm::exp(atom.log_fh)).sum();
    let failures: f64 = atoms.iter().filter(|atom| atom.ending == Ending::Failed).map(|atom| atom.weight).sum();
    (0..BEYOND_PARTS).map(move |part| {
        let level = (part as f64 + 0.5) / BEYOND_PARTS as f64;
        let log_fh = libm::log(longest_fh - libm::log1p(-level) * lived_fh / failures);
        Atom { log_fh, weight: left / BEYOND_PARTS as f64, ending: Ending::Removed }
    })
}

impl Remaining {
    /// Atoms in ascending order whose weights sum to one, as a density.
    fn smooth(atoms: Vec<Atom>) -> Self {
        let mean: f64 = atoms.iter().map(|atom| atom.weight * atom.log_fh).sum();
        let square = |atom: &Atom| atom.weight * (atom.log_fh - mean) * (atom.log_fh - mean);
        let variance: f64 = atoms.iter().map(square).sum();
        let count = 1.0 / atoms.iter().map(|atom| atom.weight * atom.weight).sum::<f64>();
        let supposed = (count * variance + USUAL_SPREAD * USUAL_SPREAD) / (count + 1.0) * (1.0 + 1.0 / count);
        let silverman = libm::pow(count, -0.4);
        let share = silverman / (1.0 + silverman);
        let stretch = if variance > 0.0 { libm::sqrt((1.0 - share) * supposed / variance) } else { 0.0 };
        Self { atoms, mean, stretch, width: libm::sqrt(share * supposed) }
    }

    /// Draws, at even steps of the atoms' probability, hours.
    fn draws_fh(&self, count: usize, stream: &mut Stream) -> Vec<f64> {
        let (mut index, mut before) = (0, 0.0);
        let draw = |draw: usize| {
            let level = (draw as f64 + 0.5) / count as f64;
            while index + 1 < self.atoms.len() && before + self.atoms[index].weight < level {
                before += self.atoms[index].weight;
                index += 1;
            }
            let kernel = self.width * stream.normal();
            libm::exp(self.mean + self.stretch * (self.atoms[index].log_fh - self.mean) + kernel)
        };
        (0..count).map(draw).collect()
    }
}

/// Similarity of levels as an [`Estimator`].
pub struct Similarity<'a> {
    /// What earlier lives told.
    pub lives: Cow<'a, LevelLives>,
    /// Nominal values of the faults.
    pub model: &'a FaultModel,
    /// The boundary at which life ends; the one that levels of earlier lives were measured by.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Similarity<'_> {
    fn name(&self) -> &'static str {
        "similarity"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let ascent = Ascent::new(Gauge::new(self.boundary, &self.model.nominal));
        Box::new(Life { lives: &self.lives, ascent })
    }
}

struct Life<'a> {
    lives: &'a LevelLives,
    ascent: Ascent<'a>,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        self.ascent.observe(observation);
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let ends_fh = self.lives.ends_fh(self.ascent.level(), now_fh, settings, &mut stream.substream(0));
        RulEstimate { ends_fh, propagation: None, doubted: false }
    }
}

/// An order of lives that does not depend on how they were given.
fn by_content(a: &LevelLife, b: &LevelLife) -> Ordering {
    let removed = |life: &LevelLife| life.ending == Ending::Removed;
    let times = || a.reached_fh.iter().zip(&b.reached_fh).map(|(a, b)| a.total_cmp(b));
    a.end_fh
        .total_cmp(&b.end_fh)
        .then(removed(a).cmp(&removed(b)))
        .then_with(|| times().find(|order| order.is_ne()).unwrap_or(Ordering::Equal))
}
