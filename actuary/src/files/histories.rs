//! Recorded lives: histories of fault vectors, and when they failed.
//!
//! What contradicts itself is refused; what may be meant so, but often is not, is noted.

mod laws;
mod oddities;

use std::{
    collections::BTreeMap,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

use domain::{FaultModel, FaultVector};
use evaluation::{Law, Recorded, backtest::Run};
use prognosis::Observation;

use self::{laws::LawColumns, oddities::Oddities};
use super::{
    figures::{fault, time},
    stress::{self, StressColumn},
    table::{Column, Table},
};
use crate::exit::Failure;

/// Failure and last observation of one clock differ by no more than the rounding of a file, flight hours.
const ROUNDING_FH: f64 = 1e-6;
/// Seconds of an hour, and how far from them the ratio of two times may be that were told in both.
const SECONDS: RangeInclusive<f64> = 3000.0..=4200.0;
/// The column of a truth file that tells when a run failed.
const FAILURE: &str = "t_failure_fh";

/// The runs of all files.
#[derive(Debug, Default)]
pub struct Recordings {
    /// In the order of the files and of the first row of each run.
    pub runs: Vec<Recorded>,
    /// What may not be meant so, a line each.
    pub notes: Vec<String>,
}

/// The files of recorded lives.
#[derive(Debug, Clone, Copy)]
pub struct Files<'a> {
    /// Histories.
    pub histories: &'a [PathBuf],
    /// When they failed; none, or one file for each of histories.
    pub truths: &'a [PathBuf],
    /// How their growth changed, the n-th for the n-th histories.
    pub growths: &'a [PathBuf],
    /// Whether the truth tells A and B of each life.
    pub laws: bool,
    /// Which columns tell load and temperature.
    pub stress: &'a stress::Flags,
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
    law: Option<Law>,
    /// Where the file tells it.
    row: usize,
}

/// The runs of all files.
pub fn read_all(files: Files, faults: &FaultModel) -> Result<Recordings, Failure> {
    let Files { histories, truths, growths, stress, .. } = files;
    if !truths.is_empty() && truths.len() != histories.len() {
        return Err(refuse(format!("--truth names {} files, --histories {}", truths.len(), histories.len())));
    }
    if growths.len() > histories.len() {
        return Err(refuse(format!("--growth names {} files, --histories {}", growths.len(), histories.len())));
    }
    let stems: Vec<_> = histories.iter().map(|file| file.file_stem().unwrap_or_default().to_string_lossy()).collect();
    if let Some(twice) = (1..stems.len()).find(|&i| stems[..i].contains(&stems[i])) {
        return Err(refuse(format!("two files of --histories are called {}: run ids would clash", stems[twice])));
    }
    let mut all = Recordings::default();
    for (i, file) in histories.iter().enumerate() {
        let mut truth = truths.get(i).map(|truth| TruthFile::read(truth, file, faults, files.laws)).transpose()?;
        let mut growth = growths.get(i).map(|file| laws::read_growth(file)).transpose()?.unwrap_or_default();
        for (id, history) in read(file, faults, stress, &mut all.notes)? {
            let told = truth.as_mut().map_or(Ok(None), |truth| truth.take(&id, &history))?;
            let (failure_fh, law) =
                told.as_ref().map_or((None, None), |told| (Some(told.failure_fh), told.law.clone()));
            let regime = told.and_then(|told| told.regime).or(history.regime);
            let law = law.and_then(|law| laws::with_growth(law, growth.remove(&id), regime.as_deref()));
            let id = if histories.len() > 1 { format!("{}/{id}", stems[i]) } else { id };
            let run = Run { id, observations: history.observations, failure_fh };
            all.runs.push(Recorded { run, regime, goes_on: false, law, plan: Vec::new() });
        }
        if let Some(truth) = truth {
            truth.check_use()?;
            all.notes.extend(truth.notes());
        }
    }
    Ok(all)
}

/// The observations of every history of a file; the noise of the observations is not known yet.
pub fn read_observations(
    file: &Path,
    faults: &FaultModel,
    stress: &stress::Flags,
    notes: &mut Vec<String>,
) -> Result<Vec<Vec<Observation>>, Failure> {
    Ok(read(file, faults, stress, notes)?.into_iter().map(|(_, history)| history.observations).collect())
}

fn read(
    file: &Path,
    faults: &FaultModel,
    stress: &stress::Flags,
    notes: &mut Vec<String>,
) -> Result<Vec<(String, History)>, Failure> {
    let table = Table::open(file)?;
    let (ids, times) = (table.column("run_id")?, table.column("t_fh")?);
    let regimes = table.optional_column("regime");
    let [loads, temperatures] = [(&stress.load, "load"), (&stress.temperature, "temp")]
        .map(|(told, usual)| stressing(&table, told.as_ref(), usual));
    let (loads, temperatures) = (loads?, temperatures?);
    let entries = table.columns_of(&faults.names)?;
    let mut places = BTreeMap::new();
    let mut histories: Vec<(String, History)> = Vec::new();
    let mut oddities = Oddities::default();
    for row in 0..table.rows() {
        let regime_of = |column: Column<'_>| column.optional_text(row).map(str::to_owned);
        let place = *places.entry(ids.name(row)?).or_insert(histories.len());
        if place == histories.len() {
            let regime = regimes.and_then(regime_of);
            histories.push((ids.text(row).to_owned(), History { regime, observations: Vec::new() }));
        } else if let Some(column) = regimes.filter(|column| histories[place].1.regime != regime_of(*column)) {
            let (id, history) = &histories[place];
            let regime = history.regime.as_deref().unwrap_or_default();
            return Err(
                column.refuse(row, format!("run {id} is of regime {regime:?} in a row before: two runs of one name?"))
            );
        }
        let k: Vec<f64> = entries.iter().map(|column| fault(column, row)).collect::<Result<_, _>>()?;
        let (id, History { observations, .. }) = &mut histories[place];
        let t_fh = time(&times, row)?;
        oddities.row(id, observations.last().map(|before| before.t_fh), t_fh, table.line(row));
        observations.push(Observation {
            t_fh,
            sigma: vec![0.0; k.len()],
            fault_vector: FaultVector(k),
            load: acting(loads.as_ref(), row)?,
            temperature: acting(temperatures.as_ref(), row)?,
        });
    }
    for (id, history) in &mut histories {
        put_in_order(&mut history.observations);
        oddities.history(id, &history.observations);
    }
    notes.extend(oddities.notes(file));
    Ok(histories)
}

/// A column of loads or temperatures, and what is told of it.
type Stressing<'a> = (Column<'a>, Option<&'a StressColumn>);

/// The column that is told, or the usual one if it is there.
fn stressing<'a>(
    table: &'a Table,
    told: Option<&'a StressColumn>,
    usual: &str,
) -> Result<Option<Stressing<'a>>, Failure> {
    match told {
        Some(told) => Ok(Some((table.column(&told.name)?, Some(told)))),
        None => Ok(table.optional_column(usual).map(|column| (column, None))),
    }
}

/// What acts on wear in a row, relative to its reference.
fn acting(stressing: Option<&Stressing>, row: usize) -> Result<Option<f64>, Failure> {
    match stressing {
        None => Ok(None),
        Some((column, None)) => column.optional_number(row),
        Some((column, Some(told))) => {
            Ok(told.read(column, row)?.map(|value| told.acting(value, told.reference_of_actuators())))
        }
    }
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

/// A truth file while its runs are looked up.
struct TruthFile<'a> {
    file: &'a Path,
    histories: &'a Path,
    table: Table,
    by_run: BTreeMap<String, Truth>,
    taken: usize,
    /// Histories that it does not tell of.
    untold: Vec<String>,
}

impl<'a> TruthFile<'a> {
    fn read(file: &'a Path, histories: &'a Path, faults: &FaultModel, laws: bool) -> Result<Self, Failure> {
        let table = Table::open(file)?;
        let (ids, times) = (table.column("run_id")?, table.column(FAILURE)?);
        let regimes = table.optional_column("regime");
        let laws = laws.then(|| LawColumns::of(&table, faults)).transpose()?;
        let mut by_run = BTreeMap::new();
        for row in 0..table.rows() {
            let regime = regimes.and_then(|column| column.optional_text(row)).map(str::to_owned);
            let law = laws.as_ref().map(|columns| columns.read(row)).transpose()?;
            let told = Truth { regime, failure_fh: time(&times, row)?, law, row };
            if by_run.insert(ids.name(row)?.to_owned(), told).is_some() {
                return Err(ids.refuse(row, format!("run {} is there twice", ids.text(row))));
            }
        }
        Ok(Self { file, histories, table, by_run, taken: 0, untold: Vec::new() })
    }

    /// What it tells of a run, if anything. A run that is observed after its failure is another, or has another clock.
    fn take(&mut self, id: &str, history: &History) -> Result<Option<Truth>, Failure> {
        let Some(told) = self.by_run.remove(id) else {
            self.untold.push(id.to_owned());
            return Ok(None);
        };
        let (failure_fh, times) = (told.failure_fh, history.observations.iter().map(|observation| observation.t_fh));
        let (first_fh, last_fh) =
            times.fold((f64::INFINITY, 0.0), |(first, last), t_fh| (t_fh.min(first), t_fh.max(last)));
        if failure_fh < last_fh - ROUNDING_FH {
            let (which, at_fh) = if failure_fh < first_fh { ("first", first_fh) } else { ("last", last_fh) };
            let unit = if SECONDS.contains(&(last_fh / failure_fh)) { ": are those seconds?" } else { "" };
            let reason = format!("run {id} fails at {failure_fh} h, before its {which} observation at {at_fh} h{unit}");
            return Err(self.table.column(FAILURE)?.refuse(told.row, reason));
        }
        self.taken += 1;
        Ok(Some(told))
    }

    /// Runs that are in one of the two files only.
    fn notes(&self) -> Vec<String> {
        let (file, histories) = (self.file.display(), self.histories.display());
        let some = |count: usize, first: Option<&String>| match (count, first) {
            (1, Some(id)) => Some(format!("run {id}")),
            (_, Some(id)) => Some(format!("{count} runs (such as {id})")),
            (_, None) => None,
        };
        let alone = some(self.by_run.len(), self.by_run.keys().next());
        let untold = some(self.untold.len(), self.untold.first());
        let alone = alone.map(|runs| format!("{file} tells of {runs} that {histories} does not have"));
        let untold =
            untold.map(|runs| format!("{runs} of {histories} cannot be judged: {file} does not tell when it failed"));
        alone.into_iter().chain(untold).collect()
    }

    /// A file that belongs to other histories is a mistake.
    fn check_use(&self) -> Result<(), Failure> {
        match self.taken {
            0 => Err(refuse(format!("{}: tells of no run of {}", self.file.display(), self.histories.display()))),
            _ => Ok(()),
        }
    }
}

fn refuse(reason: String) -> Failure {
    Failure::BadInput(reason)
}
