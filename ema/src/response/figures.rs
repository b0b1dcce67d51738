//! What an engineer reads off a response.

use std::f64::consts::TAU;

use super::ResponsePoint;

/// Figures of the response to a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFigures {
    /// The time from 10 % to 90 % of the way, s; `None` if 90 % is not reached.
    pub rise_s: Option<f64>,
    /// Until the output stays within 2 % of the way from the command, s; `None` if it does not.
    pub settling_s: Option<f64>,
    /// Largest excess over the command, as a fraction of the way.
    pub overshoot: f64,
    /// Command minus output at the end, rad.
    pub static_error_rad: f64,
}

impl StepFigures {
    /// Reads them off the response to a constant command.
    ///
    /// # Panics
    /// If there are no points, or the command is where the output starts.
    pub fn from_points(points: &[ResponsePoint]) -> Self {
        let (first, last) = (points.first().expect("a response has points"), points[points.len() - 1]);
        let (start, way) = (first.output_rad, last.command_rad - first.output_rad);
        assert!(way != 0.0, "a step of no height");
        let share = |point: &ResponsePoint| (point.output_rad - start) / way;
        let reached = |level: f64| points.iter().find(|point| share(point) >= level).map(|point| point.time_s);
        let outside = |point: &ResponsePoint| (share(point) - 1.0).abs() > 0.02;
        let settled = points.len() - points.iter().rev().take_while(|point| !outside(point)).count();
        Self {
            rise_s: reached(0.1).zip(reached(0.9)).map(|(low, high)| high - low),
            settling_s: points.get(settled).map(|point| point.time_s),
            overshoot: points.iter().map(|point| share(point) - 1.0).fold(0.0, f64::max),
            static_error_rad: last.command_rad - last.output_rad,
        }
    }
}

/// How closely the output follows a moving command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingFigures {
    /// Root mean square of command minus output, rad.
    pub rms_error_rad: f64,
    /// Largest distance between command and output, rad.
    pub max_error_rad: f64,
    /// Share of the time for which the motor stands still.
    pub standstill: f64,
}

impl TrackingFigures {
    /// Reads them off a response from `from_s` on.
    ///
    /// # Panics
    /// If there are no points from there on.
    pub fn from_points(points: &[ResponsePoint], from_s: f64) -> Self {
        let points = &points[points.partition_point(|point| point.time_s < from_s)..];
        assert!(!points.is_empty(), "no response from {from_s} s on");
        let errors = || points.iter().map(|point| point.command_rad - point.output_rad);
        let still = points.iter().filter(|point| point.speed_rad_s == 0.0).count();
        Self {
            rms_error_rad: (errors().map(|error| error * error).sum::<f64>() / points.len() as f64).sqrt(),
            max_error_rad: errors().map(f64::abs).fold(0.0, f64::max),
            standstill: still as f64 / points.len() as f64,
        }
    }
}

/// The first harmonic of the output relative to that of the command: one point of a Bode diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Amplitude ratio.
    pub gain: f64,
    /// Phase of the output against the command, rad, in (-2 pi, 0].
    pub phase_rad: f64,
}

impl Harmonic {
    /// From the last whole periods of the response to a sine, the first left out; `None` where they
    /// are fewer than one.
    pub fn from_points(points: &[ResponsePoint], frequency_hz: f64) -> Option<Self> {
        let last_s = points.last()?.time_s;
        let periods = (last_s * frequency_hz).floor() - 1.0;
        if periods < 1.0 {
            return None;
        }
        let from_s = last_s - periods / frequency_hz;
        // Right end in, left end out: the periods are whole.
        let points = &points[points.partition_point(|point| point.time_s <= from_s + 1e-9)..];
        let fourier = |value: fn(&ResponsePoint) -> f64| {
            points.iter().fold((0.0, 0.0), |(cos, sin), point| {
                let (s, c) = libm::sincos(TAU * frequency_hz * point.time_s);
                (cos + c * value(point), sin + s * value(point))
            })
        };
        let (output, command) = (fourier(|point| point.output_rad), fourier(|point| point.command_rad));
        let size = |(cos, sin): (f64, f64)| libm::hypot(cos, sin);
        let angle = |(cos, sin): (f64, f64)| libm::atan2(cos, sin);
        let phase = (angle(output) - angle(command)).rem_euclid(TAU);
        Some(Self { gain: size(output) / size(command), phase_rad: if phase == 0.0 { 0.0 } else { phase - TAU } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(seconds: f64, command: impl Fn(f64) -> f64, output: impl Fn(f64) -> f64) -> Vec<ResponsePoint> {
        let point = |i: u32| {
            let time_s = 1e-3 * f64::from(i);
            let (command_rad, output_rad) = (command(time_s), output(time_s));
            ResponsePoint { time_s, command_rad, output_rad, motor_rad: 0.0, speed_rad_s: 0.0, current_a: 0.0 }
        };
        (0..=(1e3 * seconds) as u32).map(point).collect()
    }

    #[test]
    fn a_first_order_lag_has_its_textbook_figures() {
        let lag = 0.05;
        let figures = StepFigures::from_points(&response(1.0, |_| 0.1, |t| 0.1 * (1.0 - f64::exp(-t / lag))));
        assert!((figures.rise_s.unwrap() - lag * 9f64.ln()).abs() < 2e-3);
        assert!((figures.settling_s.unwrap() - lag * 50f64.ln()).abs() < 2e-3);
        assert!(figures.overshoot == 0.0 && figures.static_error_rad.abs() < 1e-9);
        let stuck = StepFigures::from_points(&response(1.0, |_| 0.1, |t| 0.05 * t));
        assert_eq!((stuck.rise_s, stuck.settling_s), (None, None));
        assert!((stuck.static_error_rad - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_lagging_sine_has_its_gain_and_phase() {
        let command = |t: f64| 0.2 * f64::sin(TAU * 2.0 * t);
        let output = |t: f64| 0.1 * f64::sin(TAU * 2.0 * t - 0.8) + 0.03;
        let harmonic = Harmonic::from_points(&response(3.2, command, output), 2.0).unwrap();
        assert!((harmonic.gain - 0.5).abs() < 1e-9 && (harmonic.phase_rad + 0.8).abs() < 1e-9, "{harmonic:?}");
        assert_eq!(Harmonic::from_points(&response(0.9, command, output), 2.0), None);
        let tracking = TrackingFigures::from_points(&response(2.0, |t| t, |t| t - 0.25), 0.5);
        assert!((tracking.rms_error_rad - 0.25).abs() < 1e-12 && (tracking.max_error_rad - 0.25).abs() < 1e-12);
        assert_eq!(tracking.standstill, 1.0);
    }
}
