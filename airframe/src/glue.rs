//! The glue of a strain grating: how a pretensioned joint settles, how long it is not trusted, and how
//! it is watched afterwards.
//!
//! A grating is bonded under pretension, and its joint creeps: eps(t) = -eps_pre d (1 - exp(-t/tau)),
//! with d about 0.018 for epoxy and 0.028 for cyanoacrylate (Berri 2021, section 4.2.6, where epoxy is
//! still after about a week: tau about 1.9 days). Humidity moves a joint too, but its effect is
//! variance, not a correction.

use domain::{Timestamp, time::DAY_US};

/// Part of the pretension that an epoxy joint loses.
pub const EPOXY_LOSS: f64 = 0.018;
/// Part of the pretension that a cyanoacrylate joint loses.
pub const CYANOACRYLATE_LOSS: f64 = 0.028;
/// Time constant of settling, days.
pub const SETTLING_DAYS: f64 = 1.9;
/// Usual pretension of a grating.
pub const PRETENSION: f64 = 2000e-6;
/// How long a newly bonded grating is in quarantine, days: the larger loss has then settled to less
/// than a third of a microstrain.
pub const QUARANTINE_DAYS: i64 = 10;
/// Drift after which a joint is looked at.
pub const WATCHED_DRIFT: f64 = 5e-6;

/// Strain noise that a grating's quarantine adds: all that its joint may lose, since nobody knows how
/// much of it the last tare has seen. None where either time is unknown. A reading from before the
/// bonding is in quarantine too: the configuration does not describe it.
pub fn quarantine_sigma(bonded_at: Option<Timestamp>, recorded_at: Option<Timestamp>) -> f64 {
    let (Some(bonded_at), Some(recorded_at)) = (bonded_at, recorded_at) else { return 0.0 };
    let age_us = recorded_at.micros().saturating_sub(bonded_at.micros());
    if age_us < QUARANTINE_DAYS * DAY_US { PRETENSION * CYANOACRYLATE_LOSS } else { 0.0 }
}

/// How a joint settles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settling {
    /// Pretension eps_pre.
    pub pretension: f64,
    /// Part of it that is lost, d.
    pub loss: f64,
    /// Time constant tau, days.
    pub time_constant_days: f64,
}

/// Strain of an unloaded grating, compensated for temperature, some time after its bonding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettlingSample {
    /// Days since the bonding.
    pub age_days: f64,
    /// Strain since the bonding.
    pub strain: f64,
}

impl Settling {
    /// Strain that the joint has lost at an age, as the grating shows it: negative.
    pub fn strain(&self, age_days: f64) -> f64 {
        -self.pretension * self.loss * settled(age_days, self.time_constant_days)
    }

    /// Loss and time constant by least squares: the loss is linear, the time constant is searched by
    /// golden section in its logarithm between an hour and 100 days. `None` where the samples are
    /// fewer than two, not finite, or tell no loss.
    pub fn fit(pretension: f64, samples: &[SettlingSample]) -> Option<Self> {
        let finite = samples.iter().all(|sample| sample.age_days.is_finite() && sample.strain.is_finite());
        if samples.len() < 2 || !finite || !(pretension > 0.0 && pretension.is_finite()) {
            return None;
        }
        let (mut low, mut high) = (libm::log(1.0 / 24.0), libm::log(100.0));
        let error = |log_days: f64| amplitude_and_error(samples, libm::exp(log_days)).1;
        let section = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..60 {
            let (left, right) = (high - section * (high - low), low + section * (high - low));
            if error(left) < error(right) {
                high = right;
            } else {
                low = left;
            }
        }
        let time_constant_days = libm::exp(0.5 * (low + high));
        let loss = -amplitude_and_error(samples, time_constant_days).0 / pretension;
        loss.is_finite().then_some(Self { pretension, loss, time_constant_days })
    }
}

/// 1 - exp(-t/tau).
fn settled(age_days: f64, time_constant_days: f64) -> f64 {
    -libm::expm1(-age_days / time_constant_days)
}

/// Best factor of 1 - exp(-t/tau), and the sum of squares that it leaves.
fn amplitude_and_error(samples: &[SettlingSample], time_constant_days: f64) -> (f64, f64) {
    let shape = |sample: &SettlingSample| settled(sample.age_days, time_constant_days);
    let (mut projected, mut norm) = (0.0, 0.0);
    for sample in samples {
        projected += shape(sample) * sample.strain;
        norm += shape(sample) * shape(sample);
    }
    let amplitude = projected / norm;
    let residual = |sample: &SettlingSample| sample.strain - amplitude * shape(sample);
    (amplitude, samples.iter().map(|sample| residual(sample) * residual(sample)).sum())
}

/// Watches a joint for drift by two cumulative sums of what an unloaded grating shows since its tare.
///
/// Update rule (Page 1954): up = max(0, up + x - shift/2), down = max(0, down - x - shift/2); either
/// above the threshold means that the mean has moved.
/// Requires: readings with the wing unloaded, one per tare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftWatch {
    allowance: f64,
    threshold: f64,
    up: f64,
    down: f64,
}

/// The way that a joint has gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drift {
    /// More strain.
    Up,
    /// Less strain.
    Down,
}

impl DriftWatch {
    /// Watches for [`WATCHED_DRIFT`] in readings of this standard deviation. The threshold is five of
    /// them: a still joint read to 5 microstrain gives a false alarm once in 465 readings on average
    /// (Montgomery 2013, table 9.3), one read better hardly ever.
    ///
    /// # Panics
    /// If the deviation is not a positive number.
    pub fn new(sigma: f64) -> Self {
        assert!(sigma > 0.0 && sigma.is_finite(), "a standard deviation of {sigma}");
        Self { allowance: 0.5 * WATCHED_DRIFT, threshold: 5.0 * sigma, up: 0.0, down: 0.0 }
    }

    /// Takes one reading; a reading that is not a number is passed over.
    pub fn update(&mut self, strain: f64) -> Option<Drift> {
        if strain.is_finite() {
            self.up = (self.up + strain - self.allowance).max(0.0);
            self.down = (self.down - strain - self.allowance).max(0.0);
        }
        if self.up > self.threshold {
            Some(Drift::Up)
        } else if self.down > self.threshold {
            Some(Drift::Down)
        } else {
            None
        }
    }
}
