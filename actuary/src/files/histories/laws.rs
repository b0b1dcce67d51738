//! What is true of the growth of recorded lives, for the oracle alone.

use std::{collections::BTreeMap, path::Path};

use domain::FaultModel;
use evaluation::{CONSTANT_GROWTH, Law};

use crate::{
    exit::Failure,
    files::{
        figures::time,
        table::{Column, Table},
    },
};

/// Columns of B: u = [1, load, temperature].
const INPUTS: usize = 3;

/// The columns `A11` ... and `B11` ... of a table.
pub struct LawColumns<'a> {
    state: Vec<Vec<Column<'a>>>,
    control: Vec<Vec<Column<'a>>>,
}

impl<'a> LawColumns<'a> {
    /// Of a component with these faults.
    pub fn of(table: &'a Table, faults: &FaultModel) -> Result<Self, Failure> {
        let matrix = |letter: char, columns: usize| {
            let row = |i: usize| {
                let names: Vec<String> = (1..=columns).map(|j| format!("{letter}{i}{j}")).collect();
                let columns = table.columns_of(&names);
                let refuse = |reason| format!("{reason}, but --estimator oracle needs A and B of each life");
                columns.map_err(|reason| Failure::BadInput(refuse(reason)))
            };
            (1..=faults.len()).map(row).collect::<Result<Vec<_>, _>>()
        };
        Ok(Self { state: matrix('A', faults.len())?, control: matrix('B', INPUTS)? })
    }

    /// The law in a row, without growth changes.
    pub fn read(&self, row: usize) -> Result<Law, Failure> {
        let numbers = |columns: &Vec<Column>| columns.iter().map(|column| column.number(row)).collect();
        let state_matrix: Result<Vec<Vec<f64>>, Failure> = self.state.iter().map(numbers).collect();
        let of_input = |columns: &Vec<Column>| {
            let mut b = [0.0; INPUTS];
            for (b, column) in b.iter_mut().zip(columns) {
                *b = column.number(row)?;
            }
            Ok(b)
        };
        let control_matrix: Result<Vec<[f64; INPUTS]>, Failure> = self.control.iter().map(of_input).collect();
        let (state_matrix, control_matrix) = (state_matrix?, control_matrix?);
        Ok(Law { state_matrix, control_matrix, growth: vec![(0.0, 1.0)], changes: None })
    }
}

/// Growth multipliers over time, by run.
pub type GrowthTable = BTreeMap<String, Vec<(f64, f64)>>;

/// Reads `run_id,t_fh,growth`; rows in any order.
pub fn read_growth(file: &Path) -> Result<GrowthTable, Failure> {
    let table = Table::open(file)?;
    let (ids, times, growths) = (table.column("run_id")?, table.column("t_fh")?, table.column("growth")?);
    let mut rows: BTreeMap<String, Vec<(f64, f64, usize)>> = BTreeMap::new();
    for row in 0..table.rows() {
        let (t_fh, growth) = (time(&times, row)?, growths.number(row)?);
        if growth < 0.0 {
            return Err(growths.refuse(row, format!("{growth} is below zero")));
        }
        rows.entry(ids.name(row)?.to_owned()).or_default().push((t_fh, growth, row));
    }
    let mut by_run = GrowthTable::new();
    for (id, mut rows) in rows {
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(pair) = rows.windows(2).find(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1) {
            let reason = format!("run {id} has another growth at {} h already", pair[1].0);
            return Err(growths.refuse(pair[1].2.max(pair[0].2), reason));
        }
        // Only where it changes.
        rows.dedup_by_key(|(_, growth, _)| *growth);
        by_run.insert(id, rows.into_iter().map(|(t_fh, growth, _)| (t_fh, growth)).collect());
    }
    Ok(by_run)
}

/// The law of a run with its growth, if that is known: from a table, or because it never changes.
pub fn with_growth(law: Law, growth: Option<Vec<(f64, f64)>>, regime: Option<&str>) -> Option<Law> {
    match growth {
        Some(growth) => Some(Law { growth, ..law }),
        None => (regime == Some(CONSTANT_GROWTH)).then_some(law),
    }
}
