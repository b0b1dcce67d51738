//! `actuary train`: a model bundle from nothing but a motor's parameters and a seed.

use std::{fs, path::PathBuf, time::Instant};

use anyhow::{Context, Result};
use clap::Args;
use ema::motor::Motor;
use indicatif::{ProgressBar, ProgressStyle};
use pipeline::{ChainSettings, Model, Progress, TrainError, TrainSettings};

use crate::exit::Failure;

/// Train a model bundle from nothing: simulates maps, assessments and a fleet, and learns from them.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary train --out bundle.json --samples 1000 --seed 1")]
pub struct Arguments {
    /// The bundle to write; nothing is written unless training succeeds.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
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
}

/// Trains and writes the bundle.
pub fn run(arguments: Arguments) -> Result<()> {
    let motor = match &arguments.motor {
        None => Motor::default(),
        Some(file) => read_motor(file)?,
    };
    let settings = TrainSettings {
        motor,
        samples: arguments.samples as usize,
        lives: arguments.lives as usize,
        seed: arguments.seed,
        chain: ChainSettings::default(),
    };
    let started = Instant::now();
    let bar = Bar::new();
    let bundle = pipeline::train(&settings, None, &bar).map_err(|error| match error {
        TrainError::Motor(_) | TrainError::Unfit { .. } | TrainError::Incomplete { .. } => {
            Failure::BadInput(error.to_string()).into()
        }
        other => anyhow::Error::from(other),
    })?;
    bar.0.finish_and_clear();
    let bytes = bundle.to_bytes();
    let model = Model::from_bytes(&bytes)?;
    write_whole(&arguments.out, &bytes)?;
    report(&model, &arguments.out, started.elapsed().as_secs_f64());
    Ok(())
}

fn read_motor(file: &PathBuf) -> Result<Motor, Failure> {
    let refuse = |reason: String| Failure::BadInput(format!("{}: {reason}", file.display()));
    let text = fs::read(file).map_err(|error| refuse(error.to_string()))?;
    let motor: Motor = serde_json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
    motor.check().map_err(|invalid| refuse(invalid.to_string()))?;
    Ok(motor)
}

/// Writes beside the file and renames, so that nobody ever sees half of it.
fn write_whole(file: &PathBuf, bytes: &[u8]) -> Result<()> {
    let beside = file.with_extension("part");
    fs::write(&beside, bytes)
        .and_then(|()| fs::rename(&beside, file))
        .with_context(|| format!("cannot write {}", file.display()))
}

fn report(model: &Model, out: &std::path::Path, seconds: f64) {
    let metrics = &model.bundle().metrics;
    let percent = |name: &str, v: &pipeline::Validation| {
        println!("  {name:<24} {:5.2} {:5.2} {:5.2}", 100.0 * v.median, 100.0 * v.mean, 100.0 * v.p95);
    };
    println!("{} in {seconds:.0} s", out.display());
    println!("bundle {}", model.summary().hash);
    println!("diagnosis of {} unseen maps, err_k in % (median mean p95):", metrics.diagnosis.maps);
    percent("load ratio per sample", &metrics.diagnosis.load_ratio_per_sample);
    percent("mean load ratio", &metrics.diagnosis.mean_load_ratio);
    percent("no load ratio", &metrics.diagnosis.no_load_ratio);
    println!("surrogate on {} unseen samples, % (accuracy missed false):", metrics.surrogate.samples);
    for (name, quality) in [
        ("regression per figure", &metrics.surrogate.figure_regression),
        ("support vector machine", &metrics.surrogate.svm),
    ] {
        let shares = [quality.accuracy, quality.missed_share, quality.false_share].map(|share| 100.0 * share);
        println!("  {name:<24} {:5.2} {:5.2} {:5.2}", shares[0], shares[1], shares[2]);
    }
}

/// One bar per stage, on standard error.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let style = ProgressStyle::with_template("{msg:<32} {wide_bar} {pos}/{len} {eta}").expect("a valid template");
        Self(ProgressBar::new(0).with_style(style))
    }
}

impl Progress for Bar {
    fn stage(&self, name: &'static str, steps: usize) {
        self.0.reset();
        self.0.set_length(steps as u64);
        self.0.set_message(name);
    }

    fn step(&self) {
        self.0.inc(1);
    }
}
