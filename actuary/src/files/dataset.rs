//! Dataset folders: `theta.csv`, `K.csv`, `Y.csv` and, optional, `R.csv`, `r.csv`, `labels.csv`.

use std::{
    f64::consts::TAU,
    io::{self, Write},
    path::Path,
};

use domain::{
    FaultVector, LoadRatio,
    range::{self, Range},
};
use pipeline::Dataset;

use super::{
    figures, labels,
    output::Draft,
    table::{Column, Table},
};
use crate::exit::Failure;

/// Largest error of an angle, as a fraction of a bin.
const ANGLE_TOLERANCE: f64 = 1e-3;

/// Maps without their faults, as a diagnosis takes them. Missing values are those that no pass gave.
#[derive(Debug)]
pub struct Maps {
    /// Bins of a map.
    pub bins: usize,
    /// The maps, V s/rad.
    pub maps: Vec<Vec<Option<f64>>>,
    /// The load under which each was taken, as far as it is known.
    pub load_ratios: Vec<Option<LoadRatio>>,
}

/// Reads what a diagnosis of motors of this back-EMF constant, V s/rad, may see of a folder: never `K.csv`. Values are
/// those that an upload may have.
pub fn read_maps(folder: &Path, k_nom: f64) -> Result<Maps, Failure> {
    let bins = angles(folder)?.len();
    let y = matrix(&folder.join("Y.csv"), bins)?;
    let maps =
        (0..y.rows()).map(|row| optional_numbers(&y, row, Range::for_samples(k_nom))).collect::<Result<_, _>>()?;
    let load_ratios = if let Some(ratios) = ratios_per_point(folder, y.rows(), bins)? {
        let per_sample = |row| optional_numbers(&ratios, row, range::LOAD_RATIO).map(|r| Some(LoadRatio::PerSample(r)));
        (0..y.rows()).map(per_sample).collect::<Result<_, _>>()?
    } else if let Some(means) = mean_ratios(folder, y.rows())? {
        let mean = |row| means.column("r")?.optional_within(row, range::LOAD_RATIO).map(|r| r.map(LoadRatio::Mean));
        (0..y.rows()).map(mean).collect::<Result<_, _>>()?
    } else {
        vec![None; y.rows()]
    };
    Ok(Maps { bins, maps, load_ratios })
}

/// Reads a folder to train from: every value must be there.
pub fn read(folder: &Path) -> Result<Dataset, Failure> {
    let angles_rad = angles(folder)?;
    let k = Table::open(&folder.join("K.csv"))?;
    let y = matrix(&folder.join("Y.csv"), angles_rad.len())?;
    must_have_rows(&y, k.rows(), "K.csv")?;
    let faults = |row| -> Result<_, Failure> {
        Ok(FaultVector((0..k.columns()).map(|i| figures::fault(&k.column_at(i), row)).collect::<Result<_, _>>()?))
    };
    let ratios = ratios_per_point(folder, k.rows(), angles_rad.len())?;
    let means = mean_ratios(folder, k.rows())?;
    let labels = folder.join("labels.csv");
    Ok(Dataset {
        fault_names: k.header().to_vec(),
        faults: (0..k.rows()).map(faults).collect::<Result<_, _>>()?,
        maps: (0..y.rows()).map(|row| y.numbers_of_row(row)).collect::<Result<_, _>>()?,
        load_ratios: ratios
            .map(|table| (0..table.rows()).map(|row| ratios_of_row(&table, row)).collect::<Result<_, _>>())
            .transpose()?,
        mean_load_ratios: means.map(|table| load_ratios(&table.column("r")?, table.rows())).transpose()?,
        labels: labels.exists().then(|| labels::read(&labels, k.header())).transpose()?,
        angles_rad,
    })
}

/// Writes the files of a dataset folder.
pub fn write(dataset: &Dataset, draft: &Draft) -> io::Result<()> {
    draft.file("theta.csv", |writer| column(writer, "theta_rad", &dataset.angles_rad))?;
    draft.file("K.csv", |writer| {
        writeln!(writer, "{}", dataset.fault_names.join(","))?;
        dataset.faults.iter().try_for_each(|faults| line(writer, faults.values(), |k| k.to_string()))
    })?;
    draft.file("Y.csv", |writer| dataset.maps.iter().try_for_each(|y| line(writer, y, |y| format!("{y:.9}"))))?;
    if let Some(ratios) = &dataset.load_ratios {
        draft.file("R.csv", |writer| ratios.iter().try_for_each(|r| line(writer, r, |r| format!("{r:.7}"))))?;
    }
    match &dataset.mean_load_ratios {
        Some(means) => draft.file("r.csv", |writer| column(writer, "r", means)),
        None => Ok(()),
    }
}

fn column(writer: &mut dyn Write, name: &str, values: &[f64]) -> io::Result<()> {
    writeln!(writer, "{name}")?;
    values.iter().try_for_each(|value| writeln!(writer, "{value}"))
}

fn line(writer: &mut dyn Write, values: &[f64], format: impl Fn(&f64) -> String) -> io::Result<()> {
    writeln!(writer, "{}", values.iter().map(format).collect::<Vec<_>>().join(","))
}

/// The angles of `theta.csv`: the centres of equal bins over one turn, in order.
fn angles(folder: &Path) -> Result<Vec<f64>, Failure> {
    if !folder.is_dir() {
        return Err(Failure::BadInput(format!("{}: there is no such folder", folder.display())));
    }
    let table = Table::open(&folder.join("theta.csv"))?;
    let theta = table.column("theta_rad")?;
    let angles = theta.numbers()?;
    let width = TAU / angles.len() as f64;
    for (row, angle) in angles.iter().enumerate() {
        let centre = (row as f64 + 0.5) * width;
        if (angle - centre).abs() > ANGLE_TOLERANCE * width {
            let bins = angles.len();
            let reason = format!("{angle} is not {centre:.6}, the centre of bin {} of {bins} over a turn", row + 1);
            return Err(theta.refuse(row, reason));
        }
    }
    Ok(angles)
}

/// `R.csv`, if there is one.
fn ratios_per_point(folder: &Path, rows: usize, bins: usize) -> Result<Option<Table>, Failure> {
    let Some(table) = optional(&folder.join("R.csv"), |file| matrix(file, bins))? else { return Ok(None) };
    must_have_rows(&table, rows, "Y.csv")?;
    Ok(Some(table))
}

/// `r.csv`, if there is one.
fn mean_ratios(folder: &Path, rows: usize) -> Result<Option<Table>, Failure> {
    let Some(table) = optional(&folder.join("r.csv"), Table::open)? else { return Ok(None) };
    table.column("r")?;
    must_have_rows(&table, rows, "Y.csv")?;
    Ok(Some(table))
}

/// A table with a value at each angle and no header.
fn matrix(file: &Path, bins: usize) -> Result<Table, Failure> {
    Table::open_headerless(file, bins, &format!("theta.csv has {bins} angles"))
}

fn optional(file: &Path, open: impl Fn(&Path) -> Result<Table, Failure>) -> Result<Option<Table>, Failure> {
    file.exists().then(|| open(file)).transpose()
}

fn optional_numbers(table: &Table, row: usize, range: Range) -> Result<Vec<Option<f64>>, Failure> {
    (0..table.columns()).map(|index| table.column_at(index).optional_within(row, range)).collect()
}

fn ratios_of_row(table: &Table, row: usize) -> Result<Vec<f64>, Failure> {
    (0..table.columns()).map(|index| load_ratio(&table.column_at(index), row)).collect()
}

fn load_ratios(column: &Column, rows: usize) -> Result<Vec<f64>, Failure> {
    (0..rows).map(|row| load_ratio(column, row)).collect()
}

/// A load ratio above -1, where the load-invariant map ends.
fn load_ratio(column: &Column, row: usize) -> Result<f64, Failure> {
    match column.number(row)? {
        r if r > -1.0 => Ok(r),
        r => Err(column.refuse(row, format!("a load ratio of {r} is not above -1"))),
    }
}

fn must_have_rows(table: &Table, rows: usize, other: &str) -> Result<(), Failure> {
    match table.rows() {
        found if found == rows => Ok(()),
        found => Err(table.refuse(format!("{found} rows, but {other} has {rows}"))),
    }
}
