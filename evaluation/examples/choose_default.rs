//! Which estimator should be the default: every candidate on lives that it did not learn from.
//!
//! Two sets: recorded lives (`histories_prior.csv`, in ten folds, where the data are at hand) and generated lives
//! (learned from a hundred, judged on a thousand others). Prints the tables of `docs/backtests.md`:
//!
//! ```text
//! cargo run -p prognosis --example choose_default
//! ```

#[allow(dead_code, reason = "the tests read the excerpt")]
#[path = "../../prognosis/tests/it/histories/mod.rs"]
mod histories;
#[path = "../../prognosis/tests/it/labelled/mod.rs"]
mod labelled;

use std::path::Path;

use domain::{FaultModel, Scoreboard};
use ema::{
    lf2::Parameters,
    life::{DIAGNOSIS_SD, simulate_life},
    wear_law::Regime,
};
use evaluation::{
    Ridge,
    backtest::{BootstrapSettings, Comparison, ReplaySettings, Run, RunScore, replay, scoreboard},
};
use histories::Life;
use prognosis::{
    Climatology, Estimator, FinishedLife, FitSettings, FleetPrior, Observation, PredictionSettings, Rbg,
    fit_failure_time_error, fit_growth_changes, fit_prior,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings},
};
use rayon::prelude::*;

/// The candidates; all are compared with the first one.
const CANDIDATES: [&str; 4] = ["rbg", "rbg_constant", "ridge", "climatology"];
/// Folds of the recorded lives.
const FOLDS: usize = 10;
/// Seed of the generated lives; no other figure comes from it.
const SEED: u64 = 20_261_122;
/// Generated lives that teach, and that judge.
const TEACHING: u64 = 100;
const JUDGING: u64 = 1000;
/// How to predict.
const SETTINGS: ReplaySettings =
    ReplaySettings { every_fh: 200.0, prediction: PredictionSettings { draws: 200, horizon_fh: 8000.0 }, seed: 1 };

/// The scores of one life by all candidates.
struct Judged {
    varying: bool,
    scores: [RunScore; CANDIDATES.len()],
}

/// What earlier lives teach.
struct Learned {
    constant: FleetPrior,
    changing: FleetPrior,
    lives_fh: Vec<f64>,
}

fn main() {
    let Some(folder) = histories::folder() else {
        eprintln!("choose_default: no data; set ACTUARY_DATA");
        return;
    };
    let surrogate = surrogate(&folder);
    print_table("Recorded lives, ten folds", &recorded(&folder, &surrogate));
    print_table("Generated lives", &generated(&surrogate));
}

fn surrogate(folder: &Path) -> Surrogate {
    let mut samples = labelled::read(&folder.join("assess_train.csv"));
    samples.extend(labelled::read(&folder.join("assess_train_boundary1500.csv")));
    let settings = SurrogateSettings::FigureRegression(RegressionSettings::default());
    Surrogate::train(&samples, &FaultModel::electrical(), &settings).expect("good samples")
}

/// Every life is judged by what the other folds teach.
fn recorded(folder: &Path, surrogate: &Surrogate) -> Vec<Judged> {
    let lives = histories::read(folder, "prior");
    let fold = |fold: usize| {
        let (held_out, others): (Vec<_>, Vec<_>) = lives.iter().enumerate().partition(|(i, _)| i % FOLDS == fold);
        let others: Vec<FinishedLife> = others.into_iter().map(|(_, life)| finished(life)).collect();
        let learned = Learned::from(&others, surrogate);
        held_out.par_iter().map(|(_, life)| learned.judge(life, surrogate)).collect::<Vec<_>>()
    };
    (0..FOLDS).flat_map(fold).collect()
}

fn generated(surrogate: &Surrogate) -> Vec<Judged> {
    let teaching: Vec<FinishedLife> = (0..TEACHING).into_par_iter().map(|index| finished(&generate(index))).collect();
    let learned = Learned::from(&teaching, surrogate);
    let judging = TEACHING..TEACHING + JUDGING;
    judging.into_par_iter().map(|index| learned.judge(&generate(index), surrogate)).collect()
}

/// A life of the simulated fleet; constant and varying growth take turns.
fn generate(index: u64) -> Life {
    let regime = if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
    let life = simulate_life(&Parameters::assessment(), SEED, index, regime);
    let observation = |i: usize| Observation {
        t_fh: life.t_fh[i],
        fault_vector: life.observations[i].clone(),
        sigma: DIAGNOSIS_SD.to_vec(),
        load: Some(life.load[i]),
        temperature: Some(life.temperature[i]),
    };
    Life {
        regime: regime.as_str().to_owned(),
        failure_fh: life.t_failure_fh,
        observations: (0..life.t_fh.len()).map(observation).collect(),
    }
}

fn finished(life: &Life) -> FinishedLife {
    FinishedLife { observations: life.observations.clone(), failure_fh: life.failure_fh }
}

impl Learned {
    fn from(lives: &[FinishedLife], surrogate: &Surrogate) -> Self {
        let model = FaultModel::electrical();
        let histories: Vec<Vec<Observation>> = lives.iter().map(|life| life.observations.clone()).collect();
        let constant = fit_prior(&histories, &model, &FitSettings::default()).expect("lives");
        let changing = fit_growth_changes(&constant, &histories, &model).expect("lives");
        let [constant, changing] = [constant, changing].map(|prior| {
            let failure_time_error = fit_failure_time_error(lives, &model, &prior, surrogate, 1);
            FleetPrior { failure_time_error, ..prior }
        });
        Self { constant, changing, lives_fh: lives.iter().map(|life| life.failure_fh).collect() }
    }

    /// All candidates on one life.
    fn judge(&self, life: &Life, boundary: &Surrogate) -> Judged {
        let model = &FaultModel::electrical();
        let candidates: [&dyn Estimator; CANDIDATES.len()] = [
            &Rbg { model, prior: &self.changing, boundary },
            &Rbg { model, prior: &self.constant, boundary },
            &Ridge { model, prior: &self.constant, boundary },
            &Climatology::of_failures(&self.lives_fh).expect("lives"),
        ];
        let id = life.failure_fh.to_string();
        let run = Run { id, observations: life.observations.clone(), failure_fh: Some(life.failure_fh) };
        let score = |candidate| replay(&run, candidate, &SETTINGS).score.expect("a known failure");
        Judged { varying: life.regime == Regime::Varying.as_str(), scores: candidates.map(score) }
    }
}

fn print_table(name: &str, judged: &[Judged]) {
    println!("{name} ({}):\n", judged.len());
    println!(
        "| estimator | CRPS h: constant, varying, all | more than `{}` | cover, 80 / 95 % | below 1000 h | \
         median error % at 3000 / 1500 / 500 h |",
        CANDIDATES[0]
    );
    println!("|---|---|---|---|---|---|");
    for (which, candidate) in CANDIDATES.iter().enumerate() {
        println!("| `{candidate}` | {} |", row(judged, which));
    }
    println!();
}

fn row(judged: &[Judged], which: usize) -> String {
    let of = |which: usize, keep: &dyn Fn(&Judged) -> bool| -> Vec<&RunScore> {
        judged.iter().filter(|life| keep(life)).map(|life| &life.scores[which]).collect()
    };
    let crps = |board: &Scoreboard| board.crps_fh.expect("predictions");
    let [constant, varying] =
        [false, true].map(|varying| crps(&scoreboard(&of(which, &|life| life.varying == varying))));
    let all = of(which, &|_| true);
    let board = scoreboard(&all);
    let coverage = [board.coverage, board.coverage_below_1000_fh].map(|coverage| {
        let [at_80, at_95] = [coverage.level_80, coverage.level_95].map(|share| share.expect("predictions"));
        format!("{at_80:.3} / {at_95:.3}")
    });
    let errors: Vec<String> = board
        .at_rul
        .iter()
        .map(|at| at.relative_error.map_or("-".to_owned(), |error| format!("{:+.0}", 100.0 * error)))
        .collect();
    let comparison = Comparison::of(&all, &of(0, &|_| true), &BootstrapSettings::default()).expect("predictions");
    let more = match comparison.interval_fh {
        Some(interval) if which > 0 => {
            format!("{:+.1} ({:+.1} to {:+.1})", comparison.crps_difference_fh, interval.low, interval.high)
        }
        _ => String::new(),
    };
    let (all, late, errors) = (crps(&board), &coverage[1], errors.join(" / "));
    format!("{constant:.0}, {varying:.0}, {all:.1} | {more} | {} | {late} | {errors}", coverage[0])
}
