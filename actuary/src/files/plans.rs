//! What lives are planned to fly.

use std::{collections::BTreeMap, path::Path};

use prognosis::{Change, Told};

use super::{stress, table::Table};
use crate::exit::Failure;

/// The stretches of each life, in the order of their hours.
pub type Plans = BTreeMap<String, Vec<Told>>;

/// Reads `run_id,from_fh,load,temp`; an empty load or temperature is not told. Of the two, what does not act is not read.
pub fn read(file: &Path, stress: &stress::Flags) -> Result<Plans, Failure> {
    let table = Table::open(file)?;
    let (ids, times) = (table.column("run_id")?, table.column("from_fh")?);
    let column = |told: &Option<stress::StressColumn>, name| match told {
        Some(told) => Ok(Some((table.column(name)?, told.clone()))),
        None => Ok(None),
    };
    let (loads, temperatures) = (column(&stress.load, "load")?, column(&stress.temperature, "temp")?);
    let mut plans = Plans::new();
    for row in 0..table.rows() {
        let from_fh = super::figures::time(&times, row)?;
        let change = |column: &Option<(super::table::Column, stress::StressColumn)>| match column {
            None => Ok::<_, Failure>(None),
            Some((column, told)) => {
                let value = told.read(column, row)?;
                Ok(value.map(|value| Change::To(told.acting(value, told.reference_of_actuators()))))
            }
        };
        let told = Told { from_fh, load: change(&loads)?, temperature: change(&temperatures)? };
        let stretches = plans.entry(ids.name(row)?.to_owned()).or_default();
        if stretches.iter().any(|other| other.from_fh == from_fh) {
            return Err(times.refuse(row, format!("run {} has another stretch from {from_fh} h", ids.text(row))));
        }
        stretches.push(told);
    }
    plans.values_mut().for_each(|stretches| stretches.sort_by(|a, b| a.from_fh.total_cmp(&b.from_fh)));
    Ok(plans)
}
