//! Back-EMF maps of known faults: simulated, or those of a dataset.

use diagnosis::TrainingMap;
use domain::FaultVector;
use ema::{
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map},
};
use numerics::Stream;
use rayon::prelude::*;

use super::TrainError;
use crate::Dataset;

/// Simulated time of a map, s.
const DURATION_S: f64 = 2.0;

/// One map per fault vector: LF1 under the acquisition's motion, HF under random command and load.
pub fn simulate(
    motor: &Motor,
    model: Model,
    faults: &[FaultVector],
    stream: &Stream,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<TrainingMap>, TrainError> {
    let map = |(index, faults): (usize, &FaultVector)| {
        let manoeuvre = match model {
            Model::LowFidelity1 | Model::LowFidelity1Thesis => Manoeuvre::acquisition(),
            Model::HighFidelity => Manoeuvre::operating(&mut stream.substream(index as u64)),
        };
        let map = simulate_one(motor, model, faults, &manoeuvre);
        done();
        map
    };
    faults.par_iter().enumerate().map(map).collect()
}

/// The maps of a dataset in units of k_nom. Where a load ratio is missing a mean stands for the points, the
/// points' mean for the mean, and zero for both.
pub fn of_dataset(dataset: &Dataset, k_nom: f64) -> Vec<TrainingMap> {
    let map = |(index, (values, faults)): (usize, (&Vec<f64>, &FaultVector))| {
        let mean_r = dataset.mean_load_ratios.as_ref().map(|means| means[index]);
        let r = match (&dataset.load_ratios, mean_r) {
            (Some(ratios), _) => ratios[index].clone(),
            (None, mean_r) => vec![mean_r.unwrap_or(0.0); values.len()],
        };
        TrainingMap {
            y: values.iter().map(|y| y / k_nom).collect(),
            mean_r: mean_r.unwrap_or_else(|| r.iter().sum::<f64>() / r.len() as f64),
            r,
            faults: faults.clone(),
        }
    };
    dataset.maps.iter().zip(&dataset.faults).enumerate().map(map).collect()
}

fn simulate_one(
    motor: &Motor,
    model: Model,
    faults: &FaultVector,
    manoeuvre: &Manoeuvre,
) -> Result<TrainingMap, TrainError> {
    let electrical = ElectricalFaults::try_from(faults).expect("importance samples are faults");
    let map = simulate_map(model, motor, &electrical, manoeuvre, &Settings::new(model, DURATION_S));
    let incomplete = |bin| TrainError::Incomplete { bin, faults: faults.clone() };
    let complete = |values: &[Option<f64>]| -> Result<Vec<f64>, TrainError> {
        values.iter().enumerate().map(|(bin, value)| value.ok_or_else(|| incomplete(bin))).collect()
    };
    Ok(TrainingMap {
        y: complete(&map.y)?,
        r: complete(&map.r)?,
        mean_r: map.mean_r.ok_or_else(|| incomplete(0))?,
        faults: faults.clone(),
    })
}
