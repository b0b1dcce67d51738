//! The scores of many runs in one table.

use domain::scoreboard::{AlphaLambda, AtRul, Coverage, Horizons, LifeHorizons, RulBin, Scoreboard};
use numerics::quantile;

use super::{CRITERION, JUDGED_RULS_FH, LAMBDAS, LIFE_BAND, PredictionScore, RunScore};
use crate::metrics::Horizon;

/// Bins of the histogram of the probability integral transform.
const PIT_BINS: usize = 10;
/// "Late": true remaining lives below this, flight hours.
pub(crate) const LATE_FH: f64 = 1000.0;
/// Width and number of the bins of true remaining life, flight hours; the last bin is open.
pub(crate) const BIN_FH: f64 = 500.0;
const BINS: usize = 8;

/// The scoreboard of these runs.
pub fn scoreboard(scores: &[&RunScore]) -> Scoreboard {
    let pooled = || scores.iter().flat_map(|score| &score.predictions);
    let late = || pooled().filter(|prediction| prediction.truth_fh < LATE_FH);
    Scoreboard {
        runs: scores.len(),
        predictions: pooled().count(),
        crps_fh: mean(pooled().map(|prediction| prediction.crps_fh)),
        coverage: coverage(pooled()),
        coverage_below_1000_fh: coverage(late()),
        pit: histogram(pooled().map(|prediction| prediction.pit)),
        undecided: share(pooled().map(|prediction| prediction.undecided)),
        by_rul: (0..BINS).map(|bin| rul_bin(scores, bin)).collect(),
        at_rul: (0..JUDGED_RULS_FH.len()).map(|which| at_rul(scores, which)).collect(),
        alpha_lambda: (0..LAMBDAS.len()).map(|which| alpha_lambda(scores, which)).collect(),
        prognostic_horizon: horizons(scores),
        life_horizon: life_horizons(scores),
        cumulative_relative_accuracy: mean(scores.iter().filter_map(|score| score.cumulative_relative_accuracy)),
        cumulative_event_accuracy: mean(scores.iter().filter_map(|score| score.cumulative_event_accuracy)),
    }
}

fn coverage<'a>(predictions: impl Iterator<Item = &'a PredictionScore> + Clone) -> Coverage {
    Coverage {
        level_80: share(predictions.clone().map(|prediction| prediction.covered_80)),
        level_95: share(predictions.map(|prediction| prediction.covered_95)),
    }
}

fn rul_bin(scores: &[&RunScore], bin: usize) -> RulBin {
    let here = |prediction: &&PredictionScore| ((prediction.truth_fh / BIN_FH) as usize).min(BINS - 1) == bin;
    let inside = || scores.iter().flat_map(|score| &score.predictions).filter(here);
    RulBin {
        from_fh: bin as f64 * BIN_FH,
        to_fh: (bin + 1 < BINS).then_some((bin + 1) as f64 * BIN_FH),
        runs: scores.iter().filter(|score| score.predictions.iter().any(|p| here(&p))).count(),
        predictions: inside().count(),
        crps_fh: mean(inside().map(|prediction| prediction.crps_fh)),
        coverage: coverage(inside()),
    }
}

fn horizons(scores: &[&RunScore]) -> Horizons {
    let median_of = |value: fn(&Horizon) -> Option<f64>| {
        median(scores.iter().map(|score| value(&score.prognostic_horizon).unwrap_or(0.0)).collect())
    };
    Horizons {
        alpha: CRITERION.alpha,
        beta: CRITERION.beta,
        met: share(scores.iter().map(|score| score.prognostic_horizon.first_fh.is_some())),
        median_fh: median_of(|horizon| horizon.first_fh),
        sustained_median_fh: median_of(|horizon| horizon.sustained_fh),
    }
}

fn life_horizons(scores: &[&RunScore]) -> LifeHorizons {
    let median_of = |value: fn(&Horizon) -> Option<f64>| {
        median(scores.iter().map(|score| value(&score.life_horizon).unwrap_or(0.0)).collect())
    };
    LifeHorizons {
        share_of_life: LIFE_BAND,
        median_fh: median_of(|horizon| horizon.first_fh),
        sustained_median_fh: median_of(|horizon| horizon.sustained_fh),
    }
}

fn at_rul(scores: &[&RunScore], which: usize) -> AtRul {
    let errors: Vec<f64> = scores.iter().filter_map(|score| score.median_errors[which]).collect();
    AtRul {
        rul_fh: JUDGED_RULS_FH[which],
        runs: errors.len(),
        relative_error: median(errors).filter(|error| error.is_finite()),
    }
}

fn alpha_lambda(scores: &[&RunScore], which: usize) -> AlphaLambda {
    AlphaLambda {
        alpha: CRITERION.alpha,
        beta: CRITERION.beta,
        lambda: LAMBDAS[which],
        met: share(scores.iter().map(|score| score.alpha_lambda[which] == Some(true))),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}

fn share(values: impl Iterator<Item = bool>) -> Option<f64> {
    mean(values.map(|value| f64::from(u8::from(value))))
}

fn median(values: Vec<f64>) -> Option<f64> {
    quantile::median(&quantile::sorted(values))
}

fn histogram(ranks: impl Iterator<Item = f64>) -> Option<Vec<f64>> {
    let (mut counts, mut all) = (vec![0.0; PIT_BINS], 0.0);
    for rank in ranks {
        counts[((rank * PIT_BINS as f64) as usize).min(PIT_BINS - 1)] += 1.0;
        all += 1.0;
    }
    (all > 0.0).then(|| counts.into_iter().map(|count| count / all).collect())
}
