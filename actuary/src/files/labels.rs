//! Labelled fault vectors: fault columns, then the figures of merit, `min_margin` or `label`
//! (healthy | faulty), whichever there is.
//!
//! What says most counts: four figures more than the least margin, that more than the verdict. Figures
//! count where the default requirements explain the least margin; another rig's requirements are unknown.

use std::path::Path;

use ema::assessment::{Assessment, Requirements};
use pipeline::Labels;
use prognosis::surrogate::LabelledFaults;

use super::{
    figures::fault,
    table::{Column, Table},
};
use crate::exit::Failure;

/// No-load speed, stall load, gain margin, phase margin; an empty margin = no crossing.
const FIGURES: [&str; 4] = ["noload_rad_s", "stall_Nm", "gm_dB", "pm_deg"];
/// Rounding of figures and margins in a file.
const ROUNDING: f64 = 1e-3;

/// Reads labelled fault vectors; `fault_names` are the columns of the fault vector.
pub fn read(file: &Path, fault_names: &[String]) -> Result<Labels, Failure> {
    let table = Table::open(file)?;
    let faults = table.columns_of(fault_names)?;
    let verdicts = table.optional_column("label").map(|column| verdicts(&table, column)).transpose()?;
    let least = table.optional_column("min_margin").map(|column| column.numbers()).transpose()?;
    let margins = match (figure_margins(&table, least.as_deref())?, &least, &verdicts) {
        (Some(margins), _, _) => margins,
        (None, Some(least), _) => least.iter().map(|margin| vec![*margin]).collect(),
        (None, None, Some(verdicts)) => {
            verdicts.iter().map(|healthy| vec![if *healthy { 1.0 } else { -1.0 }]).collect()
        }
        (None, None, None) => return Err(table.refuse("no column label, nor min_margin, nor the four figures")),
    };
    let mut samples = Vec::with_capacity(table.rows());
    for (row, margins) in margins.into_iter().enumerate() {
        let k = faults.iter().map(|column| fault(column, row)).collect::<Result<_, _>>()?;
        let sample = LabelledFaults { k, margins };
        let contradicts =
            |healthy: bool| if healthy { sample.margin() < -ROUNDING } else { sample.margin() > ROUNDING };
        if verdicts.as_ref().is_some_and(|verdicts| contradicts(verdicts[row])) {
            let margin = sample.margin();
            return Err(table.column("label")?.refuse(row, format!("contradicts the least margin, {margin:.6}")));
        }
        samples.push(sample);
    }
    let known_margins = least.is_some() || samples.iter().any(|sample| sample.margins.len() > 1);
    Ok(if known_margins { Labels::Margins(samples) } else { Labels::Verdicts(samples) })
}

fn verdicts(table: &Table, column: Column) -> Result<Vec<bool>, Failure> {
    let verdict = |row| match column.text(row) {
        "healthy" => Ok(true),
        "faulty" => Ok(false),
        other => Err(column.refuse(row, format!("\"{other}\" is neither healthy nor faulty"))),
    };
    (0..table.rows()).map(verdict).collect()
}

/// The margins of the figures, where all are there and explain the least margin.
fn figure_margins(table: &Table, least: Option<&[f64]>) -> Result<Option<Vec<Vec<f64>>>, Failure> {
    let [Some(speed), Some(load), Some(gain), Some(phase)] = FIGURES.map(|name| table.optional_column(name)) else {
        return Ok(None);
    };
    let mut margins = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let assessment = Assessment {
            no_load_speed_rad_s: speed.number(row)?,
            stall_load_nm: load.number(row)?,
            gain_margin_db: gain.optional_number(row)?,
            phase_margin_deg: phase.optional_number(row)?,
        };
        let of_row = assessment.margins_to(&Requirements::default());
        if least.is_some_and(|least| (least[row] - assessment.min_margin()).abs() > ROUNDING) {
            return Ok(None);
        }
        margins.push(of_row.to_vec());
    }
    Ok(Some(margins))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn read_text(text: &str) -> Result<Labels, Failure> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("labels.csv");
        fs::write(&file, text).unwrap();
        read(&file, &["k1".to_owned(), "k2".to_owned()])
    }

    fn margins(text: &str) -> Vec<f64> {
        match read_text(text).unwrap() {
            Labels::Margins(samples) => samples[0].margins.clone(),
            Labels::Verdicts(_) => panic!("verdicts"),
        }
    }

    #[test]
    fn what_says_most_counts() {
        let figures =
            margins("k1,k2,noload_rad_s,stall_Nm,gm_dB,pm_deg,min_margin,label\n.1,0,1.1678,660,,57,0,healthy\n");
        let expected = [1.1678 / 1.145 - 1.0, 0.0, 1.0, 0.0];
        assert!(figures.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{figures:?}");
        // Other requirements than the default ones explain this margin.
        let foreign = "k1,k2,noload_rad_s,stall_Nm,gm_dB,pm_deg,min_margin,label\n.1,0,1.2,700,20,60,-0.2,faulty\n";
        assert_eq!(margins(foreign), [-0.2]);
        assert_eq!(margins("k2,k1,min_margin\n.1,0,0.05\n"), [0.05]);
        let Labels::Verdicts(samples) = read_text("k1,k2,label\n.1,0,healthy\n.9,1,faulty\n").unwrap() else {
            panic!("margins");
        };
        assert_eq!((samples[0].margin(), samples[1].margin(), &samples[1].k), (1.0, -1.0, &vec![0.9, 1.0]));
    }

    #[test]
    fn a_contradiction_is_refused() {
        let said = |text: &str| read_text(text).unwrap_err().to_string();
        let contradiction = said("k1,k2,min_margin,label\n0,0,0.1,healthy\n0,0,-0.1,healthy\n");
        assert!(
            contradiction.ends_with("row 3, column label: contradicts the least margin, -0.100000"),
            "{contradiction}"
        );
        assert!(said("k1,k2\n0,0\n").ends_with("no column label, nor min_margin, nor the four figures"));
        assert!(said("k1,k2,label\n0,2,healthy\n").ends_with("row 2, column k2: 2 is outside 0 to 1"));
    }
}
