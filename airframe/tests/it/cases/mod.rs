//! Flight cases, parameters and expected results from files.
#![allow(dead_code, reason = "a benchmark uses its part")]

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use airframe::{
    load_estimator::{FlightEnvelope, LoadEstimator},
    load_parameters::LoadParameters,
    products::{Products, flight_products, sea_level_airspeed_m_s},
};
use domain::{AirData, Strain};

/// The folder of the prototype's cases.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/loads")
}

/// A CSV table by column.
pub struct Table(HashMap<String, Vec<String>>);

impl Table {
    pub fn open(file: &Path) -> Self {
        let mut reader = csv::Reader::from_path(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let header: Vec<String> = reader.headers().expect("a header").iter().map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); header.len()];
        for record in reader.records() {
            for (column, field) in columns.iter_mut().zip(&record.expect("a record")) {
                column.push(field.to_owned());
            }
        }
        Self(header.into_iter().zip(columns).collect())
    }

    pub fn text(&self, name: &str) -> &[String] {
        self.0.get(name).unwrap_or_else(|| panic!("column {name} is missing"))
    }

    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.text(name).iter().map(|text| text.parse().unwrap_or_else(|_| panic!("{name}: {text}"))).collect()
    }

    /// Columns `<prefix>0`, ... with `digits` digits, as rows.
    pub fn rows(&self, prefix: &str, digits: usize, n: usize) -> Vec<Vec<f64>> {
        let columns: Vec<_> = (0..n).map(|i| self.numbers(&format!("{prefix}{i:0digits$}"))).collect();
        (0..columns[0].len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
    }
}

/// What an aircraft sends.
#[derive(Debug, Clone)]
pub struct Case {
    pub air_data: AirData,
    pub strain: Strain,
}

/// What is expected of a case.
#[derive(Debug, Clone)]
pub struct Expected {
    /// Flap moment, aileron moment, their standard deviations, N m.
    pub numbers: [f64; 4],
    pub excluded: Vec<u8>,
}

pub fn parameters(folder: &Path, set: &str) -> LoadParameters {
    let file = folder.join(format!("{set}_params.json"));
    serde_json::from_slice(&fs::read(&file).expect("parameters")).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

pub fn estimator(parameters: &LoadParameters, envelope: Option<FlightEnvelope>) -> LoadEstimator {
    let configuration = parameters.configuration().expect("parameters that belong together");
    LoadEstimator::new(configuration, parameters.settings(), envelope).expect("a valid configuration")
}

pub fn cases(table: &Table) -> Vec<Case> {
    let [q, alpha, p, flap, aileron] =
        ["q_meas", "alpha_meas", "p_meas", "delta_f_meas", "delta_a_meas"].map(|name| table.numbers(name));
    let some = |row: Vec<f64>| row.into_iter().map(Some).collect::<Vec<_>>();
    let peaks = table.rows("lambda_nm_", 2, 12).into_iter().zip(table.rows("lambdaT_nm_", 1, 4));
    peaks
        .enumerate()
        .map(|(i, (strain, temperature))| Case {
            air_data: AirData {
                dynamic_pressure_pa: q[i],
                airspeed_m_s: sea_level_airspeed_m_s(q[i]),
                angle_of_attack_rad: alpha[i],
                roll_rate_rad_s: p[i],
                flap_rad: flap[i],
                aileron_rad: aileron[i],
            },
            strain: Strain { wavelengths_nm: some(strain), temperature_wavelengths_nm: some(temperature) },
        })
        .collect()
}

pub fn expected(table: &Table) -> Vec<Expected> {
    let columns = ["M_f_hat", "M_a_hat", "sigma_f", "sigma_a"].map(|name| table.numbers(name));
    let excluded =
        |text: &String| text.split(';').filter(|i| !i.is_empty()).map(|i| i.parse().expect("an index")).collect();
    let lists = table.text("excluded").iter().map(excluded);
    lists.enumerate().map(|(i, excluded)| Expected { numbers: columns.each_ref().map(|c| c[i]), excluded }).collect()
}

/// z of a table's true flight conditions.
pub fn true_products(table: &Table) -> Vec<Products> {
    let [q, v, alpha, p, flap, aileron] =
        ["q_Pa", "V_mps", "alpha_rad", "p_radps", "delta_f_rad", "delta_a_rad"].map(|name| table.numbers(name));
    let condition = |i: usize| AirData {
        dynamic_pressure_pa: q[i],
        airspeed_m_s: v[i],
        angle_of_attack_rad: alpha[i],
        roll_rate_rad_s: p[i],
        flap_rad: flap[i],
        aileron_rad: aileron[i],
    };
    (0..q.len()).map(|i| flight_products(&condition(i))).collect()
}

/// `share`-quantile of magnitudes: the order statistic above it.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[(share * sorted.len() as f64) as usize]
}
