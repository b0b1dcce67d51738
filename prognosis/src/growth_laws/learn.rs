//! Learning the laws of a fleet by evidence, and their priors from its lives.
//!
//! - What: [`GrowthLaws`] that explain the lives of a fleet.
//! - Update rule: every candidate measure is fitted roughly; the likeliest are fitted well. A life's responsibilities are
//!   its own; shares are their means, which is expectation maximisation. What failure times differ by from where growth
//!   crosses the limit is learned last.
//! - Requirements: offline. Observations with their noise; whether a life ended in failure matters for the error of the
//!   failure time only.
//! - Source: MacKay 1992 for evidence; Dempster, Laird, Rubin 1977.

use domain::FaultModel;
use numerics::log_sum_exp::normalised;
use rayon::prelude::*;

use super::{GrowthLaw, GrowthLaws, measured};
use crate::{
    block::Observation,
    boundary::Limits,
    clock::Clock,
    coordinate::Coordinate,
    ended::{EndedLife, Ending},
    failure_time::{FinishedLife, fit_failure_time_error},
    fit::{FitSettings, NoHistory, fit_prior_from},
    pace::PaceLaw,
    pace_fit::PaceLesson,
    prior::{BiasPrior, FleetPrior, GroupPrior, START_SD, StartPrior},
    scale::{REFERENCE_LIFE_FH, REFERENCE_LIMIT},
};

/// Powers and offsets that are tried besides growth as it is: wear that slows down, and cracks.
const EXPONENTS: [f64; 6] = [-2.0, -1.0, 1.5, 2.0, 3.0, 4.0];
const OFFSETS: [f64; 3] = [0.07, 0.2, 0.6];
/// Most laws that are carried.
const MOST: usize = 3;
/// Smallest share of a law that is worth its time.
const LEAST_SHARE: f64 = 0.02;
/// Growth rates per characteristic life: of wear that slows down, of steady wear, and of wear that feeds on itself.
const SLOWING: [f64; 5] = [-20.0, -8.0, -3.0, -1.0, -0.3];
const STEADY: f64 = 1e-3;
const FEEDING: [f64; 2] = [0.1, 15.0];
const FEEDING_RATES: usize = 15;
/// Process noise from which to seek, 1/sqrt(h), and how.
const PROCESS_NOISE: f64 = 2.5e-4;
const ROUGH: FitSettings = FitSettings { rounds: 7, parent_lives: 0.0, noise_factor: 2.0 };
const WELL: FitSettings = FitSettings { rounds: 8, parent_lives: 0.0, noise_factor: 1.2 };
/// The filter with changes is dear.
const CHANGING: FitSettings = FitSettings { rounds: 2, parent_lives: 0.0, noise_factor: 1.0 };
/// Rounds in which shares are learned.
const SHARE_ROUNDS: usize = 20;
/// A probability of the first or the last rate that is tried above this says that the grid is too small.
const AT_EDGE: f64 = 0.25;
/// Growth at random that gathers less than this severity over a characteristic life is none.
const NO_NOISE: f64 = 1e-3;
/// Blocks of a life with observations enough for more than one each.
const BLOCKS: usize = 200;

impl GrowthLaws {
    /// The laws that explain these lives best, growth in their measures being constant.
    ///
    /// # Errors
    ///
    /// If no life has a closed block of observations.
    pub fn learn(lives: &[EndedLife], model: &FaultModel, seed: u64) -> Result<Self, NoHistory> {
        let clock = clock_for(lives);
        let rough = |coordinate: Coordinate| {
            let histories = measured(lives, &coordinate);
            let guess = FleetPrior { clock, start: start_of(&histories), ..vague() };
            let prior = fit_prior_from(guess, &histories, model, &ROUGH)?;
            let law = GrowthLaw { coordinate, prior, share: 1.0 };
            let log_evidence: f64 = law.log_evidence(lives, model).iter().sum();
            Ok((law, log_evidence))
        };
        let mut ranked: Vec<(GrowthLaw, f64)> = candidates().into_par_iter().map(rough).collect::<Result<_, _>>()?;
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let likeliest = ranked.into_iter().take(MOST).map(|(law, _)| law.refitted(lives, model, &WELL));
        let laws = likeliest.collect::<Result<_, _>>()?;
        Ok(Self { laws }.with_shares(lives, model).with_failure_time_errors(lives, model, seed))
    }

    /// What these lives tell of the pace of wear, by the measure of damage in which growth at that pace explains them best;
    /// `None` where no life tells of load or temperature.
    ///
    /// # Errors
    ///
    /// If no life has a closed block of observations.
    pub fn learn_pace(lives: &[EndedLife], model: &FaultModel) -> Result<Option<PaceLesson>, NoHistory> {
        let clock = clock_for(lives);
        let by = |coordinate: Coordinate| {
            let histories = measured(lives, &coordinate);
            let guess = FleetPrior { clock, start: start_of(&histories), ..vague() };
            let prior = fit_prior_from(guess, &histories, model, &ROUGH)?;
            let Some(lesson) = PaceLaw::learn(lives, model, (coordinate, &prior), None) else { return Ok(None) };
            let aged: Vec<EndedLife> = lives.iter().map(|life| life.aged(&lesson.law)).collect();
            let law = GrowthLaw { coordinate, prior, share: 1.0 }.refitted(&aged, model, &ROUGH)?;
            let log_evidence: f64 = law.log_evidence(&aged, model).iter().sum();
            Ok(Some((lesson, log_evidence)))
        };
        let told: Vec<Option<(PaceLesson, f64)>> = candidates().into_par_iter().map(by).collect::<Result<_, _>>()?;
        let best = told.into_iter().flatten().reduce(|a, b| if b.1 > a.1 { b } else { a });
        Ok(best.map(|(lesson, _)| lesson))
    }

    /// The same laws where growth may change in mid-life.
    ///
    /// # Errors
    ///
    /// If no life has a closed block of observations.
    pub fn with_growth_changes(&self, lives: &[EndedLife], model: &FaultModel, seed: u64) -> Result<Self, NoHistory> {
        let changing = |law: &GrowthLaw| {
            let prior = law.prior.clone().with_growth_changes();
            GrowthLaw { prior, ..law.clone() }.refitted(lives, model, &CHANGING)
        };
        let laws = self.laws.iter().map(changing).collect::<Result<_, _>>()?;
        Ok(Self { laws }.with_shares(lives, model).with_failure_time_errors(lives, model, seed))
    }

    /// Shares by expectation maximisation; laws that hardly any life goes by are dropped.
    fn with_shares(self, lives: &[EndedLife], model: &FaultModel) -> Self {
        let log_evidence: Vec<Vec<f64>> = self.laws.iter().map(|law| law.log_evidence(lives, model)).collect();
        let shares = shares(&log_evidence);
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
        let boundary = Limits::reference(model.len());
        for law in &mut self.laws {
            let failed: Vec<FinishedLife> = law.finished(lives).into_iter().flatten().collect();
            law.prior.failure_time_error = fit_failure_time_error(&failed, model, &law.prior, &boundary, seed);
        }
        self
    }
}

impl GrowthLaw {
    /// The first or the last rate that is tried, where many lives grow at it: growth is not described well.
    pub(crate) fn edge(&self) -> Option<usize> {
        let weights = &self.prior.one_sided.rate_weights;
        [0, weights.len() - 1].into_iter().find(|index| weights[*index] > AT_EDGE)
    }

    /// What was learned at the edge of what is tried, or as nothing, in words.
    pub(crate) fn oddities(&self) -> Vec<String> {
        let Self { coordinate: Coordinate { exponent, .. }, prior, .. } = self;
        let mut oddities = Vec::new();
        if let Some(index) = self.edge() {
            oddities.push(format!(
                "{:.0} % of the lives grow at the farthest rate that is tried, {:.1} per characteristic life",
                100.0 * prior.one_sided.rate_weights[index],
                prior.rates_per_h[index] * REFERENCE_LIFE_FH
            ));
        }
        if [EXPONENTS[0], EXPONENTS[EXPONENTS.len() - 1]].contains(exponent) {
            oddities.push(format!("damage grows with its power {exponent}, the farthest that is tried"));
        }
        if prior.process_noise * REFERENCE_LIFE_FH.sqrt() < NO_NOISE * REFERENCE_LIMIT {
            oddities.push("no growth at random was found, as if all of it were known".to_owned());
        }
        oddities
    }

    fn refitted(self, lives: &[EndedLife], model: &FaultModel, settings: &FitSettings) -> Result<Self, NoHistory> {
        let histories = self.measured(lives);
        let prior = fit_prior_from(self.prior, &histories, model, settings)?;
        Ok(Self { prior, ..self })
    }

    /// Lives that failed, in this law's measure.
    pub(crate) fn finished(&self, lives: &[EndedLife]) -> Vec<Option<FinishedLife>> {
        let finished = |(life, observations): (&EndedLife, Vec<Observation>)| {
            (life.ending == Ending::Failed).then_some(FinishedLife { observations, failure_fh: life.end_fh })
        };
        lives.iter().zip(self.measured(lives)).map(finished).collect()
    }
}

/// Share of each law, given the log of the evidence of each life under it; half a life more for each, so that none is
/// ruled out by few.
fn shares(log_evidence: &[Vec<f64>]) -> Vec<f64> {
    let (laws, lives) = (log_evidence.len(), log_evidence[0].len());
    let mut shares = vec![1.0 / laws as f64; laws];
    for _ in 0..SHARE_ROUNDS {
        let mut sums = vec![0.5; laws];
        for life in 0..lives {
            let log_weights: Vec<f64> =
                shares.iter().zip(log_evidence).map(|(share, of_law)| libm::log(*share) + of_law[life]).collect();
            normalised(&log_weights).iter().zip(&mut sums).for_each(|(weight, sum)| *sum += weight);
        }
        shares = sums.iter().map(|sum| sum / (lives as f64 + 0.5 * laws as f64)).collect();
    }
    shares
}

fn candidates() -> Vec<Coordinate> {
    let laws = EXPONENTS.iter().flat_map(|&exponent| OFFSETS.map(|offset| Coordinate { exponent, offset }));
    std::iter::once(Coordinate::IDENTITY).chain(laws).collect()
}

/// A start from which to learn: any rate, and biases that take a characteristic life to the limit or so.
fn vague() -> FleetPrior {
    let [first, last] = FEEDING.map(libm::log);
    let step = (last - first) / (FEEDING_RATES - 1) as f64;
    let feeding = (0..FEEDING_RATES).map(|i| libm::exp(first + step * i as f64));
    let rates_per_h: Vec<f64> =
        SLOWING.into_iter().chain([STEADY]).chain(feeding).map(|rate| rate / REFERENCE_LIFE_FH).collect();
    let rate_weights = vec![1.0 / rates_per_h.len() as f64; rates_per_h.len()];
    let per_h = REFERENCE_LIMIT / REFERENCE_LIFE_FH;
    let bias = |mean: f64, sd: f64| BiasPrior { mean_per_h: mean * per_h, sd_per_h: sd * per_h };
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
    let seen = firsts.flat_map(|first| first.fault_vector.values().iter().zip(&first.sigma));
    let (values, noise): (Vec<f64>, Vec<f64>) = seen.map(|(x, sigma)| (*x, sigma * sigma)).unzip();
    if values.is_empty() {
        return StartPrior::default();
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().zip(&noise).map(|(x, noise)| (x - mean) * (x - mean) - noise).sum::<f64>() / n;
    StartPrior { mean, sd: variance.max(0.0).sqrt().max(START_SD) }
}

/// Blocks that hold observations enough, whether lives have eleven of them or thousands.
fn clock_for(lives: &[EndedLife]) -> Clock {
    let mut counts: Vec<usize> = lives.iter().map(|life| life.observations.len()).collect();
    let of_life = |life: &EndedLife| life.observations.windows(2).map(|pair| pair[1].t_fh - pair[0].t_fh).collect();
    let mut steps_fh: Vec<f64> = lives.iter().flat_map::<Vec<f64>, _>(of_life).collect();
    counts.sort_unstable();
    steps_fh.sort_unstable_by(f64::total_cmp);
    let usual = Clock::default();
    match (counts.get(counts.len() / 2), steps_fh.get(steps_fh.len() / 2)) {
        (Some(count), Some(step_fh)) => Clock {
            observations: (count / BLOCKS).clamp(1, usual.observations),
            gap_fh: usual.gap_fh.max(4.0 * step_fh),
            ..usual
        },
        _ => usual,
    }
}
