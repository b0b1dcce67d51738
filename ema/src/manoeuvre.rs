//! What an actuator is asked to do: output command and load over time.

use std::f64::consts::TAU;

use numerics::Stream;
use serde::{Deserialize, Serialize};

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

/// A constant plus a ramp plus sines.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Signal {
    /// The constant.
    pub constant: f64,
    /// Slope of the ramp, per second.
    pub rate_per_s: f64,
    /// The harmonics.
    pub sines: Vec<Sine>,
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

    /// Value at a time, s.
    pub fn at(&self, time_s: f64) -> f64 {
        let value = |sine: &Sine| sine.amplitude * libm::sin(TAU * sine.frequency_hz * time_s + sine.phase_rad);
        self.sines.iter().fold(self.constant + self.rate_per_s * time_s, |sum, sine| sum + value(sine))
    }
}

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
    fn the_noise_has_its_standard_deviation() {
        let manoeuvre = Manoeuvre::step(0.0);
        let mut ticks = Ticks::new(&manoeuvre, 0.1);
        let draws: Vec<f64> = (0..20_000).map(|_| ticks.next_tick().current_noise_a).collect();
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / draws.len() as f64;
        assert!((variance.sqrt() - 0.1).abs() < 0.003);
    }
}
