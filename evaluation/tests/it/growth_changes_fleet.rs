//! Growth changes on recorded lives: what they are worth on lives held out, and the figures of the benchmark.

use std::path::Path;

use crate::histories::{self, Life};
use domain::{FaultModel, Scoreboard};
use evaluation::backtest::{Replay, ReplaySettings, Run, RunScore, replay, scoreboard};
use prognosis::{
    FinishedLife, FitSettings, FleetPrior, PredictionSettings, Rbg, fit_failure_time_error, fit_growth_changes,
    fit_prior,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings},
};
use rayon::prelude::*;

use crate::labelled;

fn settings(every_fh: f64, draws: usize) -> ReplaySettings {
    ReplaySettings { every_fh, prediction: PredictionSettings { draws, horizon_fh: 8000.0 }, seed: 1 }
}

fn surrogate(folder: &Path) -> Surrogate {
    let mut samples = labelled::read(&folder.join("assess_train.csv"));
    samples.extend(labelled::read(&folder.join("assess_train_boundary1500.csv")));
    let settings = SurrogateSettings::FigureRegression(RegressionSettings::default());
    Surrogate::train(&samples, &FaultModel::electrical(), &settings).unwrap()
}

/// The priors without and with growth changes that lives teach.
fn learn(lives: &[&Life], surrogate: &Surrogate) -> [FleetPrior; 2] {
    let model = FaultModel::electrical();
    let finished = |life: &&Life| FinishedLife { observations: life.observations.clone(), failure_fh: life.failure_fh };
    let finished: Vec<FinishedLife> = lives.iter().map(finished).collect();
    let histories: Vec<_> = finished.iter().map(|life| life.observations.clone()).collect();
    let constant = fit_prior(&histories, &model, &FitSettings::default()).unwrap();
    let changing = fit_growth_changes(&constant, &histories, &model).unwrap();
    [constant, changing].map(|prior| {
        let failure_time_error = fit_failure_time_error(&finished, &model, &prior, surrogate, 1);
        FleetPrior { failure_time_error, ..prior }
    })
}

/// The scores of the lives, with their regimes.
fn judge(
    lives: &[&Life],
    prior: &FleetPrior,
    surrogate: &Surrogate,
    settings: &ReplaySettings,
) -> Vec<(String, RunScore)> {
    let model = FaultModel::electrical();
    let estimator = Rbg { model: &model, prior, boundary: surrogate };
    let score = |(index, life): (usize, &&Life)| {
        let (id, failure_fh) = (index.to_string(), Some(life.failure_fh));
        let Replay { score, .. } =
            replay(&Run { id, observations: life.observations.clone(), failure_fh }, &estimator, settings);
        (life.regime.clone(), score.expect("a known failure"))
    };
    lives.par_iter().enumerate().map(score).collect()
}

/// Of one regime, or of all.
fn board(scores: &[(String, RunScore)], regime: &str) -> Scoreboard {
    let of_regime = scores.iter().filter(|(other, _)| regime.is_empty() || other == regime);
    let board = scoreboard(&of_regime.map(|(_, score)| score).collect::<Vec<_>>());
    let Scoreboard { crps_fh, coverage, coverage_below_1000_fh, at_rul, .. } = &board;
    println!("{regime:9} CRPS {crps_fh:?} {coverage:?} below 1000 h {coverage_below_1000_fh:?}");
    at_rul.iter().for_each(|at| println!("          {at:?}"));
    board
}

/// Every second life of each regime teaches, the others judge, and the other way round.
#[test]
fn slow_on_lives_held_out_growth_changes_score_and_cover_better() {
    let Some(folder) = histories::folder() else { return };
    let (surrogate, lives) = (surrogate(&folder), histories::read(&folder, "prior"));
    let mut halves = [Vec::new(), Vec::new()];
    for regime in ["constant", "varying"] {
        let of_regime = lives.iter().filter(|life| life.regime == regime);
        of_regime.enumerate().for_each(|(index, life)| halves[index % 2].push(life));
    }
    let mut scores = [Vec::new(), Vec::new()];
    for (teaching, judging) in [(0, 1), (1, 0)] {
        let priors = learn(&halves[teaching], &surrogate);
        for (prior, scores) in priors.iter().zip(&mut scores) {
            scores.extend(judge(&halves[judging], prior, &surrogate, &settings(400.0, 200)));
        }
    }
    let [constant, changing] = scores.map(|scores| board(&scores, ""));
    assert!(changing.crps_fh.unwrap() < 0.985 * constant.crps_fh.unwrap());
    assert!(changing.coverage.level_80.unwrap() > constant.coverage.level_80.unwrap());
    assert!((0.76..=0.86).contains(&changing.coverage.level_80.unwrap()));
    assert!((0.93..=0.98).contains(&changing.coverage.level_95.unwrap()));
}

/// The independent prototype scores CRPS 161 / 228 h.
#[test]
fn slow_the_benchmark_with_growth_changes_is_no_worse_than_the_reference() {
    let Some(folder) = histories::folder() else { return };
    let (surrogate, earlier) = (surrogate(&folder), histories::read(&folder, "prior"));
    let [_, prior] = learn(&earlier.iter().collect::<Vec<_>>(), &surrogate);
    let mut lives = histories::read(&folder, "public");
    lives.extend(histories::read(&folder, "bench_rest"));
    assert_eq!(lives.len(), 100);
    let scores = judge(&lives.iter().collect::<Vec<_>>(), &prior, &surrogate, &settings(200.0, 1000));
    let [constant, varying] = ["constant", "varying"].map(|regime| board(&scores, regime));
    assert!(constant.crps_fh.unwrap() <= 161.0);
    assert!(varying.crps_fh.unwrap() <= 228.0);
}
