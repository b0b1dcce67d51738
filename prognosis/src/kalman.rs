//! One Kalman filter on the deviation x and the bias b of a fault entry, at a given growth rate.

use crate::clipping::{ClippedMean, Expected};

/// Standardised innovations beyond this are treated as outliers.
const OUTLIER: f64 = 3.0;
/// Faults are fractions, so no deviation is larger.
const LARGEST_DEVIATION: f64 = 1.0;
/// Growth within one step is at most e to this, so that squares of it are numbers, too.
const LARGEST_EXPONENT: f64 = 100.0;

/// The linear step x <- growth x + drive b + N(0, noise), b <- b: the exact solution of
/// dx = (lambda x + b) dt + sigma_w dW, so that one long step and many short ones agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transition {
    /// exp(lambda dt).
    pub growth: f64,
    /// (exp(lambda dt) - 1) / lambda, h.
    pub drive: f64,
    /// sigma_w^2 (exp(2 lambda dt) - 1) / (2 lambda).
    pub noise: f64,
}

impl Transition {
    /// The transition of `dt_h` hours at a rate `rate_per_h` > 0.
    pub fn new(rate_per_h: f64, process_noise: f64, dt_h: f64) -> Self {
        let grown = libm::expm1(f64::min(rate_per_h * dt_h, LARGEST_EXPONENT));
        let growth = 1.0 + grown;
        let drive = grown / rate_per_h;
        Self { growth, drive, noise: process_noise * process_noise * drive * 0.5 * (growth + 1.0) }
    }
}

/// The mean of a block of observations of one entry, as a deviation from nominal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measurement {
    /// Trimmed mean.
    pub value: f64,
    /// Its variance.
    pub variance: f64,
    /// Standard deviation of a single observation.
    pub sigma: f64,
    /// How to understand observations that were clipped at zero, where they were.
    pub clipped: Option<ClippedMean>,
}

impl Measurement {
    /// What a deviation `x` leads one to expect of it.
    pub fn expected(&self, x: f64) -> Expected {
        match self.clipped {
            None => Expected { mean: x, slope: 1.0, variance_ratio: 1.0 },
            Some(clipped) => clipped.at(x, self.sigma),
        }
    }
}

/// Gaussian belief about (x, b).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Track {
    pub x: f64,
    pub b: f64,
    pub p_xx: f64,
    pub p_xb: f64,
    pub p_bb: f64,
}

impl Track {
    /// Carries the belief over a step.
    pub fn predict(&mut self, step: &Transition) {
        let Transition { growth, drive, noise } = *step;
        self.x = (growth * self.x + drive * self.b).clamp(-LARGEST_DEVIATION, LARGEST_DEVIATION);
        self.p_xx = growth * growth * self.p_xx + 2.0 * growth * drive * self.p_xb + drive * drive * self.p_bb + noise;
        self.p_xb = growth * self.p_xb + drive * self.p_bb;
        if self.p_xx > LARGEST_DEVIATION * LARGEST_DEVIATION {
            self.p_xb *= LARGEST_DEVIATION / self.p_xx.sqrt();
            self.p_xx = LARGEST_DEVIATION * LARGEST_DEVIATION;
        }
    }

    /// Corrects the belief by a measurement and returns its log-likelihood, up to a constant.
    ///
    /// An outlier counts as linear in its size (Huber), and its variance is raised in the gain.
    pub fn correct(&mut self, measured: &Measurement) -> f64 {
        let Expected { mean, slope, variance_ratio } = measured.expected(self.x);
        let innovation = measured.value - mean;
        let spread = slope * slope * self.p_xx;
        let noise = variance_ratio * measured.variance;
        let variance = spread + noise;
        let z2 = innovation * innovation / variance;
        let robust = spread + noise * f64::max(1.0, z2 / (OUTLIER * OUTLIER));
        let (gain_x, gain_b) = (slope * self.p_xx / robust, slope * self.p_xb / robust);
        self.x += gain_x * innovation;
        self.b += gain_b * innovation;
        self.p_bb -= gain_b * slope * self.p_xb;
        self.p_xb -= gain_x * slope * self.p_xb;
        self.p_xx -= gain_x * slope * self.p_xx;
        if measured.clipped.is_some() {
            self.stay_in_sight(measured);
        }
        robust_log_likelihood(z2, variance)
    }

    /// Keeps a belief from hiding below nominal.
    ///
    /// Observations that are clipped at zero tell nothing of how far below it a deviation is, so such a belief would sink
    /// and widen without end, and forecasts, which reflect paths at nominal, would begin at a fault that nobody saw. What
    /// is farther down than noise reaches is as healthy as what is there, and nothing lies above what was seen.
    fn stay_in_sight(&mut self, measured: &Measurement) {
        let reach = OUTLIER * measured.sigma;
        self.x = self.x.max(-reach);
        let widest = (measured.value + reach - self.x) / OUTLIER;
        if self.x < 0.0 && widest * widest < self.p_xx {
            self.p_xb *= widest / self.p_xx.sqrt();
            self.p_xx = widest * widest;
        }
    }
}

/// Log-likelihood of a standardised innovation whose square is `z2`, up to a constant; an outlier counts as linear in
/// its size (Huber).
pub fn robust_log_likelihood(z2: f64, variance: f64) -> f64 {
    let limit = OUTLIER * OUTLIER;
    let rho = if z2 < limit { z2 } else { 2.0 * OUTLIER * z2.sqrt() - limit };
    -0.5 * (libm::log(variance) + rho)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: Track = Track { x: 0.03, b: 2e-5, p_xx: 4e-6, p_xb: 1e-9, p_bb: 1e-11 };

    fn close(a: f64, b: f64) {
        assert!((a / b - 1.0).abs() < 1e-12, "{a} and {b}");
    }

    #[test]
    fn many_short_steps_agree_with_a_long_one() {
        let (mut short, mut long) = (TRACK, TRACK);
        for _ in 0..8 {
            short.predict(&Transition::new(7e-4, 2.5e-4, 20.0));
        }
        long.predict(&Transition::new(7e-4, 2.5e-4, 160.0));
        close(short.x, long.x);
        close(short.p_xx, long.p_xx);
        close(short.p_xb, long.p_xb);
    }

    /// A deviation below nominal grows unseen, however fast and for however long.
    #[test]
    fn a_belief_that_clipping_hides_stays_finite() {
        let mut track = Track { x: -0.01, b: -1e-5, ..TRACK };
        for dt_h in [20.0, 5e4, 1e9, 20.0] {
            track.predict(&Transition::new(0.3, 2.5e-4, dt_h));
            let clipped = Some(ClippedMean::TrimmedT4);
            let evidence = track.correct(&Measurement { value: 0.001, variance: 2e-6, sigma: 5e-3, clipped });
            assert!([evidence, track.x, track.b, track.p_xx, track.p_xb, track.p_bb].iter().all(|n| n.is_finite()));
            assert!(track.x.abs() <= 1.0 && track.p_xx * track.p_bb >= track.p_xb * track.p_xb, "{track:?}");
            let widest = track.x + OUTLIER * track.p_xx.sqrt();
            assert!(track.x >= -0.015 && widest <= 0.016 + 1e-12, "it hides: {track:?}");
        }
    }

    #[test]
    fn correction_is_that_of_the_normal_distribution() {
        let mut track = TRACK;
        let variance = 2e-6;
        track.correct(&Measurement { value: 0.032, variance, sigma: 5e-3, clipped: None });
        close(1.0 / track.p_xx, 1.0 / TRACK.p_xx + 1.0 / variance);
        close(track.x / track.p_xx, TRACK.x / TRACK.p_xx + 0.032 / variance);
        close(track.b - TRACK.b, TRACK.p_xb / TRACK.p_xx * (track.x - TRACK.x));
        close(track.p_xb / track.p_xx, TRACK.p_xb / TRACK.p_xx);
    }

    #[test]
    fn an_outlier_moves_the_belief_less_the_farther_it_is_and_weighs_linearly() {
        let measured = |value| Measurement { value, variance: 2e-6, sigma: 5e-3, clipped: None };
        let (mut near, mut far, mut farther) = (TRACK, TRACK, TRACK);
        near.correct(&measured(0.036));
        let losses = [far.correct(&measured(0.2)), farther.correct(&measured(0.37))];
        assert!(farther.x - TRACK.x < far.x - TRACK.x && far.x < near.x);
        let z = |value: f64| (value - TRACK.x) / (TRACK.p_xx + 2e-6).sqrt();
        close(losses[0] - losses[1], OUTLIER * (z(0.37) - z(0.2)));
    }
}
