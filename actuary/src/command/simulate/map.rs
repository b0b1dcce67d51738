//! `actuary simulate map`: a dataset folder of back-EMF maps under known faults.

use std::{f64::consts::TAU, path::PathBuf};

use anyhow::Result;
use clap::{Args, ValueEnum};
use domain::{FaultModel, FaultVector};
use ema::{
    commutation::BINS,
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map},
};
use numerics::Stream;
use pipeline::{Dataset, ImportanceSampling, Progress};
use rayon::prelude::*;

use super::ModelName;
use crate::{
    exit::Failure,
    files::{dataset, motor, output::OutputFolder},
    progress::Bar,
    say::say,
};

/// Simulated times of a map, s: a longer one where a shorter one misses a bin.
const DURATIONS_S: [f64; 3] = [2.0, 4.0, 8.0];

/// Write back-EMF maps under importance-sampled faults: a dataset folder for train and diagnose.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  actuary simulate map --out maps --samples 1000 --seed 1
  actuary simulate map --out bench --samples 100 --seed 2 --model hf

Writes theta.csv, K.csv, Y.csv, R.csv and r.csv.")]
pub struct Arguments {
    /// Folder to write: made if need be; files of these names are replaced, all others are kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of maps.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    samples: u32,
    /// Seed of faults and motions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// What makes the maps.
    #[arg(long, value_enum, default_value_t = ModelName::Lf1)]
    model: ModelName,
    /// How the actuator moves; without it random operation for hf, acquisition for the others.
    #[arg(long, value_enum)]
    motion: Option<Motion>,
    /// Where the faults are drawn from.
    #[arg(long, value_enum, default_value_t = Domain::Incipient)]
    faults: Domain,
    /// Parameters of the motor (JSON); the 48 V reference actuator without it.
    #[arg(long, value_name = "FILE")]
    motor: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Motion {
    /// One sine, 0.2 rad at 0.5 Hz, no load.
    Acquisition,
    /// Two random sines under a random load, with interference on the current.
    Operating,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Domain {
    /// Shorts and eccentricity up to a half, most of them small.
    Incipient,
    /// Up to 0.95.
    Full,
}

/// Simulates the maps and writes the folder.
pub fn run(arguments: &Arguments) -> Result<()> {
    let motor = motor::read(arguments.motor.as_deref())?;
    let out = OutputFolder::new(&arguments.out)?;
    let maps = maps(arguments, &motor)?;
    out.write(|draft| dataset::write(&maps, draft))?;
    say!("{} maps in {}", maps.maps.len(), arguments.out.display());
    Ok(())
}

fn maps(arguments: &Arguments, motor: &Motor) -> Result<Dataset, Failure> {
    let sampling = match arguments.faults {
        Domain::Incipient => ImportanceSampling::INCIPIENT,
        Domain::Full => ImportanceSampling::FULL,
    };
    let stream = |purpose| Stream::new(arguments.seed, &["simulate map", purpose]);
    let faults = sampling.draw(arguments.samples as usize, &mut stream("faults"));
    let motions = stream("motions");
    let manoeuvre = |index: usize| match (arguments.motion, arguments.model) {
        (Some(Motion::Operating), _) | (None, ModelName::Hf) => {
            Manoeuvre::operating(&mut motions.substream(index as u64))
        }
        _ => Manoeuvre::acquisition(),
    };
    let bar = Bar::new();
    bar.stage("maps", faults.len());
    let simulate = |(index, faults): (usize, &FaultVector)| {
        let map = simulate(arguments.model.into(), motor, faults, &manoeuvre(index));
        bar.step();
        map
    };
    let maps: Vec<Map> = faults.par_iter().enumerate().map(simulate).collect::<Result<_, _>>()?;
    Ok(Dataset {
        fault_names: FaultModel::electrical().names,
        angles_rad: (0..BINS).map(|bin| (bin as f64 + 0.5) * TAU / BINS as f64).collect(),
        faults,
        load_ratios: Some(maps.iter().map(|map| map.load_ratios.clone()).collect()),
        mean_load_ratios: Some(maps.iter().map(|map| map.mean_load_ratio).collect()),
        maps: maps.into_iter().map(|map| map.y_v_s_rad).collect(),
        labels: None,
    })
}

/// A map without gaps.
struct Map {
    y_v_s_rad: Vec<f64>,
    load_ratios: Vec<f64>,
    mean_load_ratio: f64,
}

fn simulate(model: Model, motor: &Motor, faults: &FaultVector, manoeuvre: &Manoeuvre) -> Result<Map, Failure> {
    let electrical = ElectricalFaults::try_from(faults).expect("importance samples are faults");
    let whole = |duration_s: &f64| {
        let map = simulate_map(model, motor, &electrical, manoeuvre, &Settings::new(model, *duration_s));
        let k_nom = motor.back_emf_v_s_rad;
        Some(Map {
            y_v_s_rad: map.y.iter().map(|y| y.map(|y| y * k_nom)).collect::<Option<_>>()?,
            load_ratios: map.r.into_iter().collect::<Option<_>>()?,
            mean_load_ratio: map.mean_r?,
        })
    };
    DURATIONS_S.iter().find_map(whole).ok_or_else(|| {
        let reason = "the motor did not pass every bin of the map fast enough";
        Failure::BadInput(format!("{reason}, under faults {:?}", faults.values()))
    })
}
