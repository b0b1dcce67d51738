//! Forecasts of sixteen recorded lives with a prior that twelve others taught: what of the benchmark every clone has.

use crate::{
    histories::{self, Life},
    labelled,
};
use domain::FaultModel;
use evaluation::backtest::{Bootstrap, BootstrapSettings, Comparison, ReplaySettings, Run, RunScore, replay};
use prognosis::{
    Climatology, Estimator, FinishedLife, FitSettings, FleetPrior, PredictionSettings, Rbg, fit_failure_time_error,
    fit_growth_changes, fit_prior,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings},
};
use rayon::prelude::*;

/// One resampled figure of twenty lies outside.
const RESAMPLING: BootstrapSettings = BootstrapSettings { resamples: 1000, level: 0.95, seed: 1 };

fn surrogate() -> Surrogate {
    let samples = labelled::read(&histories::excerpt().join("../assess/surrogate_train.csv"));
    let settings = SurrogateSettings::FigureRegression(RegressionSettings::default());
    Surrogate::train(&samples, &FaultModel::electrical(), &settings).unwrap()
}

fn learned(lives: &[Life], surrogate: &Surrogate) -> FleetPrior {
    let finished = |life: &Life| FinishedLife { observations: life.observations.clone(), failure_fh: life.failure_fh };
    let finished: Vec<FinishedLife> = lives.iter().map(finished).collect();
    let observations: Vec<_> = finished.iter().map(|life| life.observations.clone()).collect();
    let model = FaultModel::electrical();
    let constant = fit_prior(&observations, &model, &FitSettings::default()).unwrap();
    let prior = fit_growth_changes(&constant, &observations, &model).unwrap();
    FleetPrior { failure_time_error: fit_failure_time_error(&finished, &model, &prior, surrogate, 1), ..prior }
}

fn judged<E: Estimator + Sync>(lives: &[Life], estimator: &E) -> Vec<RunScore> {
    let prediction = PredictionSettings { draws: 200, horizon_fh: 8000.0 };
    let settings = ReplaySettings { every_fh: 200.0, prediction, seed: 1 };
    let score = |(index, life): (usize, &Life)| {
        let (id, failure_fh) = (index.to_string(), Some(life.failure_fh));
        let run = Run { id, observations: life.observations.clone(), failure_fh };
        replay(&run, estimator, &settings).score.expect("a known failure")
    };
    lives.par_iter().enumerate().map(score).collect()
}

/// Against the forecast that looks at no observation, and against what 80 and 95 % say.
#[test]
fn on_recorded_lives_forecasts_beat_climatology_and_their_intervals_hold() {
    let folder = histories::excerpt();
    let (earlier, lives) = (histories::read(&folder, "prior"), histories::read(&folder, "public"));
    assert_eq!((earlier.len(), lives.len()), (12, 16));
    let (model, surrogate) = (FaultModel::electrical(), surrogate());
    let prior = learned(&earlier, &surrogate);
    let ours = judged(&lives, &Rbg { model: &model, prior: &prior, boundary: &surrogate });
    let lives_fh: Vec<f64> = earlier.iter().map(|life| life.failure_fh).collect();
    let climatology = Climatology::of_failures(&lives_fh).expect("failures");
    let theirs = judged(&lives, &climatology);
    let (ours, theirs): (Vec<&RunScore>, Vec<&RunScore>) = (ours.iter().collect(), theirs.iter().collect());

    let comparison = Comparison::of(&ours, &theirs, &RESAMPLING).unwrap();
    println!("{comparison:?}");
    assert!(comparison.interval_fh.unwrap().high < 0.0, "{comparison:?}");
    let resampled = Bootstrap::new(&ours, &RESAMPLING);
    let level_80 = resampled.interval(|board| board.coverage.level_80).unwrap();
    let level_95 = resampled.interval(|board| board.coverage.level_95).unwrap();
    println!("{level_80:?} {level_95:?}");
    assert!(level_80.low <= 0.8 && 0.8 <= level_80.high, "{level_80:?}");
    assert!(level_95.low <= 0.95 && 0.95 <= level_95.high, "{level_95:?}");
}
