//! `metrics.json`, and its summary on the terminal.

use std::{collections::BTreeMap, fmt::Write as _};

use prognosis::backtest::{Replay, RunScore, Scoreboard};
use serde::{Serialize, Serializer};

use super::{Arguments, Judged, SEED};

/// The file.
#[derive(Debug, Serialize)]
pub struct Metrics {
    /// How it was made.
    pub settings: Settings,
    /// Runs predicted, and those of known failure.
    pub runs: Runs,
    /// By name, in the order asked for.
    #[serde(serialize_with = "by_name")]
    pub estimators: Vec<Judgement>,
}

fn by_name<S: Serializer>(judgements: &[Judgement], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(judgements.iter().map(|judgement| (judgement.estimator, judgement)))
}

/// How it was made.
#[derive(Debug, Serialize)]
pub struct Settings {
    /// Flight hours between predictions.
    pub every_fh: f64,
    /// Draws of each.
    pub draws: u32,
    /// Remaining lives beyond are censored, flight hours.
    pub horizon_fh: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Standard deviation of one observation of each fault.
    pub observation_sigma: BTreeMap<String, f64>,
    /// Error of the surrogate that was carried into the predictions, flight hours: mean and standard deviation.
    pub failure_time_error_fh: Option<[f64; 2]>,
    /// Version of the code.
    pub code_version: &'static str,
}

/// How many.
#[derive(Debug, Serialize)]
pub struct Runs {
    /// Predicted.
    pub predicted: usize,
    /// Of known failure.
    pub judged: usize,
}

/// One estimator.
#[derive(Debug, Serialize)]
pub struct Judgement {
    /// Its name.
    #[serde(skip)]
    pub estimator: &'static str,
    /// All runs.
    pub all: Scoreboard,
    /// The runs of each regime, where the files tell regimes.
    pub regimes: BTreeMap<String, Scoreboard>,
}

impl Metrics {
    /// Of everything judged.
    pub fn new(arguments: &Arguments, judged: &Judged) -> Self {
        let knowledge = judged.knowledge;
        let error = knowledge.prior.failure_time_error;
        let estimators = judged.replays.iter().map(|replays| Judgement::new(replays.estimator, &replays.runs, judged));
        Self {
            settings: Settings {
                every_fh: arguments.every,
                draws: arguments.draws,
                horizon_fh: arguments.horizon,
                seed: SEED,
                observation_sigma: knowledge.faults.names.iter().cloned().zip(knowledge.sigma.clone()).collect(),
                failure_time_error_fh: error.map(|error| [error.offset_fh, error.sd_fh]),
                code_version: env!("CARGO_PKG_VERSION"),
            },
            runs: Runs {
                predicted: judged.recorded.len(),
                judged: judged.recorded.iter().filter(|recorded| recorded.run.failure_fh.is_some()).count(),
            },
            estimators: estimators.collect(),
        }
    }

    /// A line per estimator and group of runs.
    pub fn summary(&self) -> String {
        let mut table = format!(
            "{:<9} {:<12} {:>5} {:>8} {:>7} {:>7}   {}\n",
            "estimator", "runs", "", "CRPS h", "80 %", "95 %", "median error at 3000 / 1500 / 500 h"
        );
        for judgement in &self.estimators {
            for (group, board) in judgement.groups() {
                let number = |value: Option<f64>, digits| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
                let errors: Vec<_> = board.at_rul.iter().map(|at| percent(at.runs, at.relative_error)).collect();
                writeln!(
                    table,
                    "{:<9} {:<12} {:>5} {:>8} {:>7} {:>7}   {}",
                    judgement.estimator,
                    group,
                    board.runs,
                    number(board.crps_fh, 1),
                    number(board.coverage.level_80, 3),
                    number(board.coverage.level_95, 3),
                    errors.join(" / ")
                )
                .expect("writing to a string");
            }
        }
        table
    }
}

impl Judgement {
    fn new(estimator: &'static str, runs: &[Replay], judged: &Judged) -> Self {
        let mut all: Vec<&RunScore> = Vec::new();
        let mut regimes: BTreeMap<String, Vec<&RunScore>> = BTreeMap::new();
        for (recorded, replay) in judged.recorded.iter().zip(runs) {
            let Some(score) = &replay.score else { continue };
            all.push(score);
            if let Some(regime) = &recorded.regime {
                regimes.entry(regime.clone()).or_default().push(score);
            }
        }
        let regimes = regimes.into_iter().map(|(regime, scores)| (regime, Scoreboard::of(&scores)));
        Self { estimator, all: Scoreboard::of(&all), regimes: regimes.collect() }
    }

    /// Every group of runs with its name.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &Scoreboard)> {
        std::iter::once(("all", &self.all)).chain(self.regimes.iter().map(|(regime, board)| (regime.as_str(), board)))
    }
}

/// A relative error in per cent: beyond the horizon, or of no run at all.
pub fn percent(runs: usize, error: Option<f64>) -> String {
    match error {
        Some(error) => format!("{:+.1} %", 100.0 * error),
        None if runs > 0 => "censored".to_owned(),
        None => "-".to_owned(),
    }
}
