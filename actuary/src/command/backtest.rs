//! `actuary backtest`: estimators of remaining life, fed with recorded lives as if they were being lived.

mod knowledge;
mod learned;
mod predictions;
mod recorded;

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::Result;
use clap::{Args, ValueEnum};
use evaluation::{
    Contestant, Judged, Knowledge, Linear, Metrics, Ridge, Terms, Thesis, backtest::ReplaySettings, replay_all, report,
};
use indicatif::{ProgressBar, ProgressStyle};
use prognosis::{Climatology, Estimator, LifePrior, Paced, PredictionSettings, Rbg};
use serde::Serialize;

use crate::{
    exit::Failure,
    files::{
        bundle,
        histories::{self, Files},
        output::OutputFolder,
        plans, records, stress,
    },
    say::{self, note, say},
};

const SEED: u64 = 1;
/// Judged where none is named.
const DEFAULT_ESTIMATORS: &[EstimatorName] = &[EstimatorName::Rbg, EstimatorName::Thesis];
/// Flight hours between predictions of actuators, and their horizon.
const EVERY_FH: f64 = 200.0;
const HORIZON_FH: f64 = 8000.0;

/// Judge estimators of remaining life on recorded lives.
///
/// Each life is fed progressively: a prediction at t uses the observations up to t and nothing else.
/// Predictions are made at every multiple of --every that a life covers, and scored where its failure is known.
///
/// With --limit, lives are those of any unit: --limit names the columns that tell its damage, a life fails when one of them first
/// passes its limit, all is learned from the lives of --prior, or from half of the histories, and everything is told
/// in the unit of the time column.
///
/// With --model, histories are fault vectors of actuators, and --truth tells the failures. Where nothing better is given,
/// the model's surrogate says when life ends, its fleet prior what is known of a new life, and the diagnosis error of the
/// fleet that taught the prior (0.0075 for shorts, 0.02 for eccentricity) is the noise of the histories.
#[derive(Debug, Args)]
#[command(
    after_help = "Files with --limit: one row per unit and time, in any order; a column of times, one that names the unit, one per
  limit, others as they come. The first of several units teaches, the second is judged, and so on, unless --prior or --split tells
  otherwise.

Files with --model:
  histories    run_id,<any>,t_fh,load,temp,<fault names>; empty load or temp = not known; rows in any order
  truth        run_id,t_failure_fh; the n-th --truth belongs to the n-th --histories; a run that it does
               not tell of is predicted but not judged, one that is observed after its failure is refused
  growth       run_id,t_fh,growth; the n-th --growth belongs to the n-th --histories
  A column `regime` in either of the first two splits the metrics. The oracle reads A11,A12,... and
  B11,B12,... of truth, and the growth of growth, or 1 for a life of the regime `constant`; it leaves out
  the lives whose growth is not told. All other columns are ignored.

Examples:
  actuary backtest --histories virkler.csv --limit crack_mm=49.8 --out cracks
  actuary backtest --histories cells.csv --limit capacity_ah=-18% --nominal capacity_ah=first:5 --out cells
  actuary backtest --model models/default.json --histories histories.csv --truth truth.csv \\
    --estimator rbg --estimator thesis --out backtest"
)]
pub struct Arguments {
    /// The model bundle, for lives of actuators.
    #[arg(long, value_name = "FILE", conflicts_with = "limits")]
    model: Option<PathBuf>,
    /// Lives to predict; of several files, the name of a unit becomes STEM/NAME, after the stem of the file.
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    histories: Vec<PathBuf>,
    #[command(flatten)]
    records: records::Flags,
    #[command(flatten)]
    stress: stress::Flags,
    /// With --model, what the judged lives will fly: run_id,from_fh,load,temp; a life that it does not tell of goes on as it may.
    #[arg(long, value_name = "FILE", conflicts_with = "limits")]
    plan: Option<PathBuf>,
    /// Without --prior, the first N units teach and the others are judged [default: the first, third, fifth... teach].
    #[arg(long, value_name = "N", conflicts_with = "prior")]
    split: Option<std::num::NonZeroUsize>,
    /// With --model, the true failure times, for metrics.json and report.html.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "limits")]
    truth: Vec<PathBuf>,
    /// How the growth of each life changed, for --estimator oracle.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "limits")]
    growth: Vec<PathBuf>,
    /// An estimator to judge, repeated for several [default: rbg and thesis with --model; mixture and each of
    /// its members with --limit].
    #[arg(long = "estimator", value_name = "NAME", value_enum)]
    estimators: Vec<EstimatorName>,
    /// Draws of each prediction.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    draws: u32,
    /// Time between predictions, in the unit of times [default: 200 h with --model, a twenty-fifth of a characteristic life with
    /// --limit].
    #[arg(long, value_name = "TIME", value_parser = duration)]
    every: Option<f64>,
    /// Remaining lives beyond are censored [default: 8000 h with --model, two characteristic lives with --limit].
    #[arg(long, value_name = "TIME", value_parser = duration)]
    horizon: Option<f64>,
    /// Train the surrogate on labelled fault vectors instead of taking the model's: fault columns, then
    /// figures, min_margin or label; several files are pooled. Without --prior the model's knowledge of
    /// its own surrogate's error is dropped with it.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "limits")]
    labels: Vec<PathBuf>,
    /// Learn from these lives. With --model, each has to end with the observation at failure, and they teach the fleet prior,
    /// the noise of the histories and the error of the surrogate.
    #[arg(long, value_name = "FILE")]
    prior: Option<PathBuf>,
    /// Folder for predictions.csv and, where failures are known, metrics.json and report.html.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// The estimators, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EstimatorName {
    /// The default: growth-rate filter with a fleet prior, for growth that may change in mid-life
    #[value(alias = "default")]
    Rbg,
    /// The same for growth that never changes
    #[value(alias = "rbg_constant")]
    RbgConstant,
    /// Berri 2021, section 2.4, as it stands there
    Thesis,
    /// The default with --limit: growth, similarity and climatology, each as much as it was worth on earlier lives; with --model
    /// as the lives that taught its prior tell
    Mixture,
    /// Growth filters in the measures of damage that explain the earlier lives best
    Growth,
    /// How long earlier lives went on from the same level of damage
    Similarity,
    /// How long earlier lives went on from the same age; needs --prior with --model
    Climatology,
    /// Mixed-effects model of exponential growth; only judges, with --limit
    MixedExponential,
    /// The same with errors that go on as a Brownian motion; only judges, with --limit
    MixedBrownian,
    /// Mixed-effects model of growth along a parabola; only judges, with --limit
    MixedPolynomial,
    /// The slope of the last 200 h goes on
    Linear,
    /// Rates and biases regressed with a pull towards those of the fleet
    Ridge,
    /// The bound: is told the law of each life by --truth and --growth
    Oracle,
}

impl EstimatorName {
    /// Whether it is for lives of any unit alone.
    fn needs_limits(self) -> bool {
        use EstimatorName::{Growth, MixedBrownian, MixedExponential, MixedPolynomial, Similarity};
        matches!(self, Growth | Similarity | MixedExponential | MixedBrownian | MixedPolynomial)
    }
}

fn duration(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if time > 0.0 && time.is_finite() => Ok(time),
        _ => Err("not a number above zero".to_owned()),
    }
}

/// Between a tenth of an hour and more than any life.
fn hours(told: Option<f64>, otherwise: f64, flag: &str) -> Result<f64, Failure> {
    match told.unwrap_or(otherwise) {
        hours if (0.1..=1e6).contains(&hours) => Ok(hours),
        hours => Err(refuse(format!("{flag} {hours}: not a number of hours from 0.1 to 1000000"))),
    }
}

/// Judges the estimators.
pub fn run(arguments: Arguments) -> Result<()> {
    let started = Instant::now();
    let out = OutputFolder::new(&arguments.out)?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template("{msg:<32} {wide_bar} {pos}/{len} {eta}").expect("a valid template"));
    bar.set_message("reading");
    let flag = arguments.records.without_limits().or(arguments.split.and(Some("--split")));
    if arguments.plan.is_some() && !arguments.stress.act() {
        return Err(refuse("--plan tells loads and temperatures: tell --load or --temperature, too".to_owned()).into());
    }
    if let Some(flag) = flag.filter(|_| arguments.records.limits.is_empty()) {
        return Err(refuse(format!("{flag} is for lives with --limit")).into());
    }
    match &arguments.model {
        _ if !arguments.records.limits.is_empty() => recorded::run(&arguments, &out, &bar)?,
        Some(model) => actuators(&arguments, model, &out, &bar)?,
        None => {
            let reason =
                "what is failure? tell --limit NAME=VALUE for each column of damage, or --model FILE for actuators";
            return Err(refuse(reason.to_owned()).into());
        }
    }
    say!("{} in {:.0} s", arguments.out.display(), started.elapsed().as_secs_f64());
    Ok(())
}

/// Judges the estimators on lives of actuators.
fn actuators(arguments: &Arguments, model: &Path, out: &OutputFolder, bar: &ProgressBar) -> Result<()> {
    let settings = ReplaySettings {
        every_fh: hours(arguments.every, EVERY_FH, "--every")?,
        prediction: PredictionSettings {
            draws: arguments.draws as usize,
            horizon_fh: hours(arguments.horizon, HORIZON_FH, "--horizon")?,
        },
        seed: SEED,
    };
    let model = bundle::read(model)?;
    let names = chosen(arguments, &model.bundle().prior)?;
    let files = Files {
        histories: &arguments.histories,
        truths: &arguments.truth,
        growths: &arguments.growth,
        laws: names.contains(&EstimatorName::Oracle),
        stress: &arguments.stress,
    };
    let histories::Recordings { runs: mut recorded, mut notes } = histories::read_all(files, &model.bundle().faults)?;
    bar.set_message("learning");
    let growth_changes = names.contains(&EstimatorName::Rbg);
    let teach = knowledge::Teach {
        labels: &arguments.labels,
        prior: arguments.prior.as_deref(),
        stress: &arguments.stress,
        growth_changes,
    };
    let knowledge = knowledge::gather(&model, &teach, SEED, &mut notes)?;
    let mut plans = arguments
        .plan
        .as_deref()
        .map_or_else(|| Ok(plans::Plans::new()), |file| plans::read(file, &arguments.stress))?;
    for recorded in &mut recorded {
        knowledge.prepare(recorded);
        recorded.plan = plans.remove(&recorded.run.id).unwrap_or_default();
    }
    let contestants: Vec<Contestant> =
        names.into_iter().map(|name| contestant(name, &knowledge, &model.bundle().prior)).collect();
    bar.set_message("predicting");
    bar.set_length((recorded.len() * contestants.len()) as u64);
    let replays = replay_all(&recorded, &contestants, &settings, &|| bar.inc(1));
    bar.finish_and_clear();
    notes.iter().for_each(|line| note!("note: {line}"));
    let judged = Judged {
        recorded: &recorded,
        replays: &replays,
        faults: &knowledge.faults,
        sigma: &knowledge.sigma,
        failure_time_error: knowledge.prior.failure_time_error,
        terms: &Terms::actuators(),
    };
    let metrics = (!arguments.truth.is_empty()).then(|| Metrics::new(&settings, &judged));
    write(out, &judged, metrics.as_ref(), &metrics)
}

/// The estimators to judge in the order asked for, each once. Where nothing tells how growth changes, `rbg` is
/// `rbg-constant`.
fn chosen(arguments: &Arguments, prior: &LifePrior) -> Result<Vec<EstimatorName>, Failure> {
    let asked = if arguments.estimators.is_empty() { DEFAULT_ESTIMATORS } else { &arguments.estimators };
    let may_change = prior.first().growth_changes.is_some() || arguments.prior.is_some();
    let mut names = Vec::new();
    for name in asked {
        let name = if *name == EstimatorName::Rbg && !may_change { EstimatorName::RbgConstant } else { *name };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let asked = |name| names.contains(&name);
    let refused = match arguments {
        Arguments { prior: None, .. } if asked(EstimatorName::Climatology) => {
            Some("--estimator climatology needs the lives of --prior")
        }
        _ if names.iter().any(|name| name.needs_limits()) => {
            Some("--estimator growth, similarity and those named mixed-... need --limit")
        }
        _ if asked(EstimatorName::Mixture) && prior.companions.is_none() => Some(
            "--estimator mixture needs --limit, or a model whose prior knows more than growth: `actuary train --histories` \
             makes one",
        ),
        Arguments { prior, labels, .. } if asked(EstimatorName::Mixture) && (prior.is_some() || !labels.is_empty()) => {
            Some("--estimator mixture is the model's own: --prior and --labels do not teach it")
        }
        Arguments { prior: None, stress, .. } if stress.act() => {
            Some("--load and --temperature need the lives of --prior, which teach what they do")
        }
        Arguments { stress, .. } if asked(EstimatorName::Oracle) && stress.act() => {
            Some("--estimator oracle is told the law of each life: --load and --temperature do not teach it")
        }
        Arguments { truth, .. } if asked(EstimatorName::Oracle) && truth.is_empty() => {
            Some("--estimator oracle needs --truth with A and B of each life")
        }
        Arguments { growth, .. } if !asked(EstimatorName::Oracle) && !growth.is_empty() => {
            Some("--growth is for --estimator oracle alone")
        }
        _ => None,
    };
    refused.map_or(Ok(names), |reason| Err(refuse(reason.to_owned())))
}

/// An estimator by its name, with what it may know.
fn contestant<'a>(name: EstimatorName, knowledge: &'a Knowledge, own: &'a LifePrior) -> Contestant<'a> {
    let Knowledge { faults: model, surrogate: boundary, prior, changing_prior, lives_fh, pace, .. } = knowledge;
    let estimator: Box<dyn Estimator> = match name {
        EstimatorName::Rbg => {
            let prior = changing_prior.as_ref().expect("known or learned where it was asked for");
            Box::new(Rbg { model, prior, boundary })
        }
        EstimatorName::RbgConstant => Box::new(Rbg { model, prior, boundary }),
        EstimatorName::Thesis => return Contestant::Estimator(Box::new(Thesis { model, boundary })),
        EstimatorName::Climatology => Box::new(Climatology::of_failures(lives_fh).expect("the lives of --prior")),
        EstimatorName::Linear => Box::new(Linear { model, prior, boundary }),
        EstimatorName::Ridge => Box::new(Ridge { model, prior, boundary }),
        EstimatorName::Oracle => return Contestant::Oracle(knowledge),
        EstimatorName::Mixture => {
            let companions = own.companions.as_ref().expect("refused before");
            Box::new(companions.beside(&own.growth, model, boundary))
        }
        _ => unreachable!("refused before"),
    };
    match pace {
        Some(law) => Contestant::Paced(Paced { law, inner: estimator }),
        None => Contestant::Estimator(estimator),
    }
}

/// The files, and the figures in words; `file` is what is kept of the metrics.
fn write(out: &OutputFolder, judged: &Judged, metrics: Option<&Metrics>, file: &impl Serialize) -> Result<()> {
    out.write(|draft| {
        draft.file("predictions.csv", |file| predictions::write(file, judged))?;
        let Some(metrics) = metrics else { return Ok(()) };
        draft.file("metrics.json", |writer| {
            serde_json::to_writer_pretty(&mut *writer, file)?;
            writer.write_all(b"\n")
        })?;
        draft.file("report.html", |file| file.write_all(report::page(metrics, judged).as_bytes()))
    })?;
    match metrics {
        Some(metrics) => say::text(metrics.summary(&judged.terms.time)),
        None if judged.terms.actuators => {
            say!("{} runs predicted; without truth there is nothing to judge", judged.recorded.len());
        }
        None => {
            say!("{} units predicted; none of them has failed, so there is nothing to judge", judged.recorded.len())
        }
    }
    Ok(())
}

/// What an estimator is called on the command line.
fn called(name: EstimatorName) -> String {
    name.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// What is wrong with the files together.
fn refuse(reason: String) -> Failure {
    Failure::BadInput(reason)
}
