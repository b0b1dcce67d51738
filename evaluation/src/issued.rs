//! Issued forecasts of finished lives, judged by the metrics of backtests.

use domain::{Prognosis, Scoreboard, rul::HORIZON_FH};

use crate::{
    backtest::{self, JUDGED_RULS_FH, RunScore, scoreboard},
    metrics::{self, Prediction},
};

/// A forecast counts for the error at a remaining life when it was issued so close to it, flight hours.
const NEAR_FH: f64 = 100.0;

/// What was issued in one finished life.
#[derive(Debug, Clone, Copy)]
pub struct IssuedForecasts<'a> {
    /// The time of its failure, hours since new.
    pub failure_fh: f64,
    /// The forecasts, in the order of the life.
    pub prognoses: &'a [Prognosis],
}

/// Scores what was served at the time; computes no forecast again.
pub fn score<'a>(lives: impl Iterator<Item = IssuedForecasts<'a>>) -> Scoreboard {
    let scores: Vec<RunScore> = lives.map(score_life).collect();
    scoreboard(&scores.iter().collect::<Vec<_>>())
}

/// Forecasts were not issued at the judged remaining lives, so that the nearest ones speak for them.
fn score_life(life: IssuedForecasts) -> RunScore {
    let before: Vec<&Prognosis> = life.prognoses.iter().filter(|p| p.as_of.flight_hours < life.failure_fh).collect();
    let predictions: Vec<Prediction> = before.iter().filter_map(|prognosis| prediction(prognosis)).collect();
    RunScore {
        median_errors: JUDGED_RULS_FH.map(|rul_fh| median_error(&before, life.failure_fh, rul_fh)),
        ..backtest::score(&predictions, life.failure_fh, HORIZON_FH)
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

#[cfg(test)]
mod tests {
    use domain::{
        AsOf, ContentHash, Explanation, NUMERICS_VERSION, Propagation, RulDistribution, Timestamp, prognosis::Forecast,
    };

    use super::*;

    const FAILURE_FH: f64 = 3000.0;

    /// Issued at `t_fh`, with as many draws before the truth as behind it, from `low` to `high` times the
    /// truth; a tenth of them beyond the horizon.
    fn issued(t_fh: f64, low: f64, high: f64) -> Prognosis {
        let truth_fh = FAILURE_FH - t_fh;
        let share = |i: usize| low + (high - low) * i as f64 / 899.0;
        let ends: Vec<Option<f64>> = (0..1000).map(|i| (i < 900).then(|| truth_fh * share(i))).collect();
        let propagation = Propagation {
            state_matrix: Vec::new(),
            state_matrix_sigma: Vec::new(),
            control_matrix: Vec::new(),
            control_matrix_sigma: Vec::new(),
            estimator: "rbg".to_owned(),
            observations: 1,
        };
        let forecast = Forecast {
            faults: Vec::new(),
            dominant_fault: "k1".to_owned(),
            propagation,
            rul: RulDistribution::from_draws(&ends, HORIZON_FH),
            p10_error_fh: None,
            median_error_fh: None,
            probability_failed: 0.0,
            seed: 1,
            pace: None,
            ensemble: None,
            explanation: Explanation::default(),
            doubts: Vec::new(),
            gap: None,
        };
        Prognosis {
            as_of: AsOf {
                flight_hours: t_fh,
                recorded_at: Timestamp::from_micros(0),
                upload_id: "u".parse().expect("a name"),
            },
            forecast: Ok(forecast),
            load: None,
            load_agreement: None,
            mask_id: Some(ContentHash::of(b"mask")),
            model: ContentHash::of(b"model"),
            prior: ContentHash::of(b"prior"),
            generation: 1,
            numerics_version: NUMERICS_VERSION,
            inputs_digest: ContentHash::of(b"inputs"),
        }
    }

    fn life(prognoses: &[Prognosis]) -> IssuedForecasts<'_> {
        IssuedForecasts { failure_fh: FAILURE_FH, prognoses }
    }

    #[test]
    fn forecasts_are_judged_by_when_their_life_failed() {
        let good = vec![issued(1000.0, 0.5, 1.4), issued(1490.0, 0.5, 1.4), issued(2450.0, 0.5, 1.4)];
        // Too late by a half, said with a certainty that never holds; and one that came after the end.
        let bad = vec![issued(1000.0, 1.5, 1.6), issued(1580.0, 1.5, 1.6), issued(3000.0, 1.5, 1.6)];
        let board = score([&good, &bad].map(|prognoses| life(prognoses)).into_iter());
        assert_eq!((board.runs, board.predictions), (2, 5));
        assert_eq!(board.coverage.level_80, Some(3.0 / 5.0));
        assert_eq!(board.coverage_below_1000_fh.level_80, Some(1.0));
        assert_eq!(board.undecided, Some(0.0));
        let errors: Vec<_> = board.at_rul.iter().map(|at| (at.rul_fh, at.runs, at.relative_error)).collect();
        // The median of 900 known draws and 100 beyond the horizon is the 500th of them.
        let of_known = |low: f64, high: f64| low + (high - low) * 499.5 / 899.0 - 1.0;
        let expected = 0.5 * (of_known(0.5, 1.4) + of_known(1.5, 1.6));
        assert_eq!((errors[0].1, errors[0].2), (0, None), "no forecast was issued near 3,000 h of remaining life");
        assert_eq!((errors[1].0, errors[1].1), (1500.0, 2));
        assert!((errors[1].2.expect("known") - expected).abs() < 1e-6, "{errors:?}");
        assert_eq!((errors[2].0, errors[2].1), (500.0, 1));
    }

    #[test]
    fn a_life_without_forecasts_meets_nothing() {
        let board = score(std::iter::once(life(&[])));
        assert_eq!((board.runs, board.predictions, board.crps_fh), (1, 0, None));
        assert_eq!(board.prognostic_horizon.met, Some(0.0));
    }
}
