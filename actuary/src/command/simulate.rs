//! `actuary simulate`: a fleet against a running service, and histories on disk.

use std::{
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use clap::{Args, Subcommand, ValueEnum};
use domain::Timestamp;
use ema::{
    lf2::Parameters,
    wear::{LifeHistory, Regime, simulate_life},
};
use indicatif::ProgressBar;
use rayon::prelude::*;
use simulator::{Client, Fleet, FleetError, FleetPlan, Physics};

use crate::{clock, exit::Failure, telemetry};

/// Simulate a fleet that uploads, or histories of lives.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Fleet(FleetArguments),
    History(HistoryArguments),
}

/// Fly a simulated fleet against a running service, as fast as it takes the uploads.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary simulate fleet --url http://127.0.0.1:8080 --tails 2 --truth truth.csv")]
struct FleetArguments {
    /// The service.
    #[arg(long)]
    url: String,
    /// Aircraft of the fleet.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=999))]
    tails: u32,
    /// Actuators of each.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=4))]
    positions: u32,
    /// Flight hours to fly after the back-filled past.
    #[arg(long, default_value_t = 200.0, allow_negative_numbers = true)]
    hours: f64,
    /// Seed of everything hidden.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// When the past ends (RFC 3339); the hours are flown before now without it.
    #[arg(long, value_name = "TIME")]
    start: Option<Timestamp>,
    /// What makes the samples.
    #[arg(long, value_enum, default_value_t = PhysicsName::Hf)]
    physics: PhysicsName,
    /// Where to write the hidden truth.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PhysicsName {
    /// The three-phase model.
    Hf,
    /// The closed form of the map, for load tests.
    ClosedForm,
}

/// Write histories of fault vectors from new to failure, with their true failure times.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary simulate history --runs 100 --seed 7 --out histories")]
struct HistoryArguments {
    /// Number of lives; constant and varying growth take turns.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// Seed.
    #[arg(long)]
    seed: u64,
    /// Folder for histories.csv and truth.csv.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Runs the simulation.
pub fn run(arguments: Arguments) -> Result<()> {
    match arguments.what {
        What::Fleet(arguments) => {
            telemetry::start();
            tokio::runtime::Runtime::new()?.block_on(fleet(arguments))
        }
        What::History(arguments) => history(&arguments),
    }
}

async fn fleet(arguments: FleetArguments) -> Result<()> {
    if !(0.0..=100_000.0).contains(&arguments.hours) {
        return Err(Failure::BadInput(format!("--hours {}: must be 0 to 100000", arguments.hours)).into());
    }
    let now = clock::system()();
    let start = arguments.start.unwrap_or(now.plus_hours(-24.0 / simulator::FH_PER_DAY * arguments.hours));
    let plan = FleetPlan {
        tails: arguments.tails as usize,
        positions: arguments.positions as usize,
        seed: arguments.seed,
        start,
        physics: match arguments.physics {
            PhysicsName::Hf => Physics::HighFidelity,
            PhysicsName::ClosedForm => Physics::ClosedForm,
        },
    };
    let mut fleet = Fleet::launch(plan, Client::new(&arguments.url).map_err(failure)?).await.map_err(failure)?;
    let flown = fleet.fly_until(arguments.hours).await.map_err(failure)?;
    if let Some(file) = &arguments.truth {
        let write = || simulator::write_truth(fleet.truth(), &mut BufWriter::new(File::create(file)?));
        write().with_context(|| format!("cannot write {}", file.display()))?;
    }
    println!("{} uploads accepted, {} known already", flown.accepted, flown.duplicates);
    Ok(())
}

fn failure(error: FleetError) -> anyhow::Error {
    let text = error.to_string();
    match error {
        FleetError::NotReachable { .. } => Failure::NotReachable(text).into(),
        FleetError::BadUrl { .. } | FleetError::BadPlan { .. } => Failure::BadInput(text).into(),
        other => other.into(),
    }
}

fn history(arguments: &HistoryArguments) -> Result<()> {
    let parameters = Parameters::assessment();
    let bar = ProgressBar::new(u64::from(arguments.runs));
    let lives: Vec<LifeHistory> = (0..u64::from(arguments.runs))
        .into_par_iter()
        .map(|run| {
            let life = simulate_life(&parameters, arguments.seed, run, regime(run));
            bar.inc(1);
            life
        })
        .collect();
    bar.finish_and_clear();
    write_histories(&arguments.out, &lives).with_context(|| format!("cannot write to {}", arguments.out.display()))?;
    println!("{} lives in {}", lives.len(), arguments.out.display());
    Ok(())
}

fn regime(run: u64) -> Regime {
    if run.is_multiple_of(2) { Regime::Constant } else { Regime::Varying }
}

/// `histories.csv` and `truth.csv`, as the file contract has them.
fn write_histories(folder: &Path, lives: &[LifeHistory]) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut histories = BufWriter::new(File::create(folder.join("histories.csv"))?);
    let mut truth = BufWriter::new(File::create(folder.join("truth.csv"))?);
    writeln!(histories, "run_id,regime,t_fh,load,temp,k1,k2,k3,k4,k5")?;
    writeln!(truth, "run_id,regime,t_failure_fh,n_obs,dominant_mode")?;
    for (run, life) in lives.iter().enumerate() {
        let regime = regime(run as u64).as_str();
        for (i, t_fh) in life.t_fh.iter().enumerate() {
            write!(histories, "{run},{regime},{t_fh},{:.4},{:.4}", life.load[i], life.temperature[i])?;
            for k in life.observations[i].values() {
                write!(histories, ",{k:.5}")?;
            }
            writeln!(histories)?;
        }
        let (failure, mode) = (life.t_failure_fh, life.law.dominant_mode);
        writeln!(truth, "{run},{regime},{failure},{},{mode}", life.t_fh.len())?;
    }
    histories.flush()?;
    truth.flush()
}
