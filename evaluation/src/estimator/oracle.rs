//! The bound: a filter that is told how its life grows.
//!
//! - What: the state of a life whose A, B and growth up to now are known, carried to the boundary. What
//!   it does not know is left: the error of diagnoses, the noise of wear, the load to come, the boundary's
//!   own error, and changes of growth to come, which are drawn from the law of the fleet where the growth
//!   of the life may change.
//! - Update rule: particles of all deviations together, x' = g A x + B u + noise, one-sided faults
//!   reflected at nominal; steps are of second order in A dt and end where the growth changes. Each
//!   closed block weighs them, an outlier linear in its size, and resamples them. From the last block to
//!   now they go on with the growth that is known; after that the load is the mean of the life so far and
//!   the temperature is at its reference, about which it goes with the seasons.
//! - Requirements: the law of the very life. It is a bound where the law is linear as above: a repair, a
//!   drifting sensor or another exponent are not in A, B and g.
//! - Source: Gordon, Salmond, Smith 1993 for the filter, since reflection at nominal makes beliefs that are
//!   far from normal; giving away the parameters as in bounds of filtering (Tichavsky et al. 1998).

use domain::FaultModel;
use numerics::{Stream, log_sum_exp::normalised, resampling::systematic};
use prognosis::{
    Block, Boundary, Estimator, FleetPrior, Follower, Observation, OpenBlock, PredictionSettings, RulEstimate,
    START_SD,
    clipping::{ClippedMean, Expected},
    growth_changes::{ChangesToCome, GrowthChanges},
    robust_log_likelihood,
};

use super::extrapolation::{Extrapolation, Growth, STEP_FH, Start};

/// Number of particles.
const PARTICLES: usize = 1000;
/// Seed of the random numbers of the filter.
const SEED: u64 = 0;
/// Load before any is known.
const USUAL_LOAD: f64 = 1.0;

/// What is true of the growth of one life.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// A, 1/h, by rows.
    pub state_matrix: Vec<Vec<f64>>,
    /// B, 1/h, by rows; columns as u = [1, load, temperature].
    pub control_matrix: Vec<[f64; 3]>,
    /// The growth multiplier g from each time on, hours since the start of the life, in ascending order; at
    /// least one. Before the first time it is that of the first.
    pub growth: Vec<(f64, f64)>,
    /// How g goes on to change, if it may.
    pub changes: Option<GrowthChanges>,
}

impl Law {
    fn growth_at(&self, t_fh: f64) -> f64 {
        let begun = self.growth.partition_point(|&(from_fh, _)| from_fh <= t_fh);
        self.growth[begun.max(1) - 1].1
    }

    /// The end of the step from `t_fh`: `until_fh`, or where the growth changes, or one step on.
    fn step_end_fh(&self, t_fh: f64, until_fh: f64) -> f64 {
        let change = self.growth.iter().find(|(from_fh, _)| *from_fh > t_fh);
        change.map_or(until_fh, |(from_fh, _)| until_fh.min(*from_fh)).min(t_fh + STEP_FH)
    }

    /// B u.
    fn drive_per_h(&self, [load, temperature]: [f64; 2]) -> Vec<f64> {
        self.control_matrix.iter().map(|[b, of_load, of_heat]| b + of_load * load + of_heat * temperature).collect()
    }

    /// x after a step of `grown_h`, hours times growth multiplier, with `added` in the same step: x + f + A f / 2
    /// for f = A x + added.
    fn carried(&self, x: &[f64], grown_h: f64, added: &[f64]) -> Vec<f64> {
        let times = |x: &[f64]| -> Vec<f64> {
            let row = |row: &Vec<f64>| grown_h * row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
            self.state_matrix.iter().map(row).collect()
        };
        let first: Vec<f64> = times(x).iter().zip(added).map(|(moved, added)| moved + added).collect();
        let second = times(&first);
        (0..x.len()).map(|i| x[i] + first[i] + 0.5 * second[i]).collect()
    }
}

/// The bound as an [`Estimator`] of one life: that of the law.
pub struct Oracle<'a> {
    /// Names, nominal values and groups of the faults.
    pub model: &'a FaultModel,
    /// For the process noise and the error of the boundary; its rates and biases are not used.
    pub prior: &'a FleetPrior,
    /// The boundary at which life ends.
    pub boundary: &'a dyn Boundary,
    /// What is true of the life.
    pub law: &'a Law,
}

impl Oracle<'_> {
    /// The name of the estimator.
    pub const NAME: &'static str = "oracle";
}

impl Estimator for Oracle<'_> {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let mut stream = Stream::new(SEED, &[Self::NAME]);
        let mut new = |_| (0..self.model.len()).map(|_| START_SD * stream.normal()).collect();
        Box::new(Life {
            oracle: self,
            open: OpenBlock::new(self.prior.clock),
            t_fh: 0.0,
            particles: (0..PARTICLES).map(&mut new).collect(),
            stream,
            inputs: Inputs::default(),
        })
    }
}

struct Life<'a> {
    oracle: &'a Oracle<'a>,
    open: OpenBlock,
    /// Time of the particles, hours since the start of the life.
    t_fh: f64,
    /// Deviations from nominal.
    particles: Vec<Vec<f64>>,
    stream: Stream,
    inputs: Inputs,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        if let Some(block) = self.open.push(observation.clone()) {
            self.update(&block);
        }
        self.inputs.push(observation);
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let Oracle { model, prior, boundary, law } = *self.oracle;
        let input = self.inputs.clone().take_until(f64::INFINITY);
        let start = |stream: &mut Stream| {
            let mut deviation = self.particles[stream.below(PARTICLES)].clone();
            self.carry(&mut deviation, input, now_fh, stream);
            Start { deviation, growth: Known::new(law, self.inputs.usual(), now_fh, stream) }
        };
        RulEstimate {
            ends_fh: Extrapolation::new(model, prior, boundary).ends_fh(start, 0.0, settings, stream),
            propagation: None,
            doubted: false,
        }
    }
}

impl Life<'_> {
    fn update(&mut self, block: &Block) {
        let input = self.inputs.take_until(block.centre_fh);
        let (mut particles, mut stream) = (std::mem::take(&mut self.particles), self.stream.clone());
        particles.iter_mut().for_each(|x| self.carry(x, input, block.centre_fh, &mut stream));
        let log_weights: Vec<f64> = particles.iter().map(|x| self.log_likelihood(x, block)).collect();
        let chosen = systematic(&normalised(&log_weights), stream.uniform());
        self.particles = chosen.into_iter().map(|parent| particles[parent].clone()).collect();
        self.stream = stream;
        self.t_fh = block.centre_fh.max(self.t_fh);
    }

    /// Carries a deviation from the time of the particles to a later one.
    fn carry(&self, x: &mut Vec<f64>, input: [f64; 2], until_fh: f64, stream: &mut Stream) {
        let Oracle { model, prior, law, .. } = self.oracle;
        let (drive, mut t_fh) = (law.drive_per_h(input), self.t_fh);
        while t_fh < until_fh {
            let end_fh = law.step_end_fh(t_fh, until_fh);
            let dt_h = end_fh - t_fh;
            let added: Vec<f64> = drive.iter().map(|drive| drive * dt_h).collect();
            *x = law.carried(x, law.growth_at(t_fh) * dt_h, &added);
            let noise = prior.process_noise * dt_h.sqrt();
            x.iter_mut().for_each(|x| *x += noise * stream.normal());
            model.one_sided().for_each(|entry| x[entry] = x[entry].abs());
            t_fh = end_fh;
        }
    }

    /// Log-likelihood of a block at the deviation x, up to a constant.
    fn log_likelihood(&self, x: &[f64], block: &Block) -> f64 {
        let model = self.oracle.model;
        let mut expected: Vec<_> = x.iter().map(|&x| Expected { mean: x, slope: 1.0, variance_ratio: 1.0 }).collect();
        model.one_sided().for_each(|entry| expected[entry] = ClippedMean::TrimmedT4.at(x[entry], block.sigma[entry]));
        let of_entry = |(entry, expected): (usize, &Expected)| {
            let variance = expected.variance_ratio * block.variance[entry];
            let innovation = block.mean[entry] - model.nominal[entry] - expected.mean;
            robust_log_likelihood(innovation * innovation / variance, variance)
        };
        expected.iter().enumerate().map(of_entry).sum()
    }
}

/// Load and temperature of a life.
#[derive(Debug, Clone, Default)]
struct Inputs {
    /// Since the last block, with their times.
    waiting: Vec<(f64, [f64; 2])>,
    loads: f64,
    load_sum: f64,
}

impl Inputs {
    /// What is not known of an observation is as usual.
    fn push(&mut self, observation: &Observation) {
        if let Some(load) = observation.load {
            self.load_sum += load;
            self.loads += 1.0;
        }
        let [load, temperature] = self.usual();
        let input = [observation.load.unwrap_or(load), observation.temperature.unwrap_or(temperature)];
        self.waiting.push((observation.t_fh, input));
    }

    /// Mean load so far, and the reference of the temperature.
    fn usual(&self) -> [f64; 2] {
        [if self.loads > 0.0 { self.load_sum / self.loads } else { USUAL_LOAD }, 0.0]
    }

    /// Means of those before `until_fh`, which are not needed after that.
    fn take_until(&mut self, until_fh: f64) -> [f64; 2] {
        let before = self.waiting.partition_point(|(t_fh, _)| *t_fh < until_fh);
        if before == 0 {
            return self.usual();
        }
        let taken = self.waiting.drain(..before);
        let sums = taken.fold([0.0; 2], |[loads, heat], (_, [load, temperature])| [loads + load, heat + temperature]);
        sums.map(|sum| sum / before as f64)
    }
}

/// Growth as the law has it now, with changes to come.
struct Known<'a> {
    law: &'a Law,
    drive: Vec<f64>,
    multiplier: f64,
    /// Hours from now.
    t_fh: f64,
    changes: Option<ChangesToCome>,
}

impl<'a> Known<'a> {
    fn new(law: &'a Law, input: [f64; 2], now_fh: f64, stream: &Stream) -> Self {
        let changes = law.changes.map(|changes| ChangesToCome::new(changes, stream));
        let drive = law.drive_per_h(input).iter().map(|drive| drive * STEP_FH).collect();
        Self { law, drive, multiplier: law.growth_at(now_fh), t_fh: 0.0, changes }
    }

    /// The integral of the multiplier over the next step.
    fn grown_h(&mut self) -> f64 {
        let (mut grown_h, end_fh) = (0.0, self.t_fh + STEP_FH);
        if let Some(changes) = &mut self.changes {
            while changes.next_fh() < end_fh {
                grown_h += self.multiplier * (changes.next_fh() - self.t_fh);
                self.t_fh = changes.next_fh();
                self.multiplier *= changes.make();
            }
        }
        grown_h += self.multiplier * (end_fh - self.t_fh);
        self.t_fh = end_fh;
        grown_h
    }
}

impl Growth for Known<'_> {
    fn step(&mut self, x: &[f64]) -> Vec<f64> {
        let grown_h = self.grown_h();
        self.law.carried(x, grown_h, &self.drive)
    }
}
