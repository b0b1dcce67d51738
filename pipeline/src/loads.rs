//! What a bundle knows of loads: how to read a tail that brings no sensor configuration of its own, what a motor tells
//! where no strain does, and what load and temperature are measured against in u = [1, |M_h|/M_ref, (T - T_ref)/T_scale].

use airframe::{
    flight::{Flight, FlightSettings, HingeMoments},
    load_estimator::{EstimatorSettings, FlightEnvelope, LoadEstimator, LoadReading},
    reference::{MEAN_HINGE_MOMENTS, reference_configuration},
    strain::Layout,
};
use domain::{Estimate, HingeLoad, Invalid, SensorConfiguration, Upload, sensor_configuration::Surface};
use ema::{closed_form::healthy_load_ratio, faults::ElectricalFaults, wear::AMBIENT_TEMPERATURE};
use numerics::Stream;
use prognosis::MotorCalibration;
use serde::{Deserialize, Serialize};

/// Simulated flights from which the envelope is learned.
const ENVELOPE_FLIGHTS: u64 = 500;

/// Default sensor configuration, flights to expect, and references.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadModel {
    /// The sensors of tails that have none of their own.
    pub sensor_configuration: SensorConfiguration,
    /// The flight conditions to expect of an upload without air data.
    pub envelope: FlightEnvelope,
    /// What is 1, and what is 0, of load and temperature.
    pub references: LoadReferences,
    /// What the motor tells of its load, unless past lives have taught it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<MotorCalibration>,
}

/// References of u.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadReferences {
    /// M_ref of actuators of flaps, N m.
    pub flap_nm: f64,
    /// M_ref of actuators of ailerons, N m.
    pub aileron_nm: f64,
    /// T_ref, degrees Celsius.
    pub temperature_c: f64,
    /// T_scale, K.
    pub temperature_scale_k: f64,
}

impl LoadModel {
    /// The reference wing with axial and 45-degree gratings, in the air of simulated flights.
    pub fn reference(seed: u64) -> Self {
        let sensor_configuration = reference_configuration(Layout::D);
        let flights = Stream::new(seed, &["envelope"]);
        let products: Vec<_> = (0..ENVELOPE_FLIGHTS)
            .map(|i| Flight::draw(&sensor_configuration, &FlightSettings::as_modelled(), None, &flights.substream(i)))
            .map(|flight| flight.products)
            .collect();
        let HingeMoments { flap_nm, aileron_nm } = MEAN_HINGE_MOMENTS;
        Self {
            sensor_configuration,
            envelope: FlightEnvelope::from_cases(&products).expect("more than one flight"),
            references: LoadReferences {
                flap_nm,
                aileron_nm,
                temperature_c: AMBIENT_TEMPERATURE.zero_c,
                temperature_scale_k: AMBIENT_TEMPERATURE.scale_k,
            },
            motor: None,
        }
    }

    /// Ready to read uploads by a tail's own configuration, or by the default one.
    pub fn estimator(&self, own: Option<&SensorConfiguration>) -> Result<LoadEstimator, Invalid> {
        let configuration = own.unwrap_or(&self.sensor_configuration).clone();
        LoadEstimator::new(configuration, EstimatorSettings::default(), Some(self.envelope))
    }

    /// The load that an upload tells of its actuator; `None` where it tells none.
    pub fn load(&self, estimator: &LoadEstimator, upload: &Upload) -> Option<HingeLoad> {
        let surface = estimator.configuration().positions.get(&upload.position)?.surface;
        let reference_nm = match surface {
            Surface::Flap => self.references.flap_nm,
            Surface::Aileron => self.references.aileron_nm,
            Surface::None => return None,
        };
        let estimate = estimator.estimate(&LoadReading::from(upload))?;
        estimator.hinge_load(&estimate, &upload.position, reference_nm)
    }

    /// An ambient temperature as the propagation of damage takes it.
    pub fn temperature(&self, temperature_c: f64) -> f64 {
        self.references.temperature(temperature_c)
    }
}

impl LoadReferences {
    /// An ambient temperature relative to its reference and scale.
    pub fn temperature(&self, temperature_c: f64) -> f64 {
        (temperature_c - self.temperature_c) / self.temperature_scale_k
    }
}

/// Who tells the load of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadTeller {
    /// The wing: strain, air data or both.
    Wing,
    /// The motor, by its calibration.
    Motor,
}

/// The load of the flight of an estimate, abs(M_h) over the reference moment, and who tells it: the wing if it does, else the
/// motor if its calibration is known; `None` where neither does.
pub fn known_load(estimate: &Estimate, motor: Option<&MotorCalibration>) -> Option<(f64, LoadTeller)> {
    if let Some(load) = &estimate.load {
        return Some((load.ratio, LoadTeller::Wing));
    }
    Some((motor?.load(motor_ratio(estimate)?), LoadTeller::Motor))
}

/// Mean size of the load ratio of an estimate as its windings would show it without shorts; as measured where there is no
/// diagnosis.
pub fn motor_ratio(estimate: &Estimate) -> Option<f64> {
    let ratio = estimate.load_ratio?;
    let faults = estimate.usable().and_then(|diagnosis| ElectricalFaults::try_from(&diagnosis.fault_vector).ok());
    Some(faults.map_or(ratio, |faults| healthy_load_ratio(&faults, ratio)))
}
