//! One table of recorded lives: its columns and, in the order of time, the rows of each unit.

use std::{collections::BTreeMap, path::Path};

use prognosis::Ending;

use super::flags::Flags;
use crate::{
    exit::Failure,
    files::{
        stress::{self, StressColumn},
        table::{Column, Table},
    },
};

/// Columns that count time, by their usual names.
const TIMES: [&str; 7] = ["t", "time", "t_fh", "hours", "cycle", "cycles", "days"];
/// Columns that name a unit, by their usual names.
const UNITS: [&str; 7] = ["unit", "specimen", "cell", "device", "run_id", "id", "serial_number"];

/// A table of recorded lives.
#[derive(Debug)]
pub struct RecordFile {
    table: Table,
    /// What its times are counted in.
    pub time_unit: String,
    /// Its units, in order of first appearance.
    pub units: Vec<Unit>,
    /// Columns that are not read.
    pub ignored: Vec<String>,
    /// Rows that were there before.
    pub repeated: usize,
}

/// The rows of one unit, in the order of time.
#[derive(Debug)]
pub struct Unit {
    /// Its name.
    pub name: String,
    /// At least two rows.
    pub rows: Vec<Row>,
    /// How it ended, where the file tells.
    pub ending: Option<Ending>,
}

/// One row of a unit.
#[derive(Debug, Clone)]
pub struct Row {
    /// Its place in the table.
    pub place: usize,
    /// Time since the start of the life.
    pub time: f64,
    /// The columns that have a limit, in their order.
    pub values: Vec<f64>,
    /// Load and temperature, where they are told.
    pub stress: [Option<f64>; 2],
}

impl Unit {
    /// Whether another table tells the same of it; of several tables its name begins with that of the file.
    pub fn is_told_as(&self, other: &Self) -> bool {
        if self.name.rsplit('/').next() != other.name.rsplit('/').next() {
            return false;
        }
        let same = |(a, b): (&Row, &Row)| a.time == b.time && a.values == b.values;
        self.rows.len() == other.rows.len() && self.rows.iter().zip(&other.rows).all(same)
    }
}

/// The columns that are read.
struct Columns<'a> {
    time: Column<'a>,
    unit: Column<'a>,
    faults: Vec<Column<'a>>,
    end: Option<Column<'a>>,
    /// Load and temperature, each with what is told of its column.
    stress: [Option<(Column<'a>, &'a StressColumn)>; 2],
}

impl RecordFile {
    /// Reads a table.
    pub fn read(file: &Path, flags: &Flags, stress: &stress::Flags) -> Result<Self, Failure> {
        let table = Table::open(file)?;
        let (time, time_unit) = time_column(&table, flags.time.as_deref())?;
        let unit = the_one(&table, flags.unit.as_deref(), &UNITS, "names the unit", "--unit COLUMN")?;
        let names: Vec<&str> = flags.limits.iter().map(|limit| limit.name.as_str()).collect();
        let used: Vec<&str> =
            names.iter().copied().chain([time.as_str(), unit.as_str()]).chain(flags.end.as_deref()).collect();
        let stressing = stress.columns();
        let used: Vec<&str> =
            used.into_iter().chain(stressing.iter().flatten().map(|told| told.name.as_str())).collect();
        if let Some(twice) = (1..used.len()).find(|&i| used[..i].contains(&used[i])) {
            return Err(table.refuse(format!("column {} cannot be two things at once", used[twice])));
        }
        let columns = Columns {
            time: table.column(&time)?,
            unit: table.column(&unit)?,
            faults: names.iter().map(|name| limited(&table, name)).collect::<Result<_, _>>()?,
            end: flags.end.as_deref().map(|name| table.column(name)).transpose()?,
            stress: stress::found(&table, stressing)?,
        };
        let (units, repeated) = units(&table, &columns)?;
        let ignored = table.header().iter().filter(|name| !used.contains(&name.as_str())).cloned().collect();
        Ok(Self { time_unit, units, ignored, repeated, table })
    }

    /// What is wrong with a row in a column that has a limit.
    pub fn refuse(&self, row: &Row, fault: &str, reason: impl std::fmt::Display) -> Failure {
        match self.table.column(fault) {
            Ok(column) => column.refuse(row.place, reason),
            Err(missing) => missing,
        }
    }

    /// What is wrong with the file as a whole.
    pub fn refuse_whole(&self, reason: impl std::fmt::Display) -> Failure {
        self.table.refuse(reason)
    }
}

/// A column that a limit is told of.
fn limited<'a>(table: &'a Table, name: &str) -> Result<Column<'a>, Failure> {
    let names = || table.header().join(", ");
    table
        .optional_column(name)
        .ok_or_else(|| table.refuse(format!("column {name} of --limit is missing: the columns are {}", names())))
}

/// The column of times, and what they are counted in.
fn time_column(table: &Table, told: Option<&str>) -> Result<(String, String), Failure> {
    if let Some((column, unit)) =
        told.filter(|told| table.optional_column(told).is_none()).and_then(|told| told.rsplit_once(':'))
    {
        if unit.trim().is_empty() {
            return Err(table.refuse("--time COLUMN:UNIT names no unit"));
        }
        return Ok((table.column(column).map(|_| column.to_owned())?, unit.trim().to_owned()));
    }
    let column = the_one(table, told, &TIMES, "counts time", "--time COLUMN")?;
    let unit = if column.to_lowercase().ends_with("_fh") { "h".to_owned() } else { column.clone() };
    Ok((column, unit))
}

/// The column that is told, or the only one of the usual names.
fn the_one(table: &Table, told: Option<&str>, usual: &[&str], what: &str, flag: &str) -> Result<String, Failure> {
    if let Some(told) = told {
        return table.column(told).map(|_| told.to_owned());
    }
    let is_usual = |name: &&String| usual.contains(&name.to_lowercase().as_str());
    let found: Vec<&String> = table.header().iter().filter(is_usual).collect();
    match found[..] {
        [only] => Ok(only.clone()),
        [] => Err(table.refuse(format!("no column {what} (none of {}): tell {flag}", usual.join(", ")))),
        [one, other, ..] => {
            Err(table.refuse(format!("both {one} and {other} may be the column that {what}: tell {flag}")))
        }
    }
}

/// The units in order of first appearance, and the number of rows that were there before.
fn units(table: &Table, columns: &Columns) -> Result<(Vec<Unit>, usize), Failure> {
    let mut places = BTreeMap::new();
    let mut units: Vec<Unit> = Vec::new();
    for place in 0..table.rows() {
        let name = columns.unit.name(place)?;
        let unit = *places.entry(name).or_insert(units.len());
        if unit == units.len() {
            units.push(Unit { name: name.to_owned(), rows: Vec::new(), ending: None });
        }
        let values = columns.faults.iter().map(|column| column.number(place)).collect::<Result<_, _>>()?;
        let mut stress = [None; 2];
        for (value, column) in stress.iter_mut().zip(&columns.stress) {
            *value = column.as_ref().map_or(Ok(None), |(column, told)| told.read(column, place))?;
        }
        units[unit].rows.push(Row { place, time: time(&columns.time, place)?, values, stress });
    }
    let mut repeated = 0;
    for unit in &mut units {
        repeated += put_in_order(unit, columns)?;
        let last = unit.rows.last().expect("a unit has rows").place;
        unit.ending = columns.end.as_ref().map_or(Ok(None), |column| ending(column, last))?;
        if let [only] = &unit.rows[..] {
            let reason = format!("unit {} has no other row: one value tells of no growth", unit.name);
            return Err(columns.time.refuse(only.place, reason));
        }
    }
    Ok((units, repeated))
}

fn time(column: &Column, place: usize) -> Result<f64, Failure> {
    match column.number(place)? {
        time if time < 0.0 => Err(column.refuse(place, format!("{time} is before the start of the life"))),
        time => Ok(time),
    }
}

/// The order of time, whatever the order of rows; rows that are there twice count once, and are counted.
fn put_in_order(unit: &mut Unit, columns: &Columns) -> Result<usize, Failure> {
    unit.rows.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.place.cmp(&b.place)));
    let other = |pair: &&[Row]| pair[0].time == pair[1].time && pair[0].values != pair[1].values;
    if let Some([before, row]) = unit.rows.windows(2).find(other) {
        let different = before.values.iter().zip(&row.values).position(|(a, b)| a != b).expect("they differ");
        let reason = format!("unit {} has another value at {} already", unit.name, row.time);
        return Err(columns.faults[different].refuse(row.place, reason));
    }
    let all = unit.rows.len();
    // The later row of the table stays.
    unit.rows.dedup_by(|row, before| {
        let twice = row.time == before.time;
        if twice {
            std::mem::swap(row, before);
        }
        twice
    });
    Ok(all - unit.rows.len())
}

fn ending(column: &Column, place: usize) -> Result<Option<Ending>, Failure> {
    match column.optional_text(place).map(str::to_lowercase).as_deref() {
        None => Ok(None),
        Some("failed") => Ok(Some(Ending::Failed)),
        Some("removed") => Ok(Some(Ending::Removed)),
        Some(other) => Err(column.refuse(place, format!("\"{other}\" is neither failed nor removed"))),
    }
}
