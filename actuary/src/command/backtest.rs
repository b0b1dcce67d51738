//! `actuary backtest`: estimators of remaining life, fed with recorded lives as if they were being lived.

mod histories;
mod knowledge;
mod laws;
mod oddities;
mod predictions;

use std::{path::PathBuf, time::Instant};

use anyhow::Result;
use clap::{Args, ValueEnum};
use evaluation::{
    Contestant, Judged, Knowledge, Linear, Metrics, Ridge, Thesis, backtest::ReplaySettings, replay_all, report,
};
use indicatif::{ProgressBar, ProgressStyle};
use prognosis::{Climatology, FleetPrior, PredictionSettings, Rbg};

use self::histories::Files;
use crate::{
    exit::Failure,
    files::output::OutputFolder,
    say::{self, note, say},
};

const SEED: u64 = 1;
/// Judged where none is named.
const DEFAULT_ESTIMATORS: &[EstimatorName] = &[EstimatorName::Rbg, EstimatorName::Thesis];

/// Judge estimators of remaining life on recorded histories of fault vectors.
///
/// Each history is fed progressively: a prediction at t uses the observations up to t and nothing else.
/// Predictions are made at every multiple of --every that a history covers, and scored where --truth
/// tells the failure. Where nothing better is given, the model's surrogate says when life ends, its fleet
/// prior what is known of a new life, and the diagnosis error of the fleet that taught the prior
/// (0.0075 for shorts, 0.02 for eccentricity) is the noise of the histories.
#[derive(Debug, Args)]
#[command(after_help = "Files:
  histories    run_id,<any>,t_fh,load,temp,<fault names>; empty load or temp = not known; rows in any order
  truth        run_id,t_failure_fh; the n-th --truth belongs to the n-th --histories; a run that it does
               not tell of is predicted but not judged, one that is observed after its failure is refused
  growth       run_id,t_fh,growth; the n-th --growth belongs to the n-th --histories
  A column `regime` in either of the first two splits the metrics. The oracle reads A11,A12,... and
  B11,B12,... of truth, and the growth of growth, or 1 for a life of the regime `constant`; it leaves out
  the lives whose growth is not told. All other columns are ignored.

Example:
  actuary backtest --model models/default.json --histories histories.csv --truth truth.csv \\
    --estimator rbg --estimator thesis --out backtest")]
pub struct Arguments {
    /// The model bundle.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// Histories to predict; of several files, run_id becomes STEM/RUN_ID, after the stem of the file.
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    histories: Vec<PathBuf>,
    /// Their true failure times, for metrics.json and report.html.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    truth: Vec<PathBuf>,
    /// How the growth of each life changed, for --estimator oracle.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    growth: Vec<PathBuf>,
    /// An estimator to judge, repeated for several [default: rbg and thesis].
    #[arg(long = "estimator", value_name = "NAME", value_enum)]
    estimators: Vec<EstimatorName>,
    /// Draws of each prediction.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    draws: u32,
    /// Flight hours between predictions.
    #[arg(long, default_value_t = 200.0, value_name = "H", value_parser = hours)]
    every: f64,
    /// Remaining lives beyond are censored, flight hours.
    #[arg(long, default_value_t = 8000.0, value_name = "H", value_parser = hours)]
    horizon: f64,
    /// Train the surrogate on labelled fault vectors instead of taking the model's: fault columns, then
    /// figures, min_margin or label; several files are pooled. Without --prior the model's knowledge of
    /// its own surrogate's error is dropped with it.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    labels: Vec<PathBuf>,
    /// Learn the fleet prior, the noise of the histories and the error of the surrogate from these
    /// histories, each of which has to end with the observation at failure.
    #[arg(long, value_name = "FILE")]
    prior: Option<PathBuf>,
    /// Folder for predictions.csv and, with truth, metrics.json and report.html.
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
    /// How long earlier lives went on from the same age; needs --prior
    Climatology,
    /// The slope of the last 200 h goes on
    Linear,
    /// Rates and biases regressed with a pull towards those of the fleet
    Ridge,
    /// The bound: is told the law of each life by --truth and --growth
    Oracle,
}

/// Between a tenth of an hour and more than any life.
fn hours(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hours) if (0.1..=1e6).contains(&hours) => Ok(hours),
        _ => Err("not a number of hours from 0.1 to 1000000".to_owned()),
    }
}

/// Judges the estimators.
pub fn run(arguments: Arguments) -> Result<()> {
    let started = Instant::now();
    let out = OutputFolder::new(&arguments.out)?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template("{msg:<32} {wide_bar} {pos}/{len} {eta}").expect("a valid template"));
    bar.set_message("reading");
    let model = knowledge::read_model(&arguments.model)?;
    let names = chosen(&arguments, &model.bundle().prior)?;
    let files = Files {
        histories: &arguments.histories,
        truths: &arguments.truth,
        growths: &arguments.growth,
        laws: names.contains(&EstimatorName::Oracle),
    };
    let histories::Recordings { runs: mut recorded, mut notes } = histories::read_all(files, &model.bundle().faults)?;
    bar.set_message("learning");
    let growth_changes = names.contains(&EstimatorName::Rbg);
    let prior = arguments.prior.as_deref();
    let knowledge = knowledge::gather(&model, &arguments.labels, prior, growth_changes, SEED, &mut notes)?;
    for recorded in &mut recorded {
        knowledge.prepare(recorded);
    }
    let contestants: Vec<Contestant> = names.into_iter().map(|name| contestant(name, &knowledge)).collect();
    let settings = ReplaySettings {
        every_fh: arguments.every,
        prediction: PredictionSettings { draws: arguments.draws as usize, horizon_fh: arguments.horizon },
        seed: SEED,
    };
    bar.set_message("predicting");
    bar.set_length((recorded.len() * contestants.len()) as u64);
    let replays = replay_all(&recorded, &contestants, &settings, &|| bar.inc(1));
    bar.finish_and_clear();
    notes.iter().for_each(|line| note!("note: {line}"));
    write(&out, &arguments, &settings, &Judged { recorded: &recorded, replays: &replays, knowledge: &knowledge })?;
    say!("{} in {:.0} s", arguments.out.display(), started.elapsed().as_secs_f64());
    Ok(())
}

/// The estimators to judge in the order asked for, each once. Where nothing tells how growth changes, `rbg` is
/// `rbg-constant`.
fn chosen(arguments: &Arguments, prior: &FleetPrior) -> Result<Vec<EstimatorName>, Failure> {
    let asked = if arguments.estimators.is_empty() { DEFAULT_ESTIMATORS } else { &arguments.estimators };
    let may_change = prior.growth_changes.is_some() || arguments.prior.is_some();
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
fn contestant(name: EstimatorName, knowledge: &Knowledge) -> Contestant<'_> {
    let Knowledge { faults: model, surrogate: boundary, prior, changing_prior, lives_fh, .. } = knowledge;
    Contestant::Estimator(match name {
        EstimatorName::Rbg => {
            let prior = changing_prior.as_ref().expect("known or learned where it was asked for");
            Box::new(Rbg { model, prior, boundary })
        }
        EstimatorName::RbgConstant => Box::new(Rbg { model, prior, boundary }),
        EstimatorName::Thesis => Box::new(Thesis { model, boundary }),
        EstimatorName::Climatology => Box::new(Climatology { lives_fh: lives_fh.clone() }),
        EstimatorName::Linear => Box::new(Linear { model, prior, boundary }),
        EstimatorName::Ridge => Box::new(Ridge { model, prior, boundary }),
        EstimatorName::Oracle => return Contestant::Oracle(knowledge),
    })
}

fn write(out: &OutputFolder, arguments: &Arguments, settings: &ReplaySettings, judged: &Judged) -> Result<()> {
    let metrics = (!arguments.truth.is_empty()).then(|| Metrics::new(settings, judged));
    out.write(|draft| {
        draft.file("predictions.csv", |file| predictions::write(file, judged))?;
        let Some(metrics) = &metrics else { return Ok(()) };
        draft.file("metrics.json", |file| {
            serde_json::to_writer_pretty(&mut *file, metrics)?;
            file.write_all(b"\n")
        })?;
        draft.file("report.html", |file| file.write_all(report::page(metrics, judged).as_bytes()))
    })?;
    match &metrics {
        Some(metrics) => say::text(metrics.summary()),
        None => say!("{} runs predicted; without truth there is nothing to judge", judged.recorded.len()),
    }
    Ok(())
}

/// What is wrong with the files together.
fn refuse(reason: String) -> Failure {
    Failure::BadInput(reason)
}
