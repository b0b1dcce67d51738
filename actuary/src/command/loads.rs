//! `actuary loads`: hinge moments of flight cases from strain and air data.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use airframe::{HingeMoment, LoadEstimator, LoadParameters, LoadReading, products::sea_level_airspeed_m_s};
use anyhow::Result;
use clap::Args;
use domain::{
    AirData, LoadSource, Strain, range,
    sensor_configuration::{Side, Surface},
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};

use crate::{
    exit::Failure,
    files::{
        output::OutputFile,
        table::{Column, Table},
    },
    say::note,
};

/// Estimate the hinge moments of the right wing's flap and aileron from wavelengths and air data.
///
/// Gratings that contradict the rest are left out. When more than two are missing or bad, or the rest
/// disagree too, the air data alone answer.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  actuary loads --params D_params.json --cases D_valid.csv --out loads.csv

Reads the columns id, q_meas (Pa), alpha_meas (rad), p_meas (rad/s), delta_f_meas, delta_a_meas (rad),
lambda_nm_00..11 and lambdaT_nm_0..3 (nm), and passes over all others. A field that is empty or says NaN, NA or null is missing.

Writes id, M_f_hat, M_a_hat, sigma_f, sigma_a (N m), and excluded: the gratings left out, 0-based, in the order
of their exclusion, joined by ';'. A case that tells no load has empty fields. Air data with a gap count as
missing; without them the strain alone answers if the parameters hold an envelope: {\"mean\": [5], \"covariance\": [5][5]}
of [q, q alpha, q p/V, q delta_f, q delta_a].")]
pub struct Arguments {
    /// Sensor maps, reference wavelengths and noise (JSON).
    #[arg(long, value_name = "FILE")]
    params: PathBuf,
    /// The flight cases.
    #[arg(long, value_name = "FILE")]
    cases: PathBuf,
    /// The table to write; an existing one is replaced once the new one is complete.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Estimates every case and writes the table.
pub fn run(arguments: &Arguments) -> Result<()> {
    let estimator = read_estimator(&arguments.params)?;
    let table = Table::open(&arguments.cases)?;
    let cases = Cases::new(&table)?;
    let out = OutputFile::new(&arguments.out)?;
    let rows = (0..table.rows()).map(|row| Ok(estimate(&estimator, &cases.case(row)?))).collect::<Result<Vec<_>>>()?;
    let ids = cases.id;
    out.write(|writer| write(writer, ids, &rows))?;
    let count = |holds: fn(&Load) -> bool| rows.iter().flatten().filter(|load| holds(load)).count();
    note!(
        "{} cases: {} with gratings left out, {} by air data alone, {} without a load",
        rows.len(),
        count(|load| !load.excluded.is_empty()),
        count(|load| load.source == LoadSource::AirData),
        rows.iter().filter(|row| row.is_none()).count(),
    );
    Ok(())
}

fn read_estimator(file: &Path) -> Result<LoadEstimator, Failure> {
    let refuse = |reason: String| Failure::BadInput(format!("{}: {reason}", file.display()));
    let text = fs::read(file).map_err(|error| refuse(error.to_string()))?;
    let parameters: LoadParameters = domain::json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
    let configuration = parameters.configuration().map_err(|error| refuse(error.to_string()))?;
    LoadEstimator::new(configuration, parameters.settings(), parameters.envelope)
        .map_err(|invalid| refuse(invalid.to_string()))
}

/// The columns of a table of flight cases.
struct Cases<'a> {
    id: Column<'a>,
    /// Dynamic pressure, angle of attack, roll rate, flap, aileron.
    air_data: [Column<'a>; 5],
    wavelengths_nm: Vec<Column<'a>>,
    temperature_wavelengths_nm: Vec<Column<'a>>,
}

/// What an aircraft sends of one case.
struct Case {
    air_data: Option<AirData>,
    strain: Strain,
}

impl<'a> Cases<'a> {
    fn new(table: &'a Table) -> Result<Self, Failure> {
        let strain: Vec<_> = (0..STRAIN_SENSORS).map(|i| format!("lambda_nm_{i:02}")).collect();
        let temperature: Vec<_> = (0..TEMPERATURE_SENSORS).map(|i| format!("lambdaT_nm_{i}")).collect();
        Ok(Self {
            id: table.column("id")?,
            air_data: [
                table.column("q_meas")?,
                table.column("alpha_meas")?,
                table.column("p_meas")?,
                table.column("delta_f_meas")?,
                table.column("delta_a_meas")?,
            ],
            wavelengths_nm: table.columns_of(&strain)?,
            temperature_wavelengths_nm: table.columns_of(&temperature)?,
        })
    }

    fn case(&self, row: usize) -> Result<Case, Failure> {
        let peaks = |columns: &[Column]| {
            columns.iter().map(|one| one.optional_within(row, range::WAVELENGTH)).collect::<Result<_, _>>()
        };
        Ok(Case {
            air_data: self.air_data(row)?,
            strain: Strain {
                wavelengths_nm: peaks(&self.wavelengths_nm)?,
                temperature_wavelengths_nm: peaks(&self.temperature_wavelengths_nm)?,
            },
        })
    }

    /// All five, or none.
    fn air_data(&self, row: usize) -> Result<Option<AirData>, Failure> {
        let ranges = [range::DYNAMIC_PRESSURE, range::ANGLE, range::ROLL_RATE, range::ANGLE, range::ANGLE];
        let fields = self.air_data.iter().zip(ranges).map(|(column, range)| column.optional_within(row, range));
        let fields = fields.collect::<Result<Vec<_>, _>>()?;
        let [Some(q), Some(alpha), Some(p), Some(flap), Some(aileron)] = fields[..] else { return Ok(None) };
        Ok(Some(AirData {
            dynamic_pressure_pa: q,
            airspeed_m_s: sea_level_airspeed_m_s(q),
            angle_of_attack_rad: alpha,
            roll_rate_rad_s: p,
            flap_rad: flap,
            aileron_rad: aileron,
        }))
    }
}

/// What is written of a case.
struct Load {
    flap: HingeMoment,
    aileron: HingeMoment,
    source: LoadSource,
    excluded: Vec<u8>,
}

fn estimate(estimator: &LoadEstimator, case: &Case) -> Option<Load> {
    let reading = LoadReading { strain: Some(&case.strain), air_data: case.air_data.as_ref(), recorded_at: None };
    let estimate = estimator.estimate(&reading)?;
    Some(Load {
        flap: estimator.hinge_moment(&estimate, Surface::Flap, Side::Right)?,
        aileron: estimator.hinge_moment(&estimate, Surface::Aileron, Side::Right)?,
        source: estimate.source,
        excluded: estimate.excluded_sensors,
    })
}

fn write(writer: &mut dyn Write, ids: Column, rows: &[Option<Load>]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(["id", "M_f_hat", "M_a_hat", "sigma_f", "sigma_a", "excluded"])?;
    for (row, load) in rows.iter().enumerate() {
        let [flap, aileron, sigma_flap, sigma_aileron, excluded] = load.as_ref().map(fields).unwrap_or_default();
        table.write_record([ids.text(row), &flap, &aileron, &sigma_flap, &sigma_aileron, &excluded])?;
    }
    table.flush()
}

fn fields(Load { flap, aileron, excluded, .. }: &Load) -> [String; 5] {
    let numbers = [flap.moment_nm, aileron.moment_nm, flap.sigma_nm, aileron.sigma_nm];
    let [m_f, m_a, sigma_f, sigma_a] = numbers.map(|number| number.to_string());
    [m_f, m_a, sigma_f, sigma_a, excluded.iter().map(u8::to_string).collect::<Vec<_>>().join(";")]
}
