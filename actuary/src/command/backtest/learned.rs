//! What past lives have taught, as `metrics.json` tells it.

use std::collections::BTreeMap;

use prognosis::{GrowthLaw, Lesson, REFERENCE_LIFE_FH, REFERENCE_LIMIT, Recalibration, Scale};
use serde::Serialize;

/// Rates of growth with a lower probability are not told.
const TOLD_PROBABILITY: f64 = 0.005;

/// The figures of a lesson, in the user's unit of time; severities are shares of the way from nominal to limit.
#[derive(Debug, Serialize)]
pub struct Learned {
    /// The median of the lives that failed.
    characteristic_life: f64,
    /// Standard deviation of one observation of each fault, as a severity.
    noise: BTreeMap<String, f64>,
    growth: Vec<Law>,
    similarity: Similarity,
    weights: Weights,
    /// What maps probabilities of the pool to those that held; `null` where lives are too few.
    recalibration: Option<Recalibration>,
    /// How forecasts of lives held out came out; `null` where none could be made.
    held_out: Option<HeldOut>,
}

/// One measure of damage in which growth is linear.
#[derive(Debug, Serialize)]
struct Law {
    /// Share of the fleet that goes by it.
    share: f64,
    /// The power of damage with which it grows, and the damage where records begin, as a severity.
    exponent: f64,
    offset: f64,
    /// Mean and standard deviation of the severity at the start.
    start: [f64; 2],
    /// Growth from outside per characteristic life, in severities: mean and standard deviation.
    bias: [f64; 2],
    /// Standard deviation that growth at random gathers over a characteristic life, as a severity.
    process_noise: f64,
    /// Rates per characteristic life, each with its probability.
    rates: Vec<[f64; 2]>,
    /// Probability that growth changes in mid-life; `null` where it is followed as constant.
    growth_changes: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Similarity {
    /// The power of the ratio of paces by which times are scaled.
    pace_power: f64,
}

#[derive(Debug, Serialize)]
struct Weights {
    growth: f64,
    similarity: f64,
    climatology: f64,
}

/// Forecasts of lives held out; every life weighs one.
#[derive(Debug, Serialize)]
struct HeldOut {
    lives: usize,
    forecasts: usize,
    crps: f64,
    members_crps: Weights,
    coverage_80: f64,
    coverage_95: f64,
}

impl Learned {
    /// Tells a lesson of faults of these names, observed with this noise in reference deviations.
    pub fn new(lesson: &Lesson, scale: &Scale, faults: &[String], sigma: &[f64]) -> Self {
        let severities = sigma.iter().map(|sigma| sigma / REFERENCE_LIMIT);
        let held_out = lesson.companions.stacked.record.as_ref().map(|record| HeldOut {
            lives: record.lives,
            forecasts: record.forecasts,
            crps: scale.time(record.crps_fh),
            members_crps: Weights::new(&record.members_crps_fh.iter().map(|fh| scale.time(*fh)).collect::<Vec<_>>()),
            coverage_80: record.level_80,
            coverage_95: record.level_95,
        });
        Self {
            characteristic_life: scale.characteristic_life,
            noise: faults.iter().cloned().zip(severities).collect(),
            growth: lesson.growth.laws.iter().map(Law::new).collect(),
            similarity: Similarity { pace_power: lesson.companions.similar.power },
            weights: Weights::new(&lesson.companions.stacked.weights),
            recalibration: lesson.companions.stacked.recalibration.clone(),
            held_out,
        }
    }
}

impl Law {
    fn new(law: &GrowthLaw) -> Self {
        let (prior, bias) = (&law.prior, law.prior.one_sided.dominant);
        let of_life = |per_h: f64| per_h * REFERENCE_LIFE_FH / REFERENCE_LIMIT;
        let rates = prior.rates_per_h.iter().zip(&prior.one_sided.rate_weights);
        let told = rates.filter(|(_, weight)| **weight > TOLD_PROBABILITY);
        Self {
            share: law.share,
            exponent: law.coordinate.exponent,
            offset: law.coordinate.offset,
            start: [prior.start.mean, prior.start.sd].map(|deviation| deviation / REFERENCE_LIMIT),
            bias: [bias.mean_per_h, bias.sd_per_h].map(of_life),
            process_noise: prior.process_noise * REFERENCE_LIFE_FH.sqrt() / REFERENCE_LIMIT,
            rates: told.map(|(rate, weight)| [rate * REFERENCE_LIFE_FH, *weight]).collect(),
            growth_changes: prior.growth_changes.map(|changes| changes.probability),
        }
    }
}

impl Weights {
    /// Of figures in the order of the members of a [`Lesson`].
    fn new(figures: &[f64]) -> Self {
        Self { growth: figures[0], similarity: figures[1], climatology: figures[2] }
    }
}
