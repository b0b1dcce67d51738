//! How one more block moved a forecast, and what was surprising in it.
//!
//! What: the change of the median failure time from one closed block to the next.
//! Update rule: both posteriors are drawn with the same random numbers, so that most of the Monte-Carlo
//! error cancels; the rest is told by the scatter over batches of draws.
//! Requirements: two posteriors of one life.

use domain::{
    Ahead, RulDistribution,
    explanation::{Shift, Surprise},
};
use prognosis::{Expectation, Known};

use crate::{
    Course, LifeContext, Model,
    draws::{self, FEW},
};

/// Batches of equal size that the draws of each of the two forecasts are told apart in.
const BATCHES: usize = 8;

/// The step from one closed block to the next.
pub(crate) struct Step<'a> {
    /// The course of the life.
    pub course: &'a Course,
    /// The index of the next block.
    pub index: usize,
    /// What was known before it.
    pub before: &'a Known,
    /// What that led one to expect of its entries.
    pub expected: &'a [Expectation],
    /// Draws of the end of life from what is known after it, counted from its last upload.
    pub after_fh: &'a [Option<f64>],
}

impl Step<'_> {
    /// What it did to the forecast.
    pub fn shift(&self, model: &Model, context: &LifeContext) -> Shift {
        let last_of =
            |index: usize| self.course.inside(&self.course.blocks[index]).last().expect("blocks are not empty");
        let (earlier, latest) = (last_of(self.index - 1), last_of(self.index));
        let life = draws::Life { context, course: self.course, ahead: &Ahead::default() };
        let before_fh = model.draw(&life, self.before, earlier, latest, FEW).ends_fh;
        let passed_fh = latest.flight_hours - earlier.flight_hours;
        let moved_fh = moved(&before_fh, self.after_fh, passed_fh);
        Shift {
            since: earlier.as_of(),
            passed_fh,
            median_before_fh: median(&before_fh),
            moved_fh,
            standard_error_fh: moved_fh.and_then(|_| standard_error(&before_fh, self.after_fh)),
            surprises: self.surprises(model),
        }
    }

    /// What the block showed against what was expected of it, the most surprising fault first.
    fn surprises(&self, model: &Model) -> Vec<Surprise> {
        let surprise = |(index, expected): (usize, &Expectation)| {
            let fault = model.bundle.faults.names[index].clone();
            let (mean, seen, z) = (expected.expected(), expected.seen(), expected.z());
            model.units.surprise(index, Surprise { fault, expected: mean, seen, z })
        };
        let mut surprises: Vec<Surprise> = self.expected.iter().enumerate().map(surprise).collect();
        surprises.sort_by(|a, b| b.z.abs().total_cmp(&a.z.abs()));
        surprises
    }
}

/// Change of the median failure time, flight hours; `None` where one is beyond the horizon.
fn moved(before_fh: &[Option<f64>], after_fh: &[Option<f64>], passed_fh: f64) -> Option<f64> {
    Some(median(after_fh)? + passed_fh - median(before_fh)?)
}

/// Standard error of the change, from that within each batch; `None` where a batch has none.
fn standard_error(before_fh: &[Option<f64>], after_fh: &[Option<f64>]) -> Option<f64> {
    let size = before_fh.len() / BATCHES;
    let batches = before_fh.chunks_exact(size).zip(after_fh.chunks_exact(size));
    let moves: Vec<f64> = batches.map(|(before, after)| moved(before, after, 0.0)).collect::<Option<_>>()?;
    let n = moves.len() as f64;
    let mean = moves.iter().sum::<f64>() / n;
    let variance = moves.iter().map(|moved| (moved - mean) * (moved - mean)).sum::<f64>() / (n - 1.0);
    Some((variance / n).sqrt())
}

/// The median, censored draws beyond all others; `None` when it is one.
fn median(ends_fh: &[Option<f64>]) -> Option<f64> {
    RulDistribution::from_draws(ends_fh, f64::INFINITY).quantile_fh(0.5)
}
