//! The instrumented wing of a simulated aircraft: one steady flight condition per upload, in which the
//! surface loads its actuator as the hidden truth says.

use airframe::{
    Flight, FlightSettings, HingeTarget, Layout,
    reference::{MEAN_HINGE_MOMENTS, reference_configuration},
};
use domain::{
    Position, SensorConfiguration,
    sensor_configuration::{HingePosition, Surface},
};
use numerics::Stream;

/// Temperature at which the gratings show their reference wavelengths, degrees Celsius.
const REFERENCE_TEMPERATURE_C: f64 = 20.0;
/// Gratings differ from the air around them by so much at most, K.
const TEMPERATURE_SPREAD_K: f64 = 3.0;
/// Share of flights with a strain grating that has failed.
const FAILURE_PROBABILITY: f64 = 0.02;

/// The wing that all aircraft of the fleet have.
#[derive(Debug)]
pub struct InstrumentedWing {
    configuration: SensorConfiguration,
}

impl InstrumentedWing {
    /// The reference wing.
    pub fn reference() -> Self {
        Self { configuration: reference_configuration(Layout::D) }
    }

    /// A flight in which the actuator at `position` works against `load` times the mean moment.
    pub fn fly(&self, position: &Position, load: f64, ambient_c: f64, stream: &Stream) -> Flight {
        let rise_k = ambient_c - REFERENCE_TEMPERATURE_C;
        let settings = FlightSettings {
            gain_noise: self.configuration.gain_noise,
            temperature_rise_k: [rise_k - TEMPERATURE_SPREAD_K, rise_k + TEMPERATURE_SPREAD_K],
            failure_probability: FAILURE_PROBABILITY,
            ..FlightSettings::hard()
        };
        let target = self.configuration.positions.get(position).and_then(|position| target(*position, load));
        Flight::draw(&self.configuration, &settings, target.as_ref(), stream)
    }
}

fn target(position: HingePosition, load: f64) -> Option<HingeTarget> {
    let mean_nm = match position.surface {
        Surface::Flap => MEAN_HINGE_MOMENTS.flap_nm,
        Surface::Aileron => MEAN_HINGE_MOMENTS.aileron_nm,
        Surface::None => return None,
    };
    Some(HingeTarget { position, size_nm: load.max(0.0) * mean_nm })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_load_their_actuators_as_the_hidden_truth_says() {
        let wing = InstrumentedWing::reference();
        for (name, mean_nm) in [("FLAP-L", MEAN_HINGE_MOMENTS.flap_nm), ("AIL-R", MEAN_HINGE_MOMENTS.aileron_nm)] {
            let position: Position = name.parse().unwrap();
            for (number, load) in [0.3, 0.7, 1.0, 1.4, 1.8].into_iter().enumerate() {
                let flight = wing.fly(&position, load, -20.0, &Stream::new(1, &[name]).substream(number as u64));
                let moment_nm = flight.hinge_moment_nm(wing.configuration.positions[&position]).unwrap();
                assert!((moment_nm.abs() - load * mean_nm).abs() < 1e-6 * mean_nm, "{name}, {load}: {moment_nm}");
            }
        }
    }
}
