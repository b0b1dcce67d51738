//! What an aircraft's electronics measure during one flight: samples of the back-EMF map at the mask, with the load ratio.
//!
//! They are taken in a stroke at a held rate that moves the surface against its load. So the mean load ratio of an upload is
//! a straight line over the torque at the output ([`ema::closed_form::steady_load_ratio`]), and tells it.

use domain::{LoadRatio, Mask};
use ema::{
    back_emf::Awaited,
    closed_form,
    commutation::bin_centre_rad,
    faults::ElectricalFaults,
    manoeuvre::{Manoeuvre, STROKE_SPEED_RAD_S, Signal},
    motor::Motor,
    simulation::{Model, Settings, simulate_map_until},
};
use numerics::Stream;

/// Passes of the rotor through every mask point before an upload is complete.
const PASSES: u32 = 10;
/// The speed of a stroke has settled after this time, s.
const SETTLED_S: f64 = 0.04;
/// After this simulated time an upload goes out with what there is, s: a stroke has reached the endstop.
const LONGEST_RUN_S: f64 = 1.5;
/// Scatter of the closed form's load ratios: of a stroke, and over a turn; relative, as turbulence and ripple make them.
const STROKE_SCATTER: f64 = 0.007;
const TURN_SCATTER: f64 = 0.01;
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

/// Torque at the output of an actuator during a measuring stroke, N m; either sign.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputTorque {
    /// Over time.
    pub course_nm: Signal,
    /// On average.
    pub mean_nm: f64,
}

impl OutputTorque {
    /// The same torque all the time.
    pub fn steady(output_nm: f64) -> Self {
        Self { course_nm: Signal::constant(output_nm), mean_nm: output_nm }
    }
}

impl Physics {
    /// Measures an actuator with these faults under a torque; `stream` draws the stroke and noise.
    pub fn measure(
        self,
        motor: &Motor,
        faults: &ElectricalFaults,
        mask: &Mask,
        torque: &OutputTorque,
        mut stream: Stream,
    ) -> Reading {
        let (y, r) = match self {
            Self::HighFidelity => high_fidelity(motor, faults, mask, &torque.course_nm, &mut stream),
            Self::ClosedForm => closed_form(motor, faults, mask, torque.mean_nm, &mut stream),
        };
        let k_nom = motor.back_emf_v_s_rad;
        let noisy = |y: Option<f64>| y.map(|y| (y + SAMPLE_NOISE * stream.normal()) * k_nom);
        Reading { samples: y.into_iter().map(noisy).collect(), load_ratio: LoadRatio::PerSample(r) }
    }
}

/// Map values and load ratios at the mask points, in units of k_nom.
type AtMask = (Vec<Option<f64>>, Vec<Option<f64>>);

fn high_fidelity(
    motor: &Motor,
    faults: &ElectricalFaults,
    mask: &Mask,
    output_nm: &Signal,
    stream: &mut Stream,
) -> AtMask {
    let load_nm = output_nm.scaled(motor.transmission().load_nm(1.0));
    let stroke = Manoeuvre::stroke(motor, load_nm, stream);
    let settings = Settings::new(Model::HighFidelity, LONGEST_RUN_S);
    let awaited = Awaited { bins: mask.bins(), passes: PASSES, from_s: SETTLED_S };
    let map = simulate_map_until(Model::HighFidelity, motor, faults, &stroke, &settings, awaited);
    let at_mask = |values: &[Option<f64>]| mask.bins().iter().map(|&bin| values[bin]).collect();
    (at_mask(&map.y), at_mask(&map.r))
}

fn closed_form(motor: &Motor, faults: &ElectricalFaults, mask: &Mask, output_nm: f64, stream: &mut Stream) -> AtMask {
    let steady_r = closed_form::steady_load_ratio(motor, faults, output_nm.abs(), STROKE_SPEED_RAD_S);
    let mean_r = steady_r * (1.0 + STROKE_SCATTER * stream.normal());
    let swing = TURN_SCATTER * mean_r * stream.normal();
    let r: Vec<f64> = mask.bins().iter().map(|&bin| mean_r + swing * libm::sin(bin_centre_rad(bin))).collect();
    let y = mask.bins().iter().zip(&r).map(|(&bin, &r)| Some(closed_form::back_emf(faults, bin, r))).collect();
    (y, r.into_iter().map(Some).collect())
}

#[cfg(test)]
mod tests {
    use domain::Coordinate;
    use ema::commutation::BINS;

    use super::*;
    use crate::{linkage, wing::InstrumentedWing};

    fn mask() -> Mask {
        Mask::new(Coordinate::ElectricalAngleRad, BINS, (0..30).map(|i| 12 * i + 6).collect()).unwrap()
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn correlation(x: &[f64], y: &[f64]) -> f64 {
        let (mean_x, mean_y) = (mean(x), mean(y));
        let sum = |f: &dyn Fn(f64, f64) -> f64| x.iter().zip(y).map(|(x, y)| f(x - mean_x, y - mean_y)).sum::<f64>();
        sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
    }

    /// Sizes of the output torque of flights, and of the motor torque that the load ratios of their uploads imply.
    fn flown(physics: Physics, position: &str, relative_efficiency: f64, flights: u64) -> (Vec<f64>, Vec<f64>) {
        let (wing, motor, mask) = (InstrumentedWing::reference(), linkage::motor(relative_efficiency), mask());
        let position = position.parse().unwrap();
        let fly = |flight: u64| {
            let stream = Stream::new(11, &["flown"]).substream(flight);
            let load = 0.9 * libm::exp(0.25 * Stream::new(12, &["load"]).substream(flight).normal());
            let torque = wing.fly(&position, load, 10.0, &stream).output_torque();
            let reading = physics.measure(&motor, &ElectricalFaults::default(), &mask, &torque, stream);
            let LoadRatio::PerSample(r) = reading.load_ratio else { panic!("one ratio per sample") };
            let r = mean(&r.into_iter().flatten().collect::<Vec<_>>());
            (torque.mean_nm.abs(), closed_form::torque_nm(&motor, r, STROKE_SPEED_RAD_S))
        };
        (0..flights).map(fly).unzip()
    }

    /// Motor torque against hinge moment on healthy units, in either physics and on every kind of surface.
    #[test]
    fn the_motor_tells_the_moment_that_the_surface_has() {
        for (physics, position) in [
            (Physics::HighFidelity, "FLAP-L"),
            (Physics::HighFidelity, "AIL-R"),
            (Physics::HighFidelity, "ELEV-L"),
            (Physics::ClosedForm, "FLAP-L"),
            (Physics::ClosedForm, "AIL-R"),
            (Physics::ClosedForm, "ELEV-L"),
        ] {
            let (output_nm, torque_nm) = flown(physics, position, 1.0, 200);
            let correlation = correlation(&output_nm, &torque_nm);
            // T_u/(i eta_D) + T_f + C w.
            let expected: Vec<f64> =
                output_nm.iter().map(|output| output / 400.0 + 0.06 + 5e-5 * STROKE_SPEED_RAD_S).collect();
            let error = mean(&torque_nm) / mean(&expected) - 1.0;
            println!("{physics:?} {position}: correlation {correlation:.4}, mean torque off by {:.2} %", 100.0 * error);
            assert!(correlation >= 0.98, "{physics:?} {position}: {correlation}");
            assert!(error.abs() < 0.03, "{physics:?} {position}: {error}");
        }
    }

    /// Shorted windings raise the load ratio, and what they add is known: a worn motor tells its load, too.
    #[test]
    fn a_worn_motor_tells_the_load_of_a_healthy_one() {
        let (motor, mask, torque) = (linkage::motor(1.0), mask(), OutputTorque::steady(80.0));
        for physics in [Physics::HighFidelity, Physics::ClosedForm] {
            let mean_ratio = |faults: &ElectricalFaults| {
                let strokes = (0..5).map(|stroke| {
                    let stream = Stream::new(4, &["worn"]).substream(stroke);
                    let reading = physics.measure(&motor, faults, &mask, &torque, stream);
                    let LoadRatio::PerSample(r) = reading.load_ratio else { panic!("one ratio per sample") };
                    mean(&r.into_iter().flatten().collect::<Vec<_>>())
                });
                mean(&strokes.collect::<Vec<_>>())
            };
            let healthy = mean_ratio(&ElectricalFaults::default());
            let worn = ElectricalFaults::new([0.2, 0.1, 0.0], 0.15, 1.0).unwrap();
            let raised = mean_ratio(&worn);
            let told = closed_form::healthy_load_ratio(&worn, raised);
            println!("{physics:?}: healthy {healthy:.4}, worn {raised:.4}, told {told:.4}");
            assert!(raised > 1.3 * healthy, "{physics:?}: {raised} and {healthy}");
            assert!((told / healthy - 1.0).abs() < 0.03, "{physics:?}: {told} and {healthy}");
        }
    }

    /// What a transmission that is 15 % less efficient costs: the share of the load alone.
    #[test]
    fn a_weak_transmission_shows_in_the_motor_alone() {
        for physics in [Physics::HighFidelity, Physics::ClosedForm] {
            let [(same_nm, healthy), (output_nm, weak)] = [1.0, 0.85].map(|share| flown(physics, "FLAP-L", share, 20));
            assert_eq!(same_nm, output_nm, "the surface has the same moments");
            let excess = mean(&weak) - mean(&healthy);
            let expected = mean(&output_nm) / 400.0 * (1.0 / 0.85 - 1.0);
            println!("{physics:?}: excess {excess:.4} of {expected:.4} N m on {:.4}", mean(&healthy));
            assert!((excess / expected - 1.0).abs() < 0.1, "{physics:?}: {excess}, not {expected}");
        }
    }

    #[test]
    fn both_physics_read_the_same_map_within_noise_and_repeat_themselves() {
        let mask = mask();
        let faults = ElectricalFaults::new([0.15, 0.0, 0.05], 0.1, 1.0).unwrap();
        let motor = linkage::motor(1.0);
        let torque = OutputTorque::steady(-80.0);
        for physics in [Physics::HighFidelity, Physics::ClosedForm] {
            let measure = || physics.measure(&motor, &faults, &mask, &torque, Stream::new(3, &["reading"]));
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
