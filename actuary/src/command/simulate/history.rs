//! `actuary simulate history`: lives from new to failure, on disk.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::Result;
use clap::Args;
use ema::{
    lf2::Parameters,
    wear::{LifeHistory, Regime, simulate_life},
};
use pipeline::Progress;
use rayon::prelude::*;

use crate::{
    files::output::{Draft, OutputFolder},
    progress::Bar,
};

/// Write histories of fault vectors from new to failure, with their true failure times.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary simulate history --runs 100 --seed 7 --out histories")]
pub struct Arguments {
    /// Number of lives; constant and varying growth take turns.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// Seed.
    #[arg(long)]
    seed: u64,
    /// Folder for histories.csv and truth.csv: made if need be, files of these names are replaced.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Simulates and writes the lives.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = OutputFolder::new(&arguments.out)?;
    let parameters = Parameters::assessment();
    let bar = Bar::new();
    bar.stage("lives", arguments.runs as usize);
    let lives: Vec<LifeHistory> = (0..u64::from(arguments.runs))
        .into_par_iter()
        .map(|run| {
            let life = simulate_life(&parameters, arguments.seed, run, regime(run));
            bar.step();
            life
        })
        .collect();
    drop(bar);
    out.write(|draft| write(draft, &lives))?;
    println!("{} lives in {}", lives.len(), arguments.out.display());
    Ok(())
}

fn regime(run: u64) -> Regime {
    if run.is_multiple_of(2) { Regime::Constant } else { Regime::Varying }
}

/// `histories.csv` and `truth.csv`, as the file contract has them.
fn write(draft: &Draft, lives: &[LifeHistory]) -> io::Result<()> {
    draft.file("histories.csv", |writer| {
        writeln!(writer, "run_id,regime,t_fh,load,temp,k1,k2,k3,k4,k5")?;
        (0u64..).zip(lives).try_for_each(|(run, life)| write_history(writer, run, life))
    })?;
    draft.file("truth.csv", |writer| {
        writeln!(writer, "run_id,regime,t_failure_fh,n_obs,dominant_mode")?;
        (0u64..).zip(lives).try_for_each(|(run, life)| {
            let (failure, mode) = (life.t_failure_fh, life.law.dominant_mode);
            writeln!(writer, "{run},{},{failure},{},{mode}", regime(run).as_str(), life.t_fh.len())
        })
    })
}

fn write_history(writer: &mut dyn Write, run: u64, life: &LifeHistory) -> io::Result<()> {
    let regime = regime(run).as_str();
    for (i, t_fh) in life.t_fh.iter().enumerate() {
        write!(writer, "{run},{regime},{t_fh},{:.4},{:.4}", life.load[i], life.temperature[i])?;
        for k in life.observations[i].values() {
            write!(writer, ",{k:.5}")?;
        }
        writeln!(writer)?;
    }
    Ok(())
}
