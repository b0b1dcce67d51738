//! Lives that fly missions, told as a service would hear of them: faults as the model inside diagnoses them of each upload, the
//! load as the strain of the wing tells it; and what is hidden.

use std::io::{self, Write};

use anyhow::{Context, Result};
use domain::{Estimate, FaultVector, Mask, Outcome};
use pipeline::{Model, Progress, motor_ratio};
use rayon::prelude::*;
use simulator::{FleetPlan, LifeFlight, Lives, Mission, Pace, Surroundings, Upkeep};

use super::{Arguments, regime};
use crate::{
    default_model,
    exit::Failure,
    files::output::{Draft, OutputFolder},
    progress::Bar,
    say::say,
};

/// When the fleet's future begins; nothing depends on it.
const START: &str = "2026-01-01T00:00:00Z";

/// A life as it is written.
struct Life {
    mission: Option<Mission>,
    /// Flight hours and damage-equivalent hours of the flight in which it failed.
    failure_fh: f64,
    equivalent_h: f64,
    rows: Vec<Row>,
}

/// What is told of a flight.
struct Row {
    t_fh: f64,
    load: Option<f64>,
    temperature: Option<f64>,
    load_ratio: Option<f64>,
    faults: FaultVector,
    hidden: Surroundings,
}

/// Flies, diagnoses and writes the lives.
pub fn run(arguments: &Arguments, out: &OutputFolder) -> Result<()> {
    if arguments.runs > 999 {
        let reason = format!("--runs {}: at most 999 lives fly --missions", arguments.runs);
        return Err(Failure::BadInput(reason).into());
    }
    let model = default_model::model()?;
    let mask = model.bundle().masks().first().context("the bundle inside this binary reads no maps")?;
    let lives = Lives::new(plan(arguments), mask.clone()).map_err(|error| Failure::BadInput(error.to_string()))?;
    let bar = Bar::new();
    bar.stage("lives", arguments.runs as usize);
    let fly = |run: u32| {
        let life = fly(&lives, run as usize, arguments.upload_every.get(), (&model, mask));
        bar.step();
        life.with_context(|| format!("life {run}"))
    };
    let flown = (0..arguments.runs).into_par_iter().map(fly).collect::<Result<Vec<_>>>()?;
    drop(bar);
    out.write(|draft| write(draft, &flown))?;
    say!("{} lives in {}", flown.len(), arguments.out.display());
    Ok(())
}

/// A tail for each life, none of which sees a mechanic.
fn plan(arguments: &Arguments) -> FleetPlan {
    FleetPlan {
        tails: arguments.runs as usize,
        positions: 1,
        seed: arguments.seed,
        start: START.parse().expect("a valid time"),
        physics: arguments.physics.into(),
        upkeep: Upkeep { overhauls: 0.0, swaps: 0.0 },
        missions: arguments.missions.clone(),
        pace: Pace::default(),
        weak_transmission: Vec::new(),
    }
}

/// A flight without a plausible diagnosis has no row, but the one in which the life ends.
fn fly(lives: &Lives, run: usize, every: usize, (model, mask): (&Model, &Mask)) -> Result<Life> {
    let mut life = Life { mission: lives.mission(run), failure_fh: 0.0, equivalent_h: 0.0, rows: Vec::new() };
    let mut unread = None;
    for LifeFlight { upload, surroundings, equivalent_h } in lives.flights(run, every) {
        let estimate = model.estimate(&upload, Some(mask), None)?;
        (life.failure_fh, life.equivalent_h) = (upload.flight_hours, equivalent_h);
        let row = row(&estimate, surroundings);
        unread = if estimate.usable().is_some() {
            life.rows.extend(row);
            None
        } else {
            row
        };
    }
    life.rows.extend(unread);
    Ok(life)
}

fn row(estimate: &Estimate, hidden: Surroundings) -> Option<Row> {
    let Outcome::Diagnosed(diagnosis) = &estimate.outcome else { return None };
    Some(Row {
        t_fh: estimate.flight_hours,
        load: estimate.load.as_ref().map(|load| load.ratio),
        temperature: estimate.temperature,
        load_ratio: motor_ratio(estimate),
        faults: diagnosis.fault_vector.clone(),
        hidden,
    })
}

/// `histories.csv` and `truth.csv`.
fn write(draft: &Draft, lives: &[Life]) -> io::Result<()> {
    draft.file("histories.csv", |writer| {
        writeln!(writer, "run_id,regime,t_fh,load,temp,load_ratio,k1,k2,k3,k4,k5,true_load,true_temp")?;
        let mut rows = (0u64..).zip(lives).flat_map(|(run, life)| life.rows.iter().map(move |row| (run, row)));
        rows.try_for_each(|(run, row)| write_row(writer, run, row))
    })?;
    draft.file("truth.csv", |writer| {
        writeln!(writer, "run_id,regime,t_failure_fh,n_obs,mission,pace,equivalent_hours")?;
        (0u64..).zip(lives).try_for_each(|(run, life)| {
            let Life { mission, failure_fh, equivalent_h, rows } = life;
            let (regime, mission) = (regime(run).as_str(), mission.map_or("", Mission::as_str));
            let pace = equivalent_h / failure_fh;
            writeln!(writer, "{run},{regime},{failure_fh},{},{mission},{pace:.4},{equivalent_h:.2}", rows.len())
        })
    })
}

fn write_row(writer: &mut dyn Write, run: u64, row: &Row) -> io::Result<()> {
    write!(writer, "{run},{},{}", regime(run).as_str(), row.t_fh)?;
    for told in [row.load, row.temperature, row.load_ratio] {
        write!(writer, ",{}", told.map_or(String::new(), |value| format!("{value:.4}")))?;
    }
    row.faults.values().iter().try_for_each(|k| write!(writer, ",{k:.5}"))?;
    writeln!(writer, ",{:.4},{:.4}", row.hidden.load, row.hidden.temperature)
}
