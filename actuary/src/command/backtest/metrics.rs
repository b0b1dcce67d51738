//! `metrics.json`, and its summary on the terminal.

use std::{collections::BTreeMap, fmt::Write as _};

use domain::Scoreboard;
use prognosis::backtest::{
    Bootstrap, BootstrapSettings, Comparison, Interval, JUDGED_RULS_FH, Replay, RunScore, scoreboard,
};
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
    /// Probability of the intervals of figures, and the number of resamples of the runs behind them.
    pub interval_level: f64,
    /// See above.
    pub resamples: usize,
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
    pub all: GroupScores,
    /// The runs of each regime, where the files tell regimes.
    pub regimes: BTreeMap<String, GroupScores>,
}

/// A group of runs.
#[derive(Debug, Serialize)]
pub struct GroupScores {
    /// The figures.
    #[serde(flatten)]
    pub board: Scoreboard,
    /// How sure they are.
    pub intervals: Intervals,
    /// Compared with the first estimator, run by run; nothing for that one itself.
    pub against_first: Option<Comparison>,
}

/// Bootstrap intervals over runs.
#[derive(Debug, Serialize)]
pub struct Intervals {
    /// Of the mean score, flight hours.
    pub crps_fh: Option<Interval>,
    /// Of the coverage of the central 80 % intervals.
    pub coverage_80: Option<Interval>,
    /// Of the central 95 % ones.
    pub coverage_95: Option<Interval>,
    /// Of the central 80 % intervals within the last 1,000 h.
    pub coverage_80_below_1000_fh: Option<Interval>,
    /// Of the central 95 % ones.
    pub coverage_95_below_1000_fh: Option<Interval>,
    /// Of the errors of the median at given true remaining lives.
    pub at_rul: Vec<Option<Interval>>,
    /// Of the median horizon when the criterion is first met, flight hours.
    pub horizon_fh: Option<Interval>,
    /// Of the median horizon from which on the median stays within a tenth of the life of the truth, flight hours.
    pub sustained_life_horizon_fh: Option<Interval>,
}

impl Intervals {
    fn of(scores: &[&RunScore]) -> Self {
        let bootstrap = Bootstrap::new(scores, &BootstrapSettings::default());
        let figure = |figure: fn(&Scoreboard) -> Option<f64>| bootstrap.interval(figure);
        Self {
            crps_fh: figure(|board| board.crps_fh),
            coverage_80: figure(|board| board.coverage.level_80),
            coverage_95: figure(|board| board.coverage.level_95),
            coverage_80_below_1000_fh: figure(|board| board.coverage_below_1000_fh.level_80),
            coverage_95_below_1000_fh: figure(|board| board.coverage_below_1000_fh.level_95),
            at_rul: (0..JUDGED_RULS_FH.len())
                .map(|which| bootstrap.interval(|board| board.at_rul[which].relative_error))
                .collect(),
            horizon_fh: figure(|board| board.prognostic_horizon.median_fh),
            sustained_life_horizon_fh: figure(|board| board.life_horizon.sustained_median_fh),
        }
    }
}

impl Metrics {
    /// Of everything judged.
    pub fn new(arguments: &Arguments, judged: &Judged) -> Self {
        let knowledge = judged.knowledge;
        let error = knowledge.prior.failure_time_error;
        let BootstrapSettings { resamples, level, .. } = BootstrapSettings::default();
        let estimators = (0..judged.replays.len()).map(|index| Judgement::new(index, judged));
        Self {
            settings: Settings {
                every_fh: arguments.every,
                draws: arguments.draws,
                horizon_fh: arguments.horizon,
                seed: SEED,
                interval_level: level,
                resamples,
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
            "{:<11} {:<12} {:>5} {:>8} {:>7} {:>7}   {}\n",
            "estimator", "runs", "", "CRPS h", "80 %", "95 %", "median error at 3000 / 1500 / 500 h"
        );
        for judgement in &self.estimators {
            for (group, GroupScores { board, .. }) in judgement.groups() {
                let number = |value: Option<f64>, digits| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
                let errors: Vec<_> = board.at_rul.iter().map(|at| percent(at.runs, at.relative_error)).collect();
                writeln!(
                    table,
                    "{:<11} {:<12} {:>5} {:>8} {:>7} {:>7}   {}",
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
    fn new(index: usize, judged: &Judged) -> Self {
        let replays = &judged.replays[index];
        let (ours, first) = (Groups::of(&replays.runs, judged), Groups::of(&judged.replays[0].runs, judged));
        let scores = |ours: &[&RunScore], first: &[&RunScore]| GroupScores {
            board: scoreboard(ours),
            intervals: Intervals::of(ours),
            against_first: (index > 0).then(|| Comparison::of(ours, first, &BootstrapSettings::default())).flatten(),
        };
        let regimes = ours.regimes.iter().zip(first.regimes.values());
        Self {
            estimator: replays.estimator,
            all: scores(&ours.all, &first.all),
            regimes: regimes.map(|((regime, ours), first)| ((*regime).to_owned(), scores(ours, first))).collect(),
        }
    }

    /// Every group of runs with its name.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &GroupScores)> {
        std::iter::once(("all", &self.all)).chain(self.regimes.iter().map(|(regime, group)| (regime.as_str(), group)))
    }
}

/// The scores of one estimator, of all runs and by regime.
struct Groups<'a> {
    all: Vec<&'a RunScore>,
    regimes: BTreeMap<&'a str, Vec<&'a RunScore>>,
}

impl<'a> Groups<'a> {
    fn of(runs: &'a [Replay], judged: &'a Judged) -> Self {
        let mut groups = Self { all: Vec::new(), regimes: BTreeMap::new() };
        for (recorded, replay) in judged.recorded.iter().zip(runs) {
            let Some(score) = &replay.score else { continue };
            groups.all.push(score);
            if let Some(regime) = &recorded.regime {
                groups.regimes.entry(regime).or_default().push(score);
            }
        }
        groups
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
