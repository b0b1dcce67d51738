//! Issued forecasts of finished lives, judged by the metrics of backtests.

use domain::{Prognosis, Scoreboard, rul::HORIZON_FH};
use prognosis::{
    backtest::{JUDGED_RULS_FH, RunScore, score, scoreboard},
    metrics::{self, Prediction},
};
use server::Scorer;
use store::IssuedLife;

/// A forecast counts for the error at a remaining life when it was issued so close to it, flight hours.
const NEAR_FH: f64 = 100.0;

/// Scores what was served at the time; computes no forecast again.
pub struct IssuedScorer;

impl Scorer for IssuedScorer {
    fn score(&self, lives: &[IssuedLife]) -> Scoreboard {
        let scores: Vec<RunScore> = lives.iter().map(score_life).collect();
        scoreboard(&scores.iter().collect::<Vec<_>>())
    }
}

/// Forecasts were not issued at the judged remaining lives, so that the nearest ones speak for them.
fn score_life(life: &IssuedLife) -> RunScore {
    let before: Vec<&Prognosis> = life.prognoses.iter().filter(|p| p.as_of.flight_hours < life.failure_fh).collect();
    let predictions: Vec<Prediction> = before.iter().filter_map(|prognosis| prediction(prognosis)).collect();
    RunScore {
        median_errors: JUDGED_RULS_FH.map(|rul_fh| median_error(&before, life.failure_fh, rul_fh)),
        ..score(&predictions, life.failure_fh, HORIZON_FH)
    }
}

fn prediction(prognosis: &Prognosis) -> Option<Prediction> {
    let rul = &prognosis.forecast.as_ref().ok()?.rul;
    let mut draws: Vec<Option<f64>> = rul.ends_fh().map(Some).collect();
    draws.resize(rul.draws(), None);
    Some(Prediction { t_fh: prognosis.as_of.flight_hours, draws })
}

/// Relative error of the median of the forecast that was issued nearest to a remaining life of `rul_fh`,
/// against the life that remained then; infinite when the median is censored.
fn median_error(before: &[&Prognosis], failure_fh: f64, rul_fh: f64) -> Option<f64> {
    let truth_fh = |prognosis: &Prognosis| failure_fh - prognosis.as_of.flight_hours;
    let distance = |prognosis: &Prognosis| (truth_fh(prognosis) - rul_fh).abs();
    let near = before.iter().filter(|prognosis| distance(prognosis) <= NEAR_FH);
    let nearest = near.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let median = nearest.forecast.as_ref().ok()?.rul.quantile_fh(0.5);
    Some(median.map_or(f64::INFINITY, |median_fh| metrics::relative_error(median_fh, truth_fh(nearest))))
}
