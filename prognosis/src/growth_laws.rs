//! Learning how the faults of a fleet grow: the law by evidence, its prior from the lives.
//!
//! - What: up to three measures of damage ([`Coordinate`]), each with the [`FleetPrior`] of a filter that follows growth in
//!   it, and the share of the fleet that goes by it.
//! - Update rule: every candidate is fitted roughly; the likeliest are fitted well. Evidences are of the same observations:
//!   those in another measure are divided by how much it stretches them. A life's responsibilities are its own; shares
//!   are their means, which is expectation maximisation.
//! - Requirements: deviations in reference units with limits at [`REFERENCE_LIMIT`], with their noise. Whether a life ended
//!   in failure matters for the error of the failure time only.
//! - Source: MacKay 1992 for evidence; Dempster, Laird, Rubin 1977.

use domain::FaultModel;
use numerics::log_sum_exp::{log_sum, normalised};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    block::{Observation, blocks},
    boundary::Limits,
    clock::Clock,
    coordinate::Coordinate,
    ended::{EndedLife, Ending},
    failure_time::{FinishedLife, fit_failure_time_error},
    filter::Filter,
    fit::{FitSettings, NoHistory, fit_prior_from},
    particle::log_evidence,
    prior::{BiasPrior, FleetPrior, GroupPrior, START_SD, StartPrior},
    scale::{REFERENCE_LIFE_FH, REFERENCE_LIMIT},
};

/// Powers and offsets that are tried besides growth as it is: wear that slows down, and cracks.
const EXPONENTS: [f64; 4] = [-1.0, 1.5, 2.0, 3.0];
const OFFSETS: [f64; 3] = [0.07, 0.2, 0.6];
/// Most laws that are carried.
const MOST: usize = 3;
/// Smallest share of a law that is worth its time.
const LEAST_SHARE: f64 = 0.02;
/// Growth rates per characteristic life: of wear that slows down, of steady wear, and of wear that feeds on itself.
const SLOWING: [f64; 4] = [-8.0, -3.0, -1.0, -0.3];
const STEADY: f64 = 1e-3;
const FEEDING: [f64; 2] = [0.1, 15.0];
const FEEDING_RATES: usize = 15;
/// Process noise from which to seek, 1/sqrt(h), and how.
const PROCESS_NOISE: f64 = 2.5e-4;
const ROUGH: FitSettings = FitSettings { rounds: 7, parent_lives: 0.0, noise_factor: 2.0 };
const WELL: FitSettings = FitSettings { rounds: 8, parent_lives: 0.0, noise_factor: 1.2 };
/// One more round from what the fleet knows, without the noise.
const ONCE_MORE: FitSettings = FitSettings { rounds: 2, parent_lives: 0.0, noise_factor: 1.0 };
/// Rounds in which shares are learned.
const SHARE_ROUNDS: usize = 20;

/// Growth in one measure of damage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrowthLaw {
    /// The measure.
    pub coordinate: Coordinate,
    /// What is known of growth in it.
    pub prior: FleetPrior,
    /// Share of the fleet that goes by it.
    pub share: f64,
}

/// The laws of a fleet, the most frequent first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrowthLaws {
    /// One to three.
    pub laws: Vec<GrowthLaw>,
}

impl GrowthLaws {
    /// The laws that explain these lives best.
    ///
    /// # Errors
    ///
    /// If no life has a closed block of observations.
    pub fn learn(lives: &[EndedLife], model: &FaultModel, seed: u64) -> Result<Self, NoHistory> {
        let clock = clock_for(lives);
        let rough: Vec<(GrowthLaw, f64)> = candidates()
            .into_par_iter()
            .map(|coordinate| {
                let histories = in_measure(lives, &coordinate);
                let guess = FleetPrior { clock, start: start_of(&histories), ..vague() };
                let prior = fit_prior_from(guess, &histories, model, &ROUGH)?;
                let law = GrowthLaw { coordinate, prior, share: 1.0 };
                let evidence = law.evidence(lives, model).iter().sum();
                Ok((law, evidence))
            })
            .collect::<Result<_, NoHistory>>()?;
        let mut ranked = rough;
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let laws = ranked
            .into_iter()
            .take(MOST)
            .map(|(law, _)| law.refitted(lives, model, &WELL))
            .collect::<Result<_, _>>()?;
        Ok(Self { laws }.with_shares(lives, model).with_failure_time_errors(lives, model, seed))
    }

    /// The same laws as they are known from other lives of the same fleet.
    ///
    /// # Errors
    ///
    /// If none of them has a closed block of observations.
    pub fn learned_from(&self, lives: &[EndedLife], model: &FaultModel, seed: u64) -> Result<Self, NoHistory> {
        let laws =
            self.laws.iter().map(|law| law.clone().refitted(lives, model, &ONCE_MORE)).collect::<Result<_, _>>()?;
        Ok(Self { laws }.with_shares(lives, model).with_failure_time_errors(lives, model, seed))
    }

    /// Shares by expectation maximisation; laws that hardly any life goes by are dropped.
    fn with_shares(self, lives: &[EndedLife], model: &FaultModel) -> Self {
        let evidence: Vec<Vec<f64>> = self.laws.iter().map(|law| law.evidence(lives, model)).collect();
        let mut shares = vec![1.0 / self.laws.len() as f64; self.laws.len()];
        for _ in 0..SHARE_ROUNDS {
            let mut sums = vec![0.0; shares.len()];
            for life in 0..lives.len() {
                let log_weights: Vec<f64> =
                    shares.iter().zip(&evidence).map(|(share, of_law)| libm::log(*share) + of_law[life]).collect();
                normalised(&log_weights).iter().zip(&mut sums).for_each(|(weight, sum)| *sum += weight);
            }
            // Half a life for each law, so that none is ruled out by few.
            let total = lives.len() as f64 + 0.5 * shares.len() as f64;
            shares = sums.iter().map(|sum| (sum + 0.5) / total).collect();
        }
        let mut laws: Vec<GrowthLaw> =
            self.laws.into_iter().zip(shares).map(|(law, share)| GrowthLaw { share, ..law }).collect();
        laws.sort_by(|a, b| b.share.total_cmp(&a.share));
        let kept = laws.iter().filter(|law| law.share >= LEAST_SHARE).count().max(1);
        laws.truncate(kept);
        let total: f64 = laws.iter().map(|law| law.share).sum();
        laws.iter_mut().for_each(|law| law.share /= total);
        Self { laws }
    }

    /// What the failure times of lives that failed differ by from where their growth crosses the limit.
    fn with_failure_time_errors(mut self, lives: &[EndedLife], model: &FaultModel, seed: u64) -> Self {
        let boundary = limits(model);
        for law in &mut self.laws {
            let finished: Vec<FinishedLife> = lives
                .iter()
                .filter(|life| life.ending == Ending::Failed)
                .map(|life| FinishedLife {
                    observations: life.observations.iter().map(|seen| law.coordinate.observation(seen)).collect(),
                    failure_fh: life.end_fh,
                })
                .collect();
            law.prior.failure_time_error = fit_failure_time_error(&finished, model, &law.prior, &boundary, seed);
        }
        self
    }
}

impl GrowthLaw {
    fn refitted(self, lives: &[EndedLife], model: &FaultModel, settings: &FitSettings) -> Result<Self, NoHistory> {
        let histories = in_measure(lives, &self.coordinate);
        let prior = fit_prior_from(self.prior, &histories, model, settings)?;
        Ok(Self { prior, ..self })
    }

    /// Log of the probability of each life's observations.
    fn evidence(&self, lives: &[EndedLife], model: &FaultModel) -> Vec<f64> {
        let of_life = |life: &EndedLife| {
            let measured: Vec<Observation> =
                life.observations.iter().map(|seen| self.coordinate.observation(seen)).collect();
            let mut filter = Filter::new(model, &self.prior);
            blocks(&measured, &self.prior.clock).iter().for_each(|block| filter.update(block));
            let stretched = blocks(&life.observations, &self.prior.clock);
            log_evidence(&filter.particles) + stretched.iter().map(|block| self.log_stretch(&block.mean)).sum::<f64>()
        };
        lives.par_iter().map(of_life).collect()
    }

    /// Log of how much the measure stretches deviations there.
    pub(crate) fn log_stretch(&self, deviations: &[f64]) -> f64 {
        deviations.iter().map(|x| libm::log(self.coordinate.slope(*x))).sum()
    }
}

/// The end of life of deviations in reference units, the same in every measure.
pub(crate) fn limits(model: &FaultModel) -> Limits {
    Limits { faults: vec![(0.0, REFERENCE_LIMIT); model.len()] }
}

/// Weights of laws that have seen something, summing to one.
pub(crate) fn weights(log_weights: &[f64]) -> Vec<f64> {
    let total = log_sum(log_weights);
    log_weights.iter().map(|log_weight| libm::exp(log_weight - total)).collect()
}

fn candidates() -> Vec<Coordinate> {
    let laws = EXPONENTS.iter().flat_map(|&exponent| OFFSETS.map(|offset| Coordinate { exponent, offset }));
    std::iter::once(Coordinate::IDENTITY).chain(laws).collect()
}

fn in_measure(lives: &[EndedLife], coordinate: &Coordinate) -> Vec<Vec<Observation>> {
    let of_life = |life: &EndedLife| life.observations.iter().map(|seen| coordinate.observation(seen)).collect();
    lives.iter().map(of_life).collect()
}

/// A start from which to learn: any rate, and biases that take a characteristic life to the limit or so.
fn vague() -> FleetPrior {
    let [first, last] = FEEDING.map(libm::log);
    let step = (last - first) / (FEEDING_RATES - 1) as f64;
    let feeding = (0..FEEDING_RATES).map(|i| libm::exp(first + step * i as f64));
    let rates_per_h: Vec<f64> =
        SLOWING.into_iter().chain([STEADY]).chain(feeding).map(|rate| rate / REFERENCE_LIFE_FH).collect();
    let rate_weights = vec![1.0 / rates_per_h.len() as f64; rates_per_h.len()];
    let bias = |share: f64, sd: f64| BiasPrior {
        mean_per_h: share * REFERENCE_LIMIT / REFERENCE_LIFE_FH,
        sd_per_h: sd * REFERENCE_LIMIT / REFERENCE_LIFE_FH,
    };
    let alone = GroupPrior { rate_weights, minor: bias(0.2, 0.3), dominant: bias(0.8, 0.8), dominance: 1.0 };
    FleetPrior {
        rates_per_h,
        pair: alone.clone(),
        one_sided: alone,
        process_noise: PROCESS_NOISE,
        ..FleetPrior::vague()
    }
}

/// Where lives start, by what they show first.
fn start_of(histories: &[Vec<Observation>]) -> StartPrior {
    let firsts = histories.iter().filter_map(|life| life.first());
    let (mut values, mut noise) = (Vec::new(), 0.0);
    for first in firsts {
        for (x, sigma) in first.fault_vector.values().iter().zip(&first.sigma) {
            values.push(*x);
            noise += sigma * sigma;
        }
    }
    let n = values.len() as f64;
    if n < 1.0 {
        return StartPrior::default();
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n - noise / n;
    StartPrior { mean, sd: variance.max(0.0).sqrt().max(START_SD) }
}

/// Blocks that hold observations enough, whether lives have eleven of them or thousands.
fn clock_for(lives: &[EndedLife]) -> Clock {
    let mut counts: Vec<usize> = lives.iter().map(|life| life.observations.len()).collect();
    let mut steps: Vec<f64> =
        lives.iter().flat_map(|life| life.observations.windows(2).map(|pair| pair[1].t_fh - pair[0].t_fh)).collect();
    counts.sort_unstable();
    steps.sort_unstable_by(f64::total_cmp);
    let usual = Clock::default();
    let (Some(count), Some(step)) = (counts.get(counts.len() / 2), steps.get(steps.len() / 2)) else { return usual };
    Clock { observations: (count / 200).clamp(1, usual.observations), gap_fh: usual.gap_fh.max(4.0 * step), ..usual }
}
