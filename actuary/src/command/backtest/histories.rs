//! Recorded lives: histories of fault vectors, and when they failed.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use domain::{FaultModel, FaultVector};
use prognosis::{Law, Observation, backtest::Run};

use super::{
    laws::{self, LawColumns},
    refuse,
};
use crate::{
    exit::Failure,
    files::{
        labels::fault,
        table::{Column, Table},
    },
};

/// No life is longer, flight hours.
const LONGEST_FH: f64 = 1e6;
/// The column of a truth file that tells when a run failed.
const FAILURE: &str = "t_failure_fh";

/// One run with the regime that it belongs to.
#[derive(Debug)]
pub struct Recorded {
    /// The run; the noise of its observations is not known yet.
    pub run: Run,
    /// What the file calls its regime.
    pub regime: Option<String>,
    /// What is true of its growth, for the oracle, where that is known.
    pub law: Option<Law>,
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

/// The runs of all files, in the order of the files and of the first row of each run.
pub fn read_all(files: Files, faults: &FaultModel) -> Result<Vec<Recorded>, Failure> {
    let Files { histories, truths, growths, .. } = files;
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
    let mut all = Vec::new();
    for (i, file) in histories.iter().enumerate() {
        let mut truth = truths.get(i).map(|truth| TruthFile::read(truth, file, faults, files.laws)).transpose()?;
        let mut growth = growths.get(i).map(|file| laws::read_growth(file)).transpose()?.unwrap_or_default();
        for (id, history) in read(file, faults)? {
            let told = truth.as_mut().map_or(Ok(None), |truth| truth.take(&id, &history))?;
            let (failure_fh, law) =
                told.as_ref().map_or((None, None), |told| (Some(told.failure_fh), told.law.clone()));
            let regime = told.and_then(|told| told.regime).or(history.regime);
            let law = law.and_then(|law| laws::with_growth(law, growth.remove(&id), regime.as_deref()));
            let id = if histories.len() > 1 { format!("{}/{id}", stems[i]) } else { id };
            all.push(Recorded { run: Run { id, observations: history.observations, failure_fh }, regime, law });
        }
        truth.map_or(Ok(()), |truth| truth.check_use())?;
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
        } else if let Some(column) =
            regimes.filter(|column| histories[place].1.regime.as_deref() != Some(column.text(row)))
        {
            let (id, history) = &histories[place];
            let regime = history.regime.as_deref().unwrap_or_default();
            return Err(
                column.refuse(row, format!("run {id} is of regime {regime:?} in a row before: two runs of one name?"))
            );
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

/// A truth file while its runs are looked up.
struct TruthFile<'a> {
    file: &'a Path,
    histories: &'a Path,
    table: Table,
    by_run: BTreeMap<String, Truth>,
    taken: usize,
}

impl<'a> TruthFile<'a> {
    fn read(file: &'a Path, histories: &'a Path, faults: &FaultModel, laws: bool) -> Result<Self, Failure> {
        let table = Table::open(file)?;
        let (ids, times) = (table.column("run_id")?, table.column(FAILURE)?);
        let regimes = table.optional_column("regime");
        let laws = laws.then(|| LawColumns::of(&table, faults)).transpose()?;
        let mut by_run = BTreeMap::new();
        for row in 0..table.rows() {
            let regime = regimes.map(|column| column.text(row).to_owned());
            let law = laws.as_ref().map(|columns| columns.read(row)).transpose()?;
            let told = Truth { regime, failure_fh: time(&times, row)?, law, row };
            if by_run.insert(name(&ids, row)?, told).is_some() {
                return Err(ids.refuse(row, format!("run {} is there twice", ids.text(row))));
            }
        }
        Ok(Self { file, histories, table, by_run, taken: 0 })
    }

    /// What it tells of a run, if anything. A run that failed before it was ever observed has another clock.
    fn take(&mut self, id: &str, history: &History) -> Result<Option<Truth>, Failure> {
        let Some(told) = self.by_run.remove(id) else { return Ok(None) };
        let first_fh = history.observations[0].t_fh;
        if told.failure_fh < first_fh {
            let reason =
                format!("run {id} fails at {} h, before its first observation at {first_fh} h", told.failure_fh);
            return Err(self.table.column(FAILURE)?.refuse(told.row, reason));
        }
        self.taken += 1;
        Ok(Some(told))
    }

    /// A file that belongs to other histories is a mistake.
    fn check_use(&self) -> Result<(), Failure> {
        match self.taken {
            0 => Err(refuse(format!("{}: tells of no run of {}", self.file.display(), self.histories.display()))),
            _ => Ok(()),
        }
    }
}

/// A field that is not empty.
pub fn name(column: &Column, row: usize) -> Result<String, Failure> {
    match column.text(row) {
        "" => Err(column.refuse(row, "empty")),
        id => Ok(id.to_owned()),
    }
}

/// Flight hours since the start of a life.
pub fn time(column: &Column, row: usize) -> Result<f64, Failure> {
    match column.number(row)? {
        t_fh if (0.0..=LONGEST_FH).contains(&t_fh) => Ok(t_fh),
        t_fh => Err(column.refuse(row, format!("{t_fh} is outside 0 to {LONGEST_FH} flight hours"))),
    }
}
