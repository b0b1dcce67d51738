//! Back-EMF maps of known faults.

use diagnosis::TrainingMap;
use domain::{FaultVector, Stream};
use ema::{
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map},
};
use rayon::prelude::*;

use super::TrainError;

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
