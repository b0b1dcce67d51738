//! The instrumented wing of a simulated aircraft and its elevator: one steady flight condition per upload, in which the
//! surface loads its actuator as the hidden truth says.

use airframe::{Doublet, Flight, FlightSettings, HingeTarget, Layout, reference::reference_configuration};
use domain::{Position, SensorConfiguration};
use ema::manoeuvre::Signal;
use numerics::Stream;

use crate::{
    instrument::OutputTorque,
    linkage::{mean_moment_nm, output_per_moment},
};

/// Temperature at which the gratings show their reference wavelengths, degrees Celsius.
const REFERENCE_TEMPERATURE_C: f64 = 20.0;
/// Gratings differ from the air around them by so much at most, K.
const TEMPERATURE_SPREAD_K: f64 = 3.0;
/// Share of flights with a strain grating that has failed.
const FAILURE_PROBABILITY: f64 = 0.02;
/// The elevator's doublet that makes its mean moment, degrees.
const MEAN_DOUBLET_DEG: f64 = 2.0;
/// Interval of the elevator's moments, s.
const ELEVATOR_STEP_S: f64 = 1e-2;
/// When the doublet turns round, and how many moments after it count, in steps.
const ELEVATOR_TURN: usize = 100;
const ELEVATOR_STEPS: usize = 25;

/// The wing and the elevator that all aircraft of the fleet have.
#[derive(Debug)]
pub struct InstrumentedWing {
    configuration: SensorConfiguration,
    /// Hinge moments of the elevator after the turn of a doublet that makes its mean moment, N m.
    elevator_nm: Vec<f64>,
}

/// What an aircraft sends of a flight, and the hidden load of an actuator.
#[derive(Debug)]
pub struct Sortie {
    /// The flight of the wing.
    pub flight: Flight,
    /// The hinge moment of the actuator's surface during its measuring stroke, N m.
    pub hinge_nm: Signal,
    /// Its mean.
    pub mean_hinge_nm: f64,
    /// Torque at the actuator's output per hinge moment.
    pub output_per_moment: f64,
}

impl InstrumentedWing {
    /// The reference wing, and a fighter's elevator.
    pub fn reference() -> Self {
        let half_s = ELEVATOR_TURN as f64 * ELEVATOR_STEP_S;
        let doublet = Doublet { amplitude_deg: -MEAN_DOUBLET_DEG, from_s: 0.0, half_s };
        let elevator_nm =
            doublet.hinge_moments_nm(ELEVATOR_STEP_S, ELEVATOR_TURN + ELEVATOR_STEPS).split_off(ELEVATOR_TURN);
        Self { configuration: reference_configuration(Layout::D), elevator_nm }
    }

    /// A flight in which the actuator at `position` works against `load` times the mean moment of its surface; that of an
    /// elevator, which no grating sees, answers to a doublet.
    pub fn fly(&self, position: &Position, load: f64, ambient_c: f64, stream: &Stream) -> Sortie {
        let rise_k = ambient_c - REFERENCE_TEMPERATURE_C;
        let settings = FlightSettings {
            gain_noise: self.configuration.gain_noise,
            temperature_rise_k: [rise_k - TEMPERATURE_SPREAD_K, rise_k + TEMPERATURE_SPREAD_K],
            failure_probability: FAILURE_PROBABILITY,
            ..FlightSettings::hard()
        };
        let (load, hinge) = (load.max(0.0), self.configuration.positions.get(position).copied());
        let Some((hinge, mean_nm)) = hinge.and_then(|hinge| Some((hinge, mean_moment_nm(hinge)?))) else {
            return self.elevate(load, Flight::draw(&self.configuration, &settings, None, stream), stream);
        };
        let target = HingeTarget { position: hinge, size_nm: load * mean_nm };
        let flight = Flight::draw(&self.configuration, &settings, Some(&target), stream);
        let moment_nm = flight.hinge_moment_nm(hinge).expect("the surface has a moment");
        let output_per_moment = output_per_moment(mean_nm);
        Sortie { flight, hinge_nm: Signal::constant(moment_nm), mean_hinge_nm: moment_nm, output_per_moment }
    }

    /// The same flight for the elevator's actuator, which is loaded by a doublet up or down.
    fn elevate(&self, load: f64, flight: Flight, stream: &Stream) -> Sortie {
        const DOUBLET: u64 = 100;
        let up = stream.substream(DOUBLET).uniform() < 0.5;
        let size = if up { -load } else { load };
        let mean_nm = self.elevator_nm.iter().sum::<f64>() / self.elevator_nm.len() as f64;
        let moments_nm = self.elevator_nm.iter().map(|moment_nm| size * moment_nm).collect();
        Sortie {
            flight,
            hinge_nm: Signal::series(ELEVATOR_STEP_S, moments_nm),
            mean_hinge_nm: size * mean_nm,
            output_per_moment: output_per_moment(mean_nm),
        }
    }
}

impl Sortie {
    /// The torque at the actuator's output, through the linkage.
    pub fn output_torque(&self) -> OutputTorque {
        OutputTorque {
            course_nm: self.hinge_nm.scaled(self.output_per_moment),
            mean_nm: self.output_per_moment * self.mean_hinge_nm,
        }
    }
}

#[cfg(test)]
mod tests {
    use airframe::reference::MEAN_HINGE_MOMENTS;

    use super::*;

    #[test]
    fn surfaces_load_their_actuators_as_the_hidden_truth_says() {
        let wing = InstrumentedWing::reference();
        for (name, mean_nm) in [("FLAP-L", MEAN_HINGE_MOMENTS.flap_nm), ("AIL-R", MEAN_HINGE_MOMENTS.aileron_nm)] {
            let position: Position = name.parse().unwrap();
            for (number, load) in [0.3, 0.7, 1.0, 1.4, 1.8].into_iter().enumerate() {
                let sortie = wing.fly(&position, load, -20.0, &Stream::new(1, &[name]).substream(number as u64));
                let moment_nm = sortie.flight.hinge_moment_nm(wing.configuration.positions[&position]).unwrap();
                assert_eq!(sortie.mean_hinge_nm, moment_nm, "one flight");
                assert!((moment_nm.abs() - load * mean_nm).abs() < 1e-6 * mean_nm, "{name}, {load}: {moment_nm}");
            }
        }
    }

    /// The moment just after the reversal of a two-degree doublet is that of the reference, and its mean is load 1.
    #[test]
    fn an_elevator_is_loaded_by_doublets_that_no_grating_sees() {
        let wing = InstrumentedWing::reference();
        assert!((wing.elevator_nm[1] - 1060.2877).abs() < 1e-3, "{}", wing.elevator_nm[1]);
        let position: Position = "ELEV-L".parse().unwrap();
        let fly = |load: f64| wing.fly(&position, load, -20.0, &Stream::new(1, &["elevator"]));
        let (easy, hard) = (fly(0.5), fly(1.5));
        assert_eq!(easy.flight, hard.flight, "the wing flies the same flight");
        assert!((hard.output_torque().mean_nm / easy.output_torque().mean_nm - 3.0).abs() < 1e-12);
        assert!((hard.output_torque().mean_nm.abs() - 1.5 * 72.0).abs() < 1e-9, "{}", hard.output_torque().mean_nm);
        let stroke: Vec<f64> =
            (0..25).map(|i| hard.output_torque().course_nm.at(f64::from(i) * ELEVATOR_STEP_S)).collect();
        assert!((stroke.iter().sum::<f64>() / 25.0 - hard.output_torque().mean_nm).abs() < 1e-9);
    }
}
