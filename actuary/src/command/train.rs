//! `actuary train`: a model bundle from a motor's parameters and a seed, or from maps that somebody has.

mod chain;

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::Result;
use clap::Args;
use pipeline::{Model, SurrogateMetrics, TrainError, TrainSettings};

use crate::{
    exit::Failure,
    files::{dataset, motor, output::OutputFile},
    progress::Bar,
    say::say,
};

/// Train a model bundle: simulates maps, assessments and a fleet, and learns from them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  actuary train --out bundle.json --samples 1000 --seed 1
  actuary train --out bench.json --dataset bench/ --motor motor.json
  actuary train --out thesis.json --chain thesis

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
}

/// Trains and writes the bundle.
pub fn run(arguments: Arguments) -> Result<()> {
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
    let bytes = bundle.to_bytes();
    let model = Model::from_bytes(&bytes)?;
    out.write(|writer| writer.write_all(&bytes))?;
    report(&model, &arguments.out, started.elapsed().as_secs_f64());
    Ok(())
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
