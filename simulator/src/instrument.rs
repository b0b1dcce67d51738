//! What an aircraft's electronics measure during one flight: samples of the back-EMF map at the mask,
//! with the load ratio, under a random command and load.

use domain::{LoadRatio, Mask};
use ema::{
    back_emf::Awaited,
    closed_form,
    commutation::BINS,
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map_until},
};
use numerics::Stream;

/// Passes of the rotor through every mask point before an upload is complete.
const PASSES: u32 = 10;
/// After this simulated time an upload goes out with what there is, s.
const LONGEST_RUN_S: f64 = 5.0;
/// Standard deviation of a sample, units of k_nom.
pub const SAMPLE_NOISE: f64 = 0.01;

/// Which physics makes the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Physics {
    /// The three-phase model: some ten milliseconds per upload.
    HighFidelity,
    /// The closed form of the map: for load tests of the service.
    ClosedForm,
}

/// Samples of one flight, in the order of the mask.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Back-EMF, V s/rad; `None` where no pass gave a value.
    pub samples: Vec<Option<f64>>,
    /// Load ratio of each sample.
    pub load_ratio: LoadRatio,
}

impl Physics {
    /// Measures an actuator with these faults; `stream` draws manoeuvre and noise.
    pub fn measure(self, motor: &Motor, faults: &ElectricalFaults, mask: &Mask, mut stream: Stream) -> Reading {
        let (y, r) = match self {
            Self::HighFidelity => high_fidelity(motor, faults, mask, &mut stream),
            Self::ClosedForm => closed_form(faults, mask, &mut stream),
        };
        let k_nom = motor.back_emf_v_s_rad;
        let noisy = |y: Option<f64>| y.map(|y| (y + SAMPLE_NOISE * stream.normal()) * k_nom);
        Reading { samples: y.into_iter().map(noisy).collect(), load_ratio: LoadRatio::PerSample(r) }
    }
}

/// Map values and load ratios at the mask points, in units of k_nom.
type AtMask = (Vec<Option<f64>>, Vec<Option<f64>>);

fn high_fidelity(motor: &Motor, faults: &ElectricalFaults, mask: &Mask, stream: &mut Stream) -> AtMask {
    let manoeuvre = Manoeuvre::operating(stream);
    let settings = Settings::new(Model::HighFidelity, LONGEST_RUN_S);
    let map = simulate_map_until(
        Model::HighFidelity,
        motor,
        faults,
        &manoeuvre,
        &settings,
        Awaited { bins: mask.bins(), passes: PASSES },
    );
    let at_mask = |values: &[Option<f64>]| mask.bins().iter().map(|&bin| values[bin]).collect();
    (at_mask(&map.y), at_mask(&map.r))
}

fn closed_form(faults: &ElectricalFaults, mask: &Mask, stream: &mut Stream) -> AtMask {
    let mean_r = 0.12 + 0.1 * stream.normal();
    let swing = 0.02 * stream.normal();
    let width = std::f64::consts::TAU / BINS as f64;
    let r: Vec<f64> = mask.bins().iter().map(|&bin| mean_r + swing * (bin as f64 * width).sin()).collect();
    let y = mask.bins().iter().zip(&r).map(|(&bin, &r)| Some(closed_form::back_emf(faults, bin, r))).collect();
    (y, r.into_iter().map(Some).collect())
}

#[cfg(test)]
mod tests {
    use domain::Coordinate;

    use super::*;

    #[test]
    fn both_physics_read_the_same_map_within_noise_and_repeat_themselves() {
        let bins = (0..30).map(|i| 12 * i + 6).collect();
        let mask = Mask::new(Coordinate::ElectricalAngleRad, BINS, bins).unwrap();
        let faults = ElectricalFaults::new([0.15, 0.0, 0.05], 0.1, 1.0).unwrap();
        let motor = Motor::default();
        for physics in [Physics::HighFidelity, Physics::ClosedForm] {
            let measure = || physics.measure(&motor, &faults, &mask, Stream::new(3, &["reading"]));
            let reading = measure();
            assert_eq!(reading, measure());
            let LoadRatio::PerSample(r) = &reading.load_ratio else { panic!("one ratio per sample") };
            for ((sample, r), &bin) in reading.samples.iter().zip(r).zip(mask.bins()) {
                let expected = closed_form::back_emf(&faults, bin, r.unwrap());
                let error = sample.unwrap() / motor.back_emf_v_s_rad - expected;
                assert!(error.abs() < 5.0 * SAMPLE_NOISE, "{physics:?}, bin {bin}: {error}");
            }
        }
    }
}
