//! `actuary simulate history`: lives from new to failure, on disk.

mod flown;

use std::{
    io::{self, Write},
    num::NonZeroUsize,
    path::PathBuf,
};

use anyhow::Result;
use clap::{Args, ValueEnum};
use ema::{
    lf2::Parameters,
    life::{LifeHistory, simulate_life_of},
    scenario::Scenario,
    wear_law::{FAULTS, Regime},
};
use pipeline::Progress;
use rayon::prelude::*;
use simulator::Mission;

use super::PhysicsName;
use crate::{
    files::output::{Draft, OutputFolder},
    progress::Bar,
    say::say,
};

/// Columns of B: u = [1, load, temperature].
const INPUTS: usize = 3;

/// Write histories of fault vectors from new to failure, with their true failure times and laws.
///
/// truth.csv tells A and B of x' = g A x + B u + noise for each life, growth.csv when g changed.
///
/// With --missions, lives are flown: they wear at the pace of what their tails fly, every flight is measured as an aircraft does
/// and diagnosed by the model inside, and its load is read from the strain of the wing. histories.csv has what was estimated, the
/// load ratio of the motor, and true_load and true_temp; truth.csv the mission and the pace of each life.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary simulate history --runs 100 --seed 7 --out histories\n  \
actuary simulate history --runs 100 --seed 7 --scenario maintenance --out repaired
  \
actuary simulate history --runs 30 --seed 12 --missions short-haul,cruise,training --out flown")]
pub struct Arguments {
    /// Number of lives; constant and varying growth take turns.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// Seed.
    #[arg(long)]
    seed: u64,
    /// What is hard about the fleet.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = ScenarioName::Standard)]
    scenario: ScenarioName,
    /// Missions that the lives fly in turn (short-haul, cruise, training), separated by commas.
    #[arg(long, value_name = "MISSION", value_delimiter = ',', conflicts_with = "scenario")]
    missions: Vec<Mission>,
    /// What makes the samples of a flight.
    #[arg(long, value_enum, default_value_t = PhysicsName::Hf, requires = "missions")]
    physics: PhysicsName,
    /// Keep one flight of so many; that in which a life ends is always kept.
    #[arg(long, value_name = "N", default_value = "1", requires = "missions")]
    upload_every: NonZeroUsize,
    /// Folder for histories.csv, truth.csv and growth.csv: made if need be, files of these names are replaced.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// The scenarios, by name. Lives of one seed have the same law and luck in all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ScenarioName {
    /// Nothing: lives of 2000 to 6000 h like those that taught the default model
    Standard,
    /// Stretches of about 100 h without any record, and one flight in five lost
    MissingFlights,
    /// Diagnoses move away from the truth in proportion to time
    SensorDrift,
    /// The dominant fault is repaired once, between 600 and 1600 h
    Maintenance,
    /// Two dominant faults instead of one
    TwoFaults,
    /// The dominant fault sleeps until between 500 and 2500 h, jumps, and grows fast
    SuddenOnset,
    /// Damage grows with its power 3/2 instead of exponentially
    PowerLaw,
    /// Twice the process noise, twice the error of a diagnosis
    HeavyNoise,
}

impl From<ScenarioName> for Scenario {
    fn from(name: ScenarioName) -> Self {
        match name {
            ScenarioName::Standard => Self::Standard,
            ScenarioName::MissingFlights => Self::MissingFlights,
            ScenarioName::SensorDrift => Self::SensorDrift,
            ScenarioName::Maintenance => Self::Maintenance,
            ScenarioName::TwoFaults => Self::TwoFaults,
            ScenarioName::SuddenOnset => Self::SuddenOnset,
            ScenarioName::PowerLaw => Self::PowerLaw,
            ScenarioName::HeavyNoise => Self::HeavyNoise,
        }
    }
}

/// Simulates and writes the lives.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = OutputFolder::new(&arguments.out)?;
    if arguments.missions.is_empty() { draw(arguments, &out) } else { flown::run(arguments, &out) }
}

/// Lives of the standard fleet or of a scenario.
fn draw(arguments: &Arguments, out: &OutputFolder) -> Result<()> {
    let parameters = Parameters::assessment();
    let bar = Bar::new();
    bar.stage("lives", arguments.runs as usize);
    let lives: Vec<LifeHistory> = (0..u64::from(arguments.runs))
        .into_par_iter()
        .map(|run| {
            let life = simulate_life_of(arguments.scenario.into(), &parameters, arguments.seed, run, regime(run));
            bar.step();
            life
        })
        .collect();
    drop(bar);
    out.write(|draft| write(draft, &lives))?;
    say!("{} lives in {}", lives.len(), arguments.out.display());
    Ok(())
}

fn regime(run: u64) -> Regime {
    if run.is_multiple_of(2) { Regime::Constant } else { Regime::Varying }
}

/// `histories.csv`, `truth.csv` and `growth.csv`, as the file contract has them.
fn write(draft: &Draft, lives: &[LifeHistory]) -> io::Result<()> {
    draft.file("histories.csv", |writer| {
        writeln!(writer, "run_id,regime,t_fh,load,temp,k1,k2,k3,k4,k5")?;
        (0u64..).zip(lives).try_for_each(|(run, life)| write_history(writer, run, life))
    })?;
    draft.file("truth.csv", |writer| {
        write!(writer, "run_id,regime,t_failure_fh,n_obs,dominant_mode")?;
        let names =
            |letter, columns| (1..=FAULTS).flat_map(move |i| (1..=columns).map(move |j| format!(",{letter}{i}{j}")));
        names('A', FAULTS).chain(names('B', INPUTS)).try_for_each(|name| write!(writer, "{name}"))?;
        writeln!(writer)?;
        (0u64..).zip(lives).try_for_each(|(run, life)| write_truth(writer, run, life))
    })?;
    draft.file("growth.csv", |writer| {
        writeln!(writer, "run_id,t_fh,growth")?;
        let rows = (0u64..).zip(lives).flat_map(|(run, life)| life.law.growth.iter().map(move |row| (run, row, life)));
        let mut lived = rows.filter(|(_, (t_fh, _), life)| *t_fh <= life.t_failure_fh);
        lived.try_for_each(|(run, (t_fh, growth), _)| writeln!(writer, "{run},{t_fh},{growth}"))
    })
}

fn write_truth(writer: &mut dyn Write, run: u64, life: &LifeHistory) -> io::Result<()> {
    let LifeHistory { law, t_failure_fh, t_fh, .. } = life;
    write!(writer, "{run},{},{t_failure_fh},{},{}", regime(run).as_str(), t_fh.len(), law.dominant_mode)?;
    let entries = law.state_matrix.iter().flatten().chain(law.control_matrix.iter().flatten());
    entries.into_iter().try_for_each(|entry| write!(writer, ",{entry:e}"))?;
    writeln!(writer)
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
