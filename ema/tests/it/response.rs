//! What friction, backlash and gain drift do to the response (Berri 2021, sections 3.1.9, 3.1.10, 3.1.13).

use ema::{
    faults::ElectricalFaults,
    manoeuvre::{Manoeuvre, Signal},
    mechanical_faults::MechanicalFaults,
    motor::Motor,
    response::{Harmonic, ResponsePoint, StepFigures, TrackingFigures, simulate_response},
    simulation::{Model, Settings},
};

const BOTH: [Model; 2] = [Model::HighFidelity, Model::LowFidelity1];

fn response(model: Model, faults: MechanicalFaults, command: Signal, duration_s: f64) -> Vec<ResponsePoint> {
    let motor = faults.applied_to(&Motor::default());
    let settings = Settings::new(model, duration_s);
    simulate_response(model, &motor, &ElectricalFaults::default(), &Manoeuvre::following(command), &settings, 1e-4)
}

fn friction(friction: f64) -> MechanicalFaults {
    MechanicalFaults { friction, ..MechanicalFaults::NOMINAL }
}

fn backlash(backlash_rad: f64) -> MechanicalFaults {
    MechanicalFaults { backlash_rad, ..MechanicalFaults::NOMINAL }
}

fn gain(gain: f64) -> MechanicalFaults {
    MechanicalFaults { gain, ..MechanicalFaults::NOMINAL }
}

fn rms_error(model: Model, faults: MechanicalFaults, command: Signal) -> f64 {
    TrackingFigures::from_points(&response(model, faults, command, 4.0), 2.0).rms_error_rad
}

/// At rest the integral of the speed loop grows by G_I K_pos gear error until it overcomes static friction.
#[test]
fn friction_delays_the_start_as_the_integral_needs_time() {
    let (motor, step_rad) = (Motor::default(), 5e-4);
    let rate_nm_s = motor.integral_gain_nm_rad * motor.position_gain_per_s * motor.gear_ratio * step_rad;
    for model in BOTH {
        let start_s = |factor| {
            let response = response(model, friction(factor), Signal::constant(step_rad), 0.2);
            response.iter().find(|point| point.motor_rad > 0.0).unwrap().time_s
        };
        let starts = [2.0, 4.0, 6.0].map(start_s);
        let expected_s = 2.0 * motor.static_friction_nm / rate_nm_s;
        for pair in starts.windows(2) {
            assert!((pair[1] - pair[0] - expected_s).abs() < 1e-3, "{model:?}: {starts:?}, {expected_s} apart");
        }
    }
}

#[test]
fn friction_spoils_the_tracking_of_a_sine() {
    for model in BOTH {
        let errors = [1.0, 2.0, 4.0, 6.0].map(|factor| rms_error(model, friction(factor), Signal::sine(0.01, 0.5)));
        assert!(errors.is_sorted() && errors[3] > 1.08 * errors[0], "{model:?}: {errors:?}");
    }
}

#[test]
fn friction_makes_a_slow_ramp_stick_and_slip() {
    for model in BOTH {
        let ramp =
            |factor| TrackingFigures::from_points(&response(model, friction(factor), Signal::ramp(1e-4), 4.0), 2.0);
        let (smooth, stick_slip) = (ramp(1.0), ramp(4.0));
        assert_eq!(smooth.standstill, 0.0, "{model:?}");
        assert!((0.9..1.0).contains(&stick_slip.standstill), "{model:?}: {stick_slip:?}");
        assert!(stick_slip.rms_error_rad > 5.0 * smooth.rms_error_rad, "{model:?}: {stick_slip:?}");
    }
}

/// The integral works against a static error that friction holds, until the motor breaks loose to the other side.
#[test]
fn friction_and_integral_make_a_limit_cycle() {
    let settled = &response(Model::HighFidelity, friction(2.0), Signal::constant(0.1), 6.0)[20_000..];
    let still = settled.iter().filter(|point| point.speed_rad_s == 0.0).count();
    assert!((0.7..0.99).contains(&(still as f64 / settled.len() as f64)));
    let (above, below) = settled.iter().fold((false, false), |(above, below), point| {
        (above || point.output_rad > point.command_rad, below || point.output_rad < point.command_rad)
    });
    assert!(above && below, "the output hunts about the command");
}

#[test]
fn backlash_is_the_width_of_the_hysteresis() {
    for model in BOTH {
        for growth_rad in [0.0, 5e-4, 2e-3] {
            let points = response(model, backlash(growth_rad), Signal::sine(0.02, 0.5), 3.0);
            let gear = Motor::default().gear_ratio;
            let plays = points.iter().map(|point| point.motor_rad / gear - point.output_rad);
            let (least, most) = plays.fold((0.0, 0.0), |(low, high), play| (f64::min(low, play), f64::max(high, play)));
            let width_rad = 2.0 * (Motor::default().backlash_rad + growth_rad);
            assert!((most - least - width_rad).abs() < 1e-12, "{model:?}: {} of {width_rad}", most - least);
        }
    }
}

#[test]
fn backlash_holds_the_output_at_reversals_and_spoils_tracking() {
    for model in BOTH {
        let held = |growth_rad| {
            let points = response(model, backlash(growth_rad), Signal::sine(0.02, 0.5), 4.0);
            points.windows(2).filter(|pair| pair[0].output_rad == pair[1].output_rad).count()
        };
        let counts = [0.0, 5e-4, 1e-3, 2e-3].map(held);
        assert!(counts.is_sorted() && counts[3] > 2 * counts[0], "{model:?}: {counts:?}");
        let error = |growth_rad| rms_error(model, backlash(growth_rad), Signal::sine(0.02, 0.5));
        assert!(error(2e-3) > 1.05 * error(0.0), "{model:?}");
    }
}

/// While nothing saturates, the position loop is a lag of time constant 1 / K_pos.
#[test]
fn the_position_gain_is_the_bandwidth() {
    let (motor, frequency_hz) = (Motor::default(), 2.0);
    let omega = std::f64::consts::TAU * frequency_hz;
    for model in BOTH {
        for factor in [0.5, 1.0, 1.5] {
            let points = response(model, gain(factor), Signal::sine(0.02, frequency_hz), 2.0);
            let found = Harmonic::from_points(&points, frequency_hz).unwrap();
            let bandwidth = factor * motor.position_gain_per_s;
            let expected = bandwidth / bandwidth.hypot(omega);
            // Expected: up to 0.01 more, since the speed loop has its own dynamics.
            assert!((found.gain - expected).abs() < 0.012, "{model:?}, gain {factor}: {found:?}, {expected}");
            assert!((found.phase_rad + (omega / bandwidth).atan()).abs() < 0.02, "{model:?}, gain {factor}: {found:?}");
        }
    }
}

#[test]
fn a_higher_position_gain_quickens_the_step() {
    for model in BOTH {
        let rise_s = |factor| {
            StepFigures::from_points(&response(model, gain(factor), Signal::constant(0.1), 0.6)).rise_s.unwrap()
        };
        let rises = [0.5, 0.75, 1.0, 1.25, 1.5].map(rise_s);
        assert!(rises.windows(2).all(|pair| pair[1] < 0.96 * pair[0]), "{model:?}: {rises:?}");
    }
}
