//! What the motor tells of its load, learned from simulated strokes of units of every age.
//!
//! - What: the line between the load ratio that a motor shows in a measuring stroke and the load of its surface.
//! - Update rule: units of simulated lives, at ages from new to failed, make strokes of the high-fidelity model under random loads;
//!   the windings are seen as a diagnosis sees them, the load as the wing does.
//! - Requirements: a linkage that is laid out for the mean moment of its surface, gears as they usually are.

use domain::{FaultVector, Mask};
use ema::{
    back_emf::Awaited,
    closed_form::healthy_load_ratio,
    faults::ElectricalFaults,
    lf2::Parameters,
    life::simulate_life,
    manoeuvre::{Manoeuvre, Signal},
    motor::Motor,
    simulation::{Model, Settings, simulate_map_until},
    transmission::{USUAL_EFFICIENCY, USUAL_OUTPUT_NM},
    wear_law::Regime,
};
use numerics::Stream;
use prognosis::{LoadPair, MotorCalibration};
use rayon::prelude::*;

/// Units, and the flights of each.
const UNITS: u64 = 12;
const FLIGHTS: usize = 40;
/// Loads flown.
const LOADS: [f64; 2] = [0.3, 2.2];
/// Relative error of the load that the wing tells.
const WING_ERROR: f64 = 0.015;
/// Passes that a sample takes, from when the speed of a stroke has settled, and the longest stroke.
const PASSES: u32 = 10;
const SETTLED_S: f64 = 0.04;
const LONGEST_S: f64 = 1.5;

/// The calibration of a motor behind usual gears.
pub fn motor_calibration(motor: &Motor, mask: &Mask, seed: u64) -> Option<MotorCalibration> {
    let motor = Motor { opposing_efficiency: motor.opposing_efficiency.min(USUAL_EFFICIENCY), ..motor.clone() };
    let assessment = Parameters::assessment_of(&motor);
    let unit = |unit: u64| {
        let life = simulate_life(&assessment, seed, unit, Regime::Constant);
        let fly = |flight: usize| {
            let age = flight * (life.states.len() - 1) / (FLIGHTS - 1);
            let stream = Stream::new(seed, &["motor", &unit.to_string()]).substream(flight as u64);
            fly(&motor, [&life.states[age], &life.observations[age]], mask, stream)
        };
        (0..FLIGHTS).filter_map(fly).collect::<Vec<_>>()
    };
    MotorCalibration::fit(&(0..UNITS).into_par_iter().map(unit).collect::<Vec<_>>())
}

/// A flight with a stroke of a motor with faults, true and diagnosed; `None` where it gets nowhere.
fn fly(motor: &Motor, [faults, seen]: [&FaultVector; 2], mask: &Mask, mut stream: Stream) -> Option<LoadPair> {
    let load = LOADS[0] + (LOADS[1] - LOADS[0]) * stream.uniform();
    let load_nm = motor.transmission().load_nm(load * USUAL_OUTPUT_NM);
    let stroke = Manoeuvre::stroke(motor, Signal::constant(load_nm), &mut stream);
    let settings = Settings::new(Model::HighFidelity, LONGEST_S);
    let awaited = Awaited { bins: mask.bins(), passes: PASSES, from_s: SETTLED_S };
    let faults = ElectricalFaults::try_from(faults).ok()?;
    let map = simulate_map_until(Model::HighFidelity, motor, &faults, &stroke, &settings, awaited);
    let ratios: Vec<f64> = mask.bins().iter().filter_map(|&bin| map.r[bin]).collect();
    let mean = ratios.iter().map(|ratio| ratio.abs()).sum::<f64>() / ratios.len() as f64;
    let seen = ElectricalFaults::try_from(seen).ok()?;
    let seen_load = load * (1.0 + WING_ERROR * stream.normal());
    (!ratios.is_empty()).then(|| LoadPair { load: seen_load, ratio: healthy_load_ratio(&seen, mean) })
}
