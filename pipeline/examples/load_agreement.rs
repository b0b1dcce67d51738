//! How well motor and wing agree, and how soon their disagreement is told: the figures of docs/loads.md.
//!
//! Flights of the reference wing, with gusts, surfaces off their model and gratings that fail, are read by the load estimator;
//! the same hinge moment loads the high-fidelity motor in a measuring stroke. `cargo run --release --example load_agreement`
//! prints the figures; with a file's name it writes the default bundle with its motor calibrated anew there.

use airframe::{
    Flight, FlightSettings, HingeTarget,
    load_estimator::{EstimatorSettings, LoadEstimator, LoadReading},
    reference::MEAN_HINGE_MOMENTS,
};
use domain::{Mask, SensorConfiguration};
use ema::{
    back_emf::Awaited,
    faults::ElectricalFaults,
    manoeuvre::{Manoeuvre, Signal},
    motor::Motor,
    simulation::{Model as Physics, Settings, simulate_map_until},
    transmission::{USUAL_EFFICIENCY, USUAL_OUTPUT_NM},
};
use numerics::Stream;
use pipeline::{Bundle, LoadModel, motor_calibration};
use prognosis::{JointFlight, LoadAgreement, MotorCalibration, load_agreement::ChangeKind};
use rayon::prelude::*;

/// Healthy units, units of each kind of fault, and flights of each.
const HEALTHY: u64 = 200;
const FAULTY: u64 = 20;
const FLIGHTS: u64 = 100;
/// Flight at which a fault begins.
const ONSET: u64 = 50;

/// What is wrong with a unit from some flight on.
#[derive(Clone, Copy, Default)]
struct Wrong {
    /// Efficiency lost, relative.
    efficiency: f64,
    /// Dry friction more, relative.
    friction: f64,
    /// Strain that every grating shows too much.
    tare: f64,
    /// The strain is read as that of the aileron.
    swapped: bool,
}

struct Bench {
    loads: LoadModel,
    mask: Mask,
}

impl Bench {
    fn unit(&self, number: u64, wrong: Wrong) -> Vec<JointFlight> {
        let stream = Stream::new(21, &["unit"]).substream(number);
        let mut level = Stream::new(22, &["level"]).substream(number);
        let mean = libm::exp(0.175 * level.normal());
        let mut wander = 0.0;
        let mut fly = |flight: u64| {
            wander = 0.9 * wander + 0.15 * (1.0_f64 - 0.81).sqrt() * level.normal();
            let wrong = if flight < ONSET { Wrong::default() } else { wrong };
            self.flight(mean * libm::exp(wander), wrong, &stream.substream(flight))
        };
        (0..FLIGHTS).filter_map(&mut fly).collect()
    }

    /// What wing and motor tell of one flight of the left flap.
    fn flight(&self, load: f64, wrong: Wrong, stream: &Stream) -> Option<JointFlight> {
        let mut true_wing = self.loads.sensor_configuration.clone();
        let place = true_wing.positions[&"FLAP-L".parse().ok()?];
        let target = HingeTarget { position: place, size_nm: load * MEAN_HINGE_MOMENTS.flap_nm };
        true_wing.strain_gratings.iter_mut().for_each(|grating| grating.tare += wrong.tare);
        let settings =
            FlightSettings { gain_noise: true_wing.gain_noise, failure_probability: 0.02, ..FlightSettings::hard() };
        let flight = Flight::draw(&true_wing, &settings, Some(&target), stream);
        let estimator = self.estimator(&self.loads.sensor_configuration);
        let reading = LoadReading { strain: Some(&flight.strain), air_data: Some(&flight.air_data), recorded_at: None };
        let position = if wrong.swapped { "AIL-L" } else { "FLAP-L" };
        let reference_nm = if wrong.swapped { MEAN_HINGE_MOMENTS.aileron_nm } else { MEAN_HINGE_MOMENTS.flap_nm };
        let seen = estimator.hinge_load(&estimator.estimate(&reading)?, &position.parse().ok()?, reference_nm)?;
        let moment_nm = flight.hinge_moment_nm(place)?;
        let ratio = self.stroke(moment_nm / MEAN_HINGE_MOMENTS.flap_nm, wrong, stream)?;
        Some(JointFlight { load: seen.ratio, load_sigma: seen.sigma_nm / reference_nm, ratio })
    }

    fn estimator(&self, configuration: &SensorConfiguration) -> LoadEstimator {
        LoadEstimator::new(configuration.clone(), EstimatorSettings::default(), Some(self.loads.envelope))
            .expect("checked")
    }

    /// Mean size of the load ratio of a healthy motor's stroke under a load.
    fn stroke(&self, load: f64, wrong: Wrong, stream: &Stream) -> Option<f64> {
        let healthy = Motor::default();
        let motor = Motor {
            opposing_efficiency: USUAL_EFFICIENCY * (1.0 - wrong.efficiency),
            dynamic_friction_nm: healthy.dynamic_friction_nm * (1.0 + wrong.friction),
            static_friction_nm: healthy.static_friction_nm * (1.0 + wrong.friction),
            ..healthy
        };
        let load_nm = Signal::constant(motor.transmission().load_nm(load * USUAL_OUTPUT_NM));
        let stroke = Manoeuvre::stroke(&motor, load_nm, &mut stream.substream(7));
        let awaited = Awaited { bins: self.mask.bins(), passes: 10, from_s: 0.04 };
        let settings = Settings::new(Physics::HighFidelity, 1.5);
        let none = ElectricalFaults::default();
        let map = simulate_map_until(Physics::HighFidelity, &motor, &none, &stroke, &settings, awaited);
        let ratios: Vec<f64> = self.mask.bins().iter().filter_map(|&bin| map.r[bin]).collect();
        (!ratios.is_empty()).then(|| ratios.iter().map(|ratio| ratio.abs()).sum::<f64>() / ratios.len() as f64)
    }

    fn units(&self, count: u64, wrong: Wrong) -> Vec<Vec<JointFlight>> {
        (0..count).into_par_iter().map(|number| self.unit(number, wrong)).collect()
    }
}

fn correlation(units: &[Vec<JointFlight>]) -> f64 {
    let all: Vec<&JointFlight> = units.iter().flatten().collect();
    let mean = |of: &dyn Fn(&JointFlight) -> f64| all.iter().map(|flight| of(flight)).sum::<f64>() / all.len() as f64;
    let (x, y) = (mean(&|flight| flight.load), mean(&|flight| flight.ratio));
    let moment = |of: &dyn Fn(f64, f64) -> f64| mean(&|flight| of(flight.load - x, flight.ratio - y));
    moment(&|x, y| x * y) / (moment(&|x, _| x * x) * moment(&|_, y| y * y)).sqrt()
}

/// Told at the end, with which kinds; and the median number of flights behind the onset until it is told.
fn tell(name: &str, units: &[Vec<JointFlight>], motor: &MotorCalibration) {
    let (mut efficiency, mut friction, mut adrift, mut quiet) = (0, 0, 0, 0);
    let (mut sizes, mut delays) = (Vec::new(), Vec::new());
    for flights in units {
        let agreement = LoadAgreement::of(flights, motor).expect("enough flights");
        let largest = agreement.changes.first();
        match (largest.map(|change| change.kind), agreement.adrift_from) {
            (_, Some(_)) => adrift += 1,
            (Some(ChangeKind::Efficiency), _) => efficiency += 1,
            (Some(ChangeKind::Friction), _) => friction += 1,
            (None, None) => quiet += 1,
        }
        sizes.extend(largest.map(|change| change.size));
        let told = |count: &usize| {
            let agreement = LoadAgreement::of(&flights[..*count], motor).expect("enough flights");
            !agreement.changes.is_empty() || agreement.adrift_from.is_some()
        };
        delays.extend((ONSET as usize..=flights.len()).find(told).map(|count| count - ONSET as usize));
    }
    sizes.sort_by(f64::total_cmp);
    delays.sort_unstable();
    println!(
        "{name:<24} of {} units: efficiency {efficiency}, friction {friction}, adrift {adrift}, quiet {quiet}; median size {:.3}, \
         told after {:?} flights (90 %: {:?})",
        units.len(),
        sizes.get(sizes.len() / 2).copied().unwrap_or(f64::NAN),
        delays.get(delays.len() / 2),
        delays.get(delays.len() * 9 / 10),
    );
}

fn main() {
    let mut bundle: Bundle = serde_json::from_slice(include_bytes!("../../models/default.json")).expect("a bundle");
    let mask = bundle.masks()[0].clone();
    let motor =
        motor_calibration(&bundle.maps().expect("reads maps").motor, &mask, 1).expect("the motor follows its load");
    println!("{motor:?}");
    let loads = bundle.loads.as_mut().expect("knows loads");
    if let Some(file) = std::env::args().nth(1) {
        loads.motor = Some(motor.clone());
        std::fs::write(file, bundle.to_bytes()).expect("writable");
        return;
    }
    let bench = Bench { loads: loads.clone(), mask };
    let healthy = bench.units(HEALTHY, Wrong::default());
    println!("correlation of load ratio and load by the wing: {:.4}", correlation(&healthy));
    tell("healthy", &healthy, &motor);
    for (name, wrong) in [
        ("efficiency -15 %", Wrong { efficiency: 0.15, ..Wrong::default() }),
        ("efficiency -10 %", Wrong { efficiency: 0.10, ..Wrong::default() }),
        ("friction +50 %", Wrong { friction: 0.5, ..Wrong::default() }),
        ("tare 30 microstrain", Wrong { tare: 30e-6, ..Wrong::default() }),
        ("tare 100 microstrain", Wrong { tare: 100e-6, ..Wrong::default() }),
        ("another surface", Wrong { swapped: true, ..Wrong::default() }),
    ] {
        tell(name, &bench.units(FAULTY, wrong), &motor);
    }
}
