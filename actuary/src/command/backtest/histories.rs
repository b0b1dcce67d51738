//! Recorded lives: histories of fault vectors, and when they failed.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use domain::{FaultModel, FaultVector};
use prognosis::{Observation, backtest::Run};

use super::refuse;
use crate::{
    exit::Failure,
    files::{
        labels::fault,
        table::{Column, Table},
    },
};

/// No life is longer, flight hours.
const LONGEST_FH: f64 = 1e6;

/// One run with the regime that it belongs to.
#[derive(Debug)]
pub struct Recorded {
    /// The run; the noise of its observations is not known yet.
    pub run: Run,
    /// What the file calls its regime.
    pub regime: Option<String>,
}

/// One history of a file.
struct History {
    regime: Option<String>,
    observations: Vec<Observation>,
}

/// What a truth file tells of a run.
struct Truth {
    regime: Option<String>,
    failure_fh: f64,
}

/// The runs of all files, in the order of the files and of the first row of each run.
pub fn read_all(histories: &[PathBuf], truths: &[PathBuf], faults: &FaultModel) -> Result<Vec<Recorded>, Failure> {
    if !truths.is_empty() && truths.len() != histories.len() {
        return Err(refuse(format!("--truth names {} files, --histories {}", truths.len(), histories.len())));
    }
    let stems: Vec<_> = histories.iter().map(|file| file.file_stem().unwrap_or_default().to_string_lossy()).collect();
    if let Some(twice) = (1..stems.len()).find(|&i| stems[..i].contains(&stems[i])) {
        return Err(refuse(format!("two files of --histories are called {}: run ids would clash", stems[twice])));
    }
    let mut all = Vec::new();
    for (i, file) in histories.iter().enumerate() {
        let mut truth = truths.get(i).map(|file| read_truth(file)).transpose()?;
        let mut known = 0;
        for (id, history) in read(file, faults)? {
            let told = truth.as_mut().and_then(|truth| truth.remove(&id));
            known += usize::from(told.is_some());
            let failure_fh = told.as_ref().map(|truth| truth.failure_fh);
            let id = if histories.len() > 1 { format!("{}/{id}", stems[i]) } else { id };
            let regime = told.and_then(|truth| truth.regime).or(history.regime);
            all.push(Recorded { run: Run { id, observations: history.observations, failure_fh }, regime });
        }
        if let (0, Some(truth)) = (known, truths.get(i)) {
            return Err(refuse(format!("{}: tells of no run of {}", truth.display(), file.display())));
        }
    }
    Ok(all)
}

/// The observations of every history of a file; the noise of the observations is not known yet.
pub fn read_observations(file: &Path, faults: &FaultModel) -> Result<Vec<Vec<Observation>>, Failure> {
    Ok(read(file, faults)?.into_iter().map(|(_, history)| history.observations).collect())
}

fn read(file: &Path, faults: &FaultModel) -> Result<Vec<(String, History)>, Failure> {
    let table = Table::open(file)?;
    let (ids, times) = (table.column("run_id")?, table.column("t_fh")?);
    let [regimes, loads, temperatures] = ["regime", "load", "temp"].map(|name| table.optional_column(name));
    let entries = table.columns_of(&faults.names)?;
    let optional = |column: Option<Column>, row| column.map_or(Ok(None), |column| column.optional_number(row));
    let mut places = BTreeMap::new();
    let mut histories: Vec<(String, History)> = Vec::new();
    for row in 0..table.rows() {
        let place = *places.entry(name(&ids, row)?).or_insert(histories.len());
        if place == histories.len() {
            let regime = regimes.map(|column| column.text(row).to_owned());
            histories.push((ids.text(row).to_owned(), History { regime, observations: Vec::new() }));
        }
        let k: Vec<f64> = entries.iter().map(|column| fault(column, row)).collect::<Result<_, _>>()?;
        histories[place].1.observations.push(Observation {
            t_fh: time(&times, row)?,
            sigma: vec![0.0; k.len()],
            fault_vector: FaultVector(k),
            load: optional(loads, row)?,
            temperature: optional(temperatures, row)?,
        });
    }
    histories.iter_mut().for_each(|(_, history)| put_in_order(&mut history.observations));
    Ok(histories)
}

/// In the order of time, whatever the order of rows; a row that is there twice counts once.
fn put_in_order(observations: &mut Vec<Observation>) {
    let numbers = |o: &Observation| {
        let rest = [o.load.unwrap_or(f64::INFINITY), o.temperature.unwrap_or(f64::INFINITY)];
        [o.t_fh].into_iter().chain(o.fault_vector.values().to_vec()).chain(rest)
    };
    observations.sort_by(|a, b| {
        let differences = numbers(a).zip(numbers(b)).map(|(a, b)| a.total_cmp(&b));
        differences.reduce(std::cmp::Ordering::then).expect("an observation has numbers")
    });
    observations.dedup();
}

fn read_truth(file: &Path) -> Result<BTreeMap<String, Truth>, Failure> {
    let table = Table::open(file)?;
    let (ids, times) = (table.column("run_id")?, table.column("t_failure_fh")?);
    let regimes = table.optional_column("regime");
    let mut truth = BTreeMap::new();
    for row in 0..table.rows() {
        let regime = regimes.map(|column| column.text(row).to_owned());
        let told = Truth { regime, failure_fh: time(&times, row)? };
        if truth.insert(name(&ids, row)?, told).is_some() {
            return Err(ids.refuse(row, format!("run {} is there twice", ids.text(row))));
        }
    }
    Ok(truth)
}

fn name(column: &Column, row: usize) -> Result<String, Failure> {
    match column.text(row) {
        "" => Err(column.refuse(row, "empty")),
        id => Ok(id.to_owned()),
    }
}

/// Flight hours since the start of a life.
fn time(column: &Column, row: usize) -> Result<f64, Failure> {
    match column.number(row)? {
        t_fh if (0.0..=LONGEST_FH).contains(&t_fh) => Ok(t_fh),
        t_fh => Err(column.refuse(row, format!("{t_fh} is outside 0 to {LONGEST_FH} flight hours"))),
    }
}
