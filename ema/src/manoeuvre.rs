//! What an actuator is asked to do: output command and load over time.

use std::f64::consts::TAU;

use numerics::Stream;
use serde::{Deserialize, Serialize};

use crate::motor::Motor;

/// One harmonic of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sine {
    /// Amplitude, in the signal's unit.
    pub amplitude: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Phase at time zero, rad.
    pub phase_rad: f64,
}

/// Values at equal intervals from time zero; linear between them, the last one for ever.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Seconds between values.
    pub interval_s: f64,
    /// The values, in the signal's unit; at least one.
    pub values: Vec<f64>,
}

impl Series {
    fn at(&self, time_s: f64) -> f64 {
        let place = (time_s / self.interval_s).max(0.0);
        let (index, last) = (place as usize, self.values.len() - 1);
        if index >= last {
            return self.values[last];
        }
        self.values[index] + (place - index as f64) * (self.values[index + 1] - self.values[index])
    }
}

/// A constant plus a ramp plus sines plus what a series says.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Signal {
    /// The constant.
    pub constant: f64,
    /// Slope of the ramp, per second.
    pub rate_per_s: f64,
    /// The harmonics.
    pub sines: Vec<Sine>,
    /// What is no sum of these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub series: Option<Series>,
}

impl Signal {
    /// A signal that does not change.
    pub fn constant(constant: f64) -> Self {
        Self { constant, ..Self::default() }
    }

    /// A ramp from zero.
    pub fn ramp(rate_per_s: f64) -> Self {
        Self { rate_per_s, ..Self::default() }
    }

    /// One sine about zero that begins at zero.
    pub fn sine(amplitude: f64, frequency_hz: f64) -> Self {
        Self { sines: vec![Sine { amplitude, frequency_hz, phase_rad: 0.0 }], ..Self::default() }
    }

    /// A signal given by its values, at least one.
    pub fn series(interval_s: f64, values: Vec<f64>) -> Self {
        Self { series: Some(Series { interval_s, values }), ..Self::default() }
    }

    /// The signal times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        let sine = |sine: &Sine| Sine { amplitude: factor * sine.amplitude, ..*sine };
        let series = |series: &Series| Series {
            interval_s: series.interval_s,
            values: series.values.iter().map(|value| factor * value).collect(),
        };
        Self {
            constant: factor * self.constant,
            rate_per_s: factor * self.rate_per_s,
            sines: self.sines.iter().map(sine).collect(),
            series: self.series.as_ref().map(series),
        }
    }

    /// Value at a time, s.
    pub fn at(&self, time_s: f64) -> f64 {
        let value = |sine: &Sine| sine.amplitude * libm::sin(TAU * sine.frequency_hz * time_s + sine.phase_rad);
        let smooth = self.sines.iter().fold(self.constant + self.rate_per_s * time_s, |sum, sine| sum + value(sine));
        self.series.as_ref().map_or(smooth, |series| smooth + series.at(time_s))
    }
}

/// Speed of the motor in a [`Manoeuvre::stroke`], rad/s: always the same, so that load ratios of flights compare.
pub const STROKE_SPEED_RAD_S: f64 = 240.0;

/// Command, load and disturbance of one run. The output starts at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manoeuvre {
    /// Output angle at time zero, rad.
    pub start_rad: f64,
    /// Commanded output angle, rad.
    pub command_rad: Signal,
    /// Load at the motor shaft against positive motion, N m.
    pub load_nm: Signal,
    /// Standard deviation of white noise on the current reference, A (high-fidelity model only).
    pub current_noise_a: f64,
    /// Seed of that noise.
    pub noise_seed: u64,
}

impl Manoeuvre {
    /// The motion under which maps for training are acquired: 0.2 rad at 0.5 Hz, no load.
    pub fn acquisition() -> Self {
        Self::following(Signal::sine(0.2, 0.5))
    }

    /// A step of the command from zero, rad, no load.
    pub fn step(command_rad: f64) -> Self {
        Self::following(Signal::constant(command_rad))
    }

    /// A command to an actuator at zero, rad, no load.
    pub fn following(command_rad: Signal) -> Self {
        Self { start_rad: 0.0, command_rad, load_nm: Signal::default(), current_noise_a: 0.0, noise_seed: 0 }
    }

    /// A random motion in operation: a large slow and a small fast sine of the command, a steady load
    /// that may aid the motion, a varying load, and interference on the current reference.
    pub fn operating(stream: &mut Stream) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * stream.uniform();
        let slow =
            Sine { amplitude: between(0.1, 0.2), frequency_hz: between(0.35, 0.7), phase_rad: between(0.0, TAU) };
        let fast =
            Sine { amplitude: between(0.0, 0.03), frequency_hz: between(1.0, 2.5), phase_rad: between(0.0, TAU) };
        let steady = between(-0.25, 0.25);
        let gust =
            Sine { amplitude: between(0.0, 0.25), frequency_hz: between(0.3, 1.5), phase_rad: between(0.0, TAU) };
        let command_rad = Signal { sines: vec![slow, fast], ..Signal::default() };
        Self {
            start_rad: command_rad.at(0.0),
            command_rad,
            load_nm: Signal { constant: steady, sines: vec![gust], ..Signal::default() },
            current_noise_a: 0.1,
            noise_seed: stream.bits(),
        }
    }

    /// A measuring stroke of `motor`: its output is moved at a held rate against the load of a flight, from rest on one side of
    /// neutral to the other. Where it begins is random, as are a small fast sine of the command, a variation of the load
    /// about that of the flight, and interference on the current reference.
    pub fn stroke(motor: &Motor, load_nm: Signal, stream: &mut Stream) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * stream.uniform();
        let level_nm = load_nm.at(0.0);
        let against = if level_nm < 0.0 { -1.0 } else { 1.0 };
        let start_rad = -against * between(0.2, 0.25);
        let sway =
            Sine { amplitude: between(0.0, 1e-3), frequency_hz: between(3.0, 8.0), phase_rad: between(0.0, TAU) };
        let share = between(0.0, 0.15);
        let buffet =
            Sine { amplitude: share * level_nm.abs(), frequency_hz: between(4.0, 12.0), phase_rad: between(0.0, TAU) };
        let rate_rad_s = against * STROKE_SPEED_RAD_S / motor.gear_ratio;
        // The position loop follows a ramp at this distance: it holds the rate from the beginning.
        let lead_rad = rate_rad_s / motor.position_gain_per_s;
        Self {
            start_rad,
            command_rad: Signal {
                constant: start_rad + lead_rad,
                rate_per_s: rate_rad_s,
                sines: vec![sway],
                series: None,
            },
            load_nm: Signal { sines: [load_nm.sines, vec![buffet]].concat(), ..load_nm },
            current_noise_a: 0.1,
            noise_seed: stream.bits(),
        }
    }
}

/// The manoeuvre at 100 kHz, held between ticks: a hundredth of the fastest current ripple.
#[derive(Debug)]
pub(crate) struct Ticks<'a> {
    manoeuvre: &'a Manoeuvre,
    noise_a: f64,
    noise: Stream,
    tick: u64,
    knot: Knot,
    next_knot: Knot,
}

/// Seconds between ticks.
pub(crate) const TICK_S: f64 = 1e-5;
/// Ticks between evaluations of the sines; linear interpolation between them is off by at most
/// amplitude (2 pi f h)^2 / 8 = 1e-8 rad in the motions above.
const KNOT_TICKS: u64 = 10;

#[derive(Debug, Clone, Copy)]
struct Knot {
    command_rad: f64,
    load_nm: f64,
}

/// What acts on the actuator during one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick {
    pub command_rad: f64,
    pub load_nm: f64,
    pub current_noise_a: f64,
}

impl<'a> Ticks<'a> {
    /// The ticks from time zero; `noise_a` is the standard deviation of the noise on the current reference.
    pub fn new(manoeuvre: &'a Manoeuvre, noise_a: f64) -> Self {
        let knot = |index| Knot::of(manoeuvre, index);
        let noise = Stream::new(manoeuvre.noise_seed, &["current reference noise"]);
        Self { manoeuvre, noise_a, noise, tick: 0, knot: knot(0), next_knot: knot(1) }
    }

    pub fn next_tick(&mut self) -> Tick {
        let within = self.tick % KNOT_TICKS;
        if within == 0 && self.tick > 0 {
            self.knot = self.next_knot;
            self.next_knot = Knot::of(self.manoeuvre, self.tick / KNOT_TICKS + 1);
        }
        self.tick += 1;
        let weight = within as f64 / KNOT_TICKS as f64;
        let between = |a: f64, b: f64| a + weight * (b - a);
        Tick {
            command_rad: between(self.knot.command_rad, self.next_knot.command_rad),
            load_nm: between(self.knot.load_nm, self.next_knot.load_nm),
            current_noise_a: if self.noise_a > 0.0 { self.noise_a * self.noise.normal() } else { 0.0 },
        }
    }
}

impl Knot {
    fn of(manoeuvre: &Manoeuvre, index: u64) -> Self {
        let time_s = (index * KNOT_TICKS) as f64 * TICK_S;
        Self { command_rad: manoeuvre.command_rad.at(time_s), load_nm: manoeuvre.load_nm.at(time_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_follow_the_signals() {
        let manoeuvre = Manoeuvre::operating(&mut Stream::new(5, &["ticks"]));
        let mut ticks = Ticks::new(&manoeuvre, 0.0);
        for i in 0..5000 {
            let (time_s, tick) = (f64::from(i) * TICK_S, ticks.next_tick());
            assert!((tick.command_rad - manoeuvre.command_rad.at(time_s)).abs() < 2e-8);
            assert!((tick.load_nm - manoeuvre.load_nm.at(time_s)).abs() < 5e-8);
        }
    }

    #[test]
    fn a_series_is_linear_between_its_values_and_stays_at_its_last() {
        let signal = Signal { constant: 1.0, ..Signal::series(0.5, vec![0.0, 2.0, -1.0]) };
        for (time_s, value) in [(0.0, 1.0), (0.25, 2.0), (0.5, 3.0), (0.9, 0.6), (1.0, 0.0), (9.0, 0.0)] {
            assert!((signal.at(time_s) - value).abs() < 1e-12, "{time_s}");
            assert!((signal.scaled(-3.0).at(time_s) + 3.0 * value).abs() < 1e-12, "{time_s}");
        }
    }

    #[test]
    fn the_noise_has_its_standard_deviation() {
        let manoeuvre = Manoeuvre::step(0.0);
        let mut ticks = Ticks::new(&manoeuvre, 0.1);
        let draws: Vec<f64> = (0..20_000).map(|_| ticks.next_tick().current_noise_a).collect();
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / draws.len() as f64;
        assert!((variance.sqrt() - 0.1).abs() < 0.003);
    }
}
