//! The figures of a backtest, by estimator and group of runs, and their summary in words.

use std::{collections::BTreeMap, fmt::Write as _};

use domain::{Scoreboard, scoreboard::Coverage};
use serde::{Serialize, Serializer};

use crate::{
    Oracle,
    backtest::{
        Bootstrap, BootstrapSettings, Comparison, Interval, JUDGED_RULS_FH, OracleGap, ReplaySettings, RunScore,
        scoreboard,
    },
    contest::{Judged, Replays},
    terms::Unit,
};

/// The file.
#[derive(Debug, Serialize)]
pub struct Metrics {
    /// How it was made.
    pub settings: Settings,
    /// Runs predicted, and those of known failure.
    pub runs: Runs,
    /// The judgements by name, in the order asked for.
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
    pub draws: usize,
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
    /// Runs of known failure.
    pub judged: usize,
    /// Those of them that the oracle was told the law of; `None` without an oracle.
    pub judged_by_oracle: Option<usize>,
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
    /// The share of the gap between climatology and oracle that is closed, where both are judged.
    pub oracle_gap: Option<OracleGap>,
    /// What the estimator advised not to trust.
    pub doubts: Doubts,
}

/// Predictions that the estimator advised not to trust, and the scores of the others.
#[derive(Debug, Serialize)]
pub struct Doubts {
    /// Share of the predictions that it doubts.
    pub doubted: Option<f64>,
    /// Predictions that it does not doubt.
    pub trusted_predictions: usize,
    /// Their mean score, flight hours.
    pub trusted_crps_fh: Option<f64>,
    /// Their coverage.
    pub trusted_coverage: Coverage,
}

impl Doubts {
    fn of(scores: &[&RunScore]) -> Self {
        let trusted = |score: &&RunScore| {
            let mut trusted = (*score).clone();
            trusted.predictions.retain(|prediction| !prediction.doubted);
            trusted
        };
        let trusted: Vec<RunScore> = scores.iter().map(trusted).collect();
        let board = scoreboard(&trusted.iter().collect::<Vec<_>>());
        let all = scores.iter().map(|score| score.predictions.len()).sum::<usize>();
        Self {
            doubted: (all > 0).then(|| 1.0 - board.predictions as f64 / all as f64),
            trusted_predictions: board.predictions,
            trusted_crps_fh: board.crps_fh,
            trusted_coverage: board.coverage,
        }
    }
}

/// Bootstrap intervals over runs.
#[derive(Debug, Serialize)]
pub struct Intervals {
    /// The interval of the mean score, flight hours.
    pub crps_fh: Option<Interval>,
    /// That of the coverage of the central 80 % intervals.
    pub coverage_80: Option<Interval>,
    /// The same of the central 95 % ones.
    pub coverage_95: Option<Interval>,
    /// The same of the central 80 % intervals within the last 1,000 h.
    pub coverage_80_below_1000_fh: Option<Interval>,
    /// The same of the central 95 % ones.
    pub coverage_95_below_1000_fh: Option<Interval>,
    /// The intervals of the errors of the median at given true remaining lives.
    pub at_rul: Vec<Option<Interval>>,
    /// The interval of the median horizon when the criterion is first met, flight hours.
    pub horizon_fh: Option<Interval>,
    /// That of the median horizon from which on the median stays within a tenth of the life of the truth, flight hours.
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
    /// Judges everything.
    pub fn new(settings: &ReplaySettings, judged: &Judged) -> Self {
        let error = judged.failure_time_error;
        let BootstrapSettings { resamples, level, .. } = BootstrapSettings::default();
        let estimators = (0..judged.replays.len()).map(|index| Judgement::new(index, judged));
        Self {
            settings: Settings {
                every_fh: settings.every_fh,
                draws: settings.prediction.draws,
                horizon_fh: settings.prediction.horizon_fh,
                seed: settings.seed,
                interval_level: level,
                resamples,
                observation_sigma: judged.faults.names.iter().cloned().zip(judged.sigma.iter().copied()).collect(),
                failure_time_error_fh: error.map(|error| [error.offset_fh, error.sd_fh]),
                code_version: env!("CARGO_PKG_VERSION"),
            },
            runs: Runs {
                predicted: judged.recorded.len(),
                judged: judged.recorded.iter().filter(|recorded| recorded.run.failure_fh.is_some()).count(),
                judged_by_oracle: judged.of(Oracle::NAME).map(|oracle| oracle.scores(&all_runs(judged)).len()),
            },
            estimators: estimators.collect(),
        }
    }

    /// A line per estimator and group of runs.
    pub fn summary(&self, time: &Unit) -> String {
        let score = format!("CRPS {}", time.name);
        let (wide, lives) = (
            score.chars().count().max(8),
            JUDGED_RULS_FH.map(|rul_fh| format!("{:.*}", time.decimals(), time.of(rul_fh))).join(" / "),
        );
        let mut table = format!(
            "{:<11} {:<12} {:>5} {score:>wide$} {:>7} {:>7} {:>7} {:>7}   median error at {lives} {}\n",
            "estimator", "runs", "", "80 %", "95 %", "doubted", "gap", time.name
        );
        for judgement in &self.estimators {
            for (group, GroupScores { board, doubts, oracle_gap, .. }) in judgement.groups() {
                let number = |value: Option<f64>, digits| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
                let errors: Vec<_> = board.at_rul.iter().map(|at| percent(at.runs, at.relative_error)).collect();
                writeln!(
                    table,
                    "{:<11} {:<12} {:>5} {:>wide$} {:>7} {:>7} {:>7} {:>7}   {}",
                    judgement.estimator,
                    group,
                    board.runs,
                    number(board.crps_fh.map(|crps_fh| time.of(crps_fh)), time.decimals() + 1),
                    number(board.coverage.level_80, 3),
                    number(board.coverage.level_95, 3),
                    number(doubts.doubted, 3),
                    number(oracle_gap.as_ref().map(|gap| gap.closed), 3),
                    errors.join(" / ")
                )
                .expect("writing to a string");
            }
        }
        if let Some(told) = self.runs.judged_by_oracle.filter(|told| *told < self.runs.judged) {
            let runs = self.runs.judged;
            writeln!(table, "the law of {} of {runs} runs is not known: the oracle leaves them out", runs - told)
                .expect("writing to a string");
        }
        table
    }
}

impl Judgement {
    fn new(index: usize, judged: &Judged) -> Self {
        let replays = &judged.replays[index];
        let scores = |runs: &[usize]| {
            let ours: Vec<&RunScore> = replays.scores(runs).into_values().collect();
            GroupScores {
                board: scoreboard(&ours),
                intervals: Intervals::of(&ours),
                against_first: (index > 0).then(|| against(replays, &judged.replays[0], runs)).flatten(),
                oracle_gap: oracle_gap(replays, judged, runs),
                doubts: Doubts::of(&ours),
            }
        };
        Self {
            estimator: replays.estimator,
            all: scores(&all_runs(judged)),
            regimes: regimes(judged).into_iter().map(|(regime, runs)| (regime.to_owned(), scores(&runs))).collect(),
        }
    }

    /// Every group of runs with its name.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &GroupScores)> {
        std::iter::once(("all", &self.all)).chain(self.regimes.iter().map(|(regime, group)| (regime.as_str(), group)))
    }
}

/// Compared with another estimator on the runs that both have scores of.
fn against(ours: &Replays, theirs: &Replays, runs: &[usize]) -> Option<Comparison> {
    let [ours, theirs] = in_common([ours, theirs], runs);
    Comparison::of(&ours, &theirs, &BootstrapSettings::default())
}

/// The gap that an estimator closes which is neither climatology nor oracle.
fn oracle_gap(ours: &Replays, judged: &Judged, runs: &[usize]) -> Option<OracleGap> {
    let (climatology, oracle) = (judged.of("climatology")?, judged.of(Oracle::NAME)?);
    if [climatology.estimator, oracle.estimator].contains(&ours.estimator) {
        return None;
    }
    let [ours, climatology, oracle] = in_common([ours, climatology, oracle], runs);
    OracleGap::of(&ours, &climatology, &oracle, &BootstrapSettings::default())
}

/// Scores of the runs that all have scores of, in their order.
fn in_common<'a, const N: usize>(estimators: [&'a Replays; N], runs: &[usize]) -> [Vec<&'a RunScore>; N] {
    let known = |run: &usize| estimators.iter().all(|replays| replays.runs[*run].score.is_some());
    let runs: Vec<usize> = runs.iter().copied().filter(known).collect();
    estimators.map(|replays| replays.scores(&runs).into_values().collect())
}

fn all_runs(judged: &Judged) -> Vec<usize> {
    (0..judged.recorded.len()).collect()
}

/// The runs of each regime.
fn regimes<'a>(judged: &Judged<'a>) -> BTreeMap<&'a str, Vec<usize>> {
    let mut regimes: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (run, recorded) in judged.recorded.iter().enumerate() {
        if let (Some(regime), Some(_)) = (&recorded.regime, recorded.run.failure_fh) {
            regimes.entry(regime).or_default().push(run);
        }
    }
    regimes
}

/// A relative error in per cent: beyond the horizon, or of no run at all.
pub fn percent(runs: usize, error: Option<f64>) -> String {
    match error {
        Some(error) => format!("{:+.1} %", 100.0 * error),
        None if runs > 0 => "censored".to_owned(),
        None => "-".to_owned(),
    }
}
