//! `actuary train`: a model bundle from a motor's parameters and a seed, from maps that somebody has, or from recorded lives.

mod chain;
mod fleet;
mod own_faults;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, Result};
use clap::Args;
use domain::ContentHash;
use pipeline::{Bundle, Model, SurrogateMetrics, TrainError, TrainSettings};
use prognosis::Companions;

use crate::{
    exit::Failure,
    files::{dataset, motor, output::OutputFile, records, stress},
    progress::Bar,
    say::say,
};

/// Train a model bundle: simulates maps, assessments and a fleet, and learns from them; or learns from recorded lives.
///
/// With --histories and --limit, lives are those of a fleet that diagnoses itself: the columns of --limit are its faults, and the bundle
/// serves uploads that bring them. Times are flight hours, as those of uploads will be. Of --model stays how loads are read.
///
/// With --histories alone, lives are those of actuators whose faults --model diagnoses, and teach its prior; all else of it stays.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  actuary train --out bundle.json --samples 1000 --seed 1
  actuary train --out bench.json --dataset bench/ --motor motor.json
  actuary train --out thesis.json --chain thesis
  actuary train --out cracks.json --histories cracks.csv --limit crack_mm=49.8 --model models/default.json
  actuary train --out fleet.json --histories histories.csv --truth truth.csv --model models/default.json

The chain of the thesis: thesis form of LF1, SOM mask, least squares, raw map, training without noise.

A dataset is a folder of CSV files:
  theta.csv    header theta_rad; the centres of the bins of a map over one turn, rad
  K.csv        header = names of the faults; a fault vector a row, each fault in 0 to 1
  Y.csv        no header; a map a row: back-EMF coefficient of each bin, V s/rad
  R.csv        no header; load ratio r = R i/(k w) of each bin, like Y.csv (optional)
  r.csv        header r; mean load ratio of each map (optional, used without R.csv)
  labels.csv   fault columns and label (healthy|faulty), or min_margin, or the figures of merit (optional)")]
pub struct Arguments {
    /// The bundle to write; nothing is written unless training succeeds.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Maps of known faults to learn the diagnosis from, some held out to calibrate and to judge;
    /// simulated ones without it.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Importance samples of the fault vector.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(50..=100_000))]
    samples: u32,
    /// Lives of the simulated fleet that teaches the prior.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(10..=10_000))]
    lives: u32,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Parameters of the motor (JSON); the 48 V reference actuator without it.
    #[arg(long, value_name = "FILE")]
    motor: Option<PathBuf>,
    #[command(flatten)]
    chain: chain::ChainArguments,
    /// Learn from these lives, whose columns are those of actuary backtest; all of them teach.
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "model", help_heading = RECORDED, conflicts_with_all = SIMULATED)]
    histories: Vec<PathBuf>,
    /// The bundle that gives what these lives do not teach.
    #[arg(long, value_name = "FILE", requires = "histories", help_heading = RECORDED)]
    model: Option<PathBuf>,
    /// Without --limit, the true failure times, the n-th file for the n-th histories: a run that it does not tell of was removed
    /// before it failed [default: each run fails at its last row].
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "histories", conflicts_with = "limits", help_heading = RECORDED)]
    truth: Vec<PathBuf>,
    #[command(flatten, next_help_heading = RECORDED)]
    records: records::Flags,
    #[command(flatten, next_help_heading = RECORDED)]
    stress: stress::Flags,
}

const RECORDED: &str = "Recorded lives";
/// What only a training by simulation or by maps asks for.
const SIMULATED: [&str; 13] = [
    "dataset",
    "samples",
    "lives",
    "seed",
    "motor",
    "chain",
    "lf1",
    "mask",
    "gappy",
    "modes",
    "hidden",
    "noise_training",
    "map",
];

/// Trains and writes the bundle.
pub fn run(arguments: Arguments) -> Result<()> {
    let told = arguments.records.without_limits().or((!arguments.records.limits.is_empty()).then_some("--limit"));
    match (&arguments.model, told, arguments.records.limits.is_empty()) {
        (None, Some(flag), _) => Err(refuse(format!("{flag} is for lives of --histories")).into()),
        (None, None, _) if arguments.stress.act() => {
            Err(refuse("--load and --temperature are for lives of --histories".to_owned()).into())
        }
        (None, None, _) => from_maps(arguments),
        (Some(_), Some(flag), true) => Err(refuse(format!("{flag} is for lives with --limit")).into()),
        (Some(base), _, false) => own_faults::run(base, &arguments),
        (Some(base), _, true) => fleet::run(base, &arguments),
    }
}

/// What is wrong with the files together.
fn refuse(reason: String) -> Failure {
    Failure::BadInput(reason)
}

/// Trains on maps, simulated or recorded, and writes the bundle.
fn from_maps(arguments: Arguments) -> Result<()> {
    let settings = TrainSettings {
        motor: motor::read(arguments.motor.as_deref())?,
        samples: arguments.samples as usize,
        lives: arguments.lives as usize,
        seed: arguments.seed,
        chain: arguments.chain.settings(),
    };
    let dataset = arguments.dataset.as_deref().map(dataset::read).transpose()?;
    let out = OutputFile::new(&arguments.out)?;
    let started = Instant::now();
    let bundle = pipeline::train(&settings, dataset.as_ref(), &Bar::new())
        .map_err(|error| refused(error, arguments.dataset.as_deref()))?;
    let model = write(&bundle, &out, |_| Ok(()))?;
    report(&model, &arguments.out, started.elapsed().as_secs_f64());
    Ok(())
}

/// Writes a bundle that can be read and that passes a check.
fn write(bundle: &Bundle, out: &OutputFile, check: impl FnOnce(&Model) -> Result<()>) -> Result<Model> {
    let bytes = bundle.to_bytes();
    let model = Model::from_bytes(&bytes)?;
    check(&model)?;
    out.write(|writer| writer.write_all(&bytes))?;
    Ok(model)
}

/// Writes a bundle that recorded lives have taught, if it can be served.
fn write_taught(bundle: &Bundle, out: &OutputFile) -> Result<Model> {
    write(bundle, out, |model| {
        let served = model.rehearse();
        Ok(served.map_err(|error| refuse(format!("what these lives teach cannot be served: {error}")))?)
    })
}

/// What the files of recorded lives hold.
fn content(files: &[PathBuf]) -> Result<ContentHash> {
    let bytes = files.iter().map(|file| fs::read(file).with_context(|| file.display().to_string()));
    let bytes: Vec<Vec<u8>> = bytes.collect::<Result<_>>()?;
    Ok(ContentHash::of_parts(bytes.iter().map(Vec::as_slice)))
}

/// Training is a pure function of what the user gave: nearly all that can go wrong is in that.
fn refused(error: TrainError, dataset: Option<&Path>) -> anyhow::Error {
    match (error, dataset) {
        (error @ TrainError::Prior(_), _) => error.into(),
        (TrainError::Dataset(error), Some(folder)) => {
            Failure::BadInput(format!("{}: {error}", folder.display())).into()
        }
        (error, _) => Failure::BadInput(error.to_string()).into(),
    }
}

fn report(model: &Model, out: &Path, seconds: f64) {
    let metrics = &model.bundle().maps().expect("trained on maps").metrics;
    let percent = |name: &str, v: &pipeline::Validation| {
        say!("  {name:<24} {:5.2} {:5.2} {:5.2}", 100.0 * v.median, 100.0 * v.mean, 100.0 * v.p95);
    };
    say!("{} in {seconds:.0} s", out.display());
    say!("bundle {}", model.summary().hash);
    say!("diagnosis of {} unseen maps, err_k in % (median mean p95):", metrics.diagnosis.maps);
    percent("load ratio per sample", &metrics.diagnosis.load_ratio_per_sample);
    percent("mean load ratio", &metrics.diagnosis.mean_load_ratio);
    percent("no load ratio", &metrics.diagnosis.no_load_ratio);
    print_surrogates(&metrics.surrogate);
}

fn print_surrogates(metrics: &SurrogateMetrics) {
    say!("surrogate on {} unseen samples, % (accuracy missed false);", metrics.samples);
    say!("  its failure times of unseen lives, h (spread mean), smaller spread chosen:");
    let judged = [
        ("regression per figure", metrics.figure_regression, metrics.figure_regression_failure_time),
        ("support vector machine", Some(metrics.svm), metrics.svm_failure_time),
    ];
    for (name, quality, failure_time) in judged {
        let Some(quality) = quality else { continue };
        let shares = [quality.accuracy, quality.missed_share, quality.false_share].map(|share| 100.0 * share);
        let times = failure_time.map(|it| format!("{:7.0} {:+7.0}", it.sd_fh, it.offset_fh)).unwrap_or_default();
        say!("  {name:<24} {:5.2} {:5.2} {:5.2} {times}", shares[0], shares[1], shares[2]);
    }
}

/// Members of a mixture, in the order of their weights.
const MEMBERS: [&str; 3] = ["growth", "similarity", "climatology"];

/// How much each member is believed, and how forecasts of lives held out did, in hours told by `hours`.
fn report_companions(companions: &Companions, hours: &dyn Fn(f64) -> f64) {
    let stacked = &companions.stacked;
    let of_members = |figures: &[f64], digits: usize| {
        let told = MEMBERS.iter().zip(figures).map(|(name, figure)| format!("{name} {figure:.digits$}"));
        told.collect::<Vec<_>>().join(", ")
    };
    say!("weights: {}", of_members(&stacked.weights, 2));
    let Some(record) = &stacked.record else {
        say!("no forecast of a life held out could be made");
        return;
    };
    let members: Vec<f64> = record.members_crps_fh.iter().map(|fh| hours(*fh)).collect();
    say!(
        "{} forecasts of {} lives held out: CRPS {:.0} h ({}); 80 % intervals held {:.0} %",
        record.forecasts,
        record.lives,
        hours(record.crps_fh),
        of_members(&members, 0),
        100.0 * record.level_80
    );
}
