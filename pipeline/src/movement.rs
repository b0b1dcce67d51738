//! How one more block moved a forecast, and what was surprising in it.
//!
//! What: the change of the median failure time from one closed block to the next.
//! Update rule: both posteriors are drawn with the same random numbers, so that most of the Monte-Carlo
//! error cancels; the rest is told by the scatter over batches of draws.
//! Requirements: two posteriors of one life.

use domain::explanation::Movement;
use prognosis::{block::Block, posterior::Posterior};

use crate::{
    Course, LifeContext, Model,
    outlook::{HORIZON_FH, as_of},
};

/// Draws of each of the two forecasts, in batches of equal size.
const DRAWS: usize = 200;
const BATCHES: usize = 8;

/// From the block before to this one: each with the posterior at its end.
pub fn movement(
    model: &Model,
    context: &LifeContext,
    course: &Course,
    [before, now]: [(&Posterior, &Block); 2],
) -> Movement {
    let last_of = |block: &Block| course.inside(block).last().expect("a closed block has observations");
    let (earlier, latest) = (last_of(before.1), last_of(now.1));
    let before_fh = model.draw(context, before.0, earlier, latest, DRAWS).ends_fh;
    let now_fh = model.draw(context, now.0, latest, latest, DRAWS).ends_fh;
    let passed_fh = latest.flight_hours - earlier.flight_hours;
    let moved_fh = moved(&before_fh, &now_fh, passed_fh);
    Movement {
        since: as_of(earlier),
        passed_fh,
        median_before_fh: median(&before_fh),
        moved_fh,
        standard_error_fh: moved_fh.and_then(|_| standard_error(&before_fh, &now_fh)),
        surprises: Vec::new(),
    }
}

/// Change of the median failure time, flight hours; `None` where one is beyond the horizon.
fn moved(before_fh: &[Option<f64>], now_fh: &[Option<f64>], passed_fh: f64) -> Option<f64> {
    Some(median(now_fh)? + passed_fh - median(before_fh)?)
}

/// Of the change, from that within each batch; `None` where a batch has none.
fn standard_error(before_fh: &[Option<f64>], now_fh: &[Option<f64>]) -> Option<f64> {
    let size = DRAWS / BATCHES;
    let batches = before_fh.chunks_exact(size).zip(now_fh.chunks_exact(size));
    let moves: Vec<f64> = batches.map(|(before, now)| moved(before, now, 0.0)).collect::<Option<_>>()?;
    let n = moves.len() as f64;
    let mean = moves.iter().sum::<f64>() / n;
    let variance = moves.iter().map(|moved| (moved - mean) * (moved - mean)).sum::<f64>() / (n - 1.0);
    Some((variance / n).sqrt())
}

/// The median, censored draws beyond all others; `None` when it is one.
fn median(ends_fh: &[Option<f64>]) -> Option<f64> {
    domain::RulDistribution::from_draws(ends_fh, HORIZON_FH).quantile_fh(0.5)
}
