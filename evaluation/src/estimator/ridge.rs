//! Ridge regression of the growth law to the fleet prior, in integral form.
//!
//! - What: lambda and b of each fault from x(t) = lambda int x dt + b t + w(t), so that no observation is
//!   ever differentiated.
//! - Update rule: per entry a Kalman filter on (lambda, b, w) over closed blocks, w the process noise; its
//!   start is the fleet's mean rate and bias with their spread, which makes it a ridge regression whose
//!   residual wanders. The integral is a trapezoidal sum over the observed blocks.
//! - Requirements: x = 0 at the start of the life. The observed integral counts as exact, clipping of
//!   one-sided faults is ignored, and the one dominant fault of a life is not told from the others: the
//!   price of a linear regression.
//! - Source: Berri 2021, eq. 2.26, integrated; Hoerl and Kennard 1970 for the ridge.

use domain::{FaultGroup, FaultModel};
use numerics::Stream;
use prognosis::{
    Block, Boundary, Estimator, FleetPrior, Follower, GroupPrior, Moments, Observation, OpenBlock, PredictionSettings,
    RulEstimate,
};

use super::extrapolation::{Extrapolation, Separate, Start, propagation};

const NAME: &str = "ridge";
/// Standard deviation of a new actuator's deviation from nominal.
const START_SD: f64 = 1e-3;
/// lambda, b, w.
const UNKNOWNS: usize = 3;

/// The ridge regression as an [`Estimator`].
pub struct Ridge<'a> {
    /// Names, nominal values and groups of the faults.
    pub model: &'a FaultModel,
    /// What earlier lives have taught.
    pub prior: &'a FleetPrior,
    /// The boundary at which life ends.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Ridge<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let mut entries = vec![Entry::new([0.0; 2], [0.0; 2]); self.model.len()];
        let groups = self.model.groups.len() as f64;
        for group in &self.model.groups {
            let (means, variances) = growth_prior(self.prior.of(group), &self.prior.rates_per_h, groups);
            let indices = match group {
                FaultGroup::OneSided { index } | FaultGroup::Free { index } => vec![*index],
                FaultGroup::Pair { indices } => indices.to_vec(),
            };
            indices.into_iter().for_each(|index| entries[index] = Entry::new(means, variances));
        }
        Box::new(Life { ridge: self, open: OpenBlock::new(self.prior.clock), t_fh: 0.0, observations: 0, entries })
    }
}

/// Mean and variance of lambda and of b; one of `groups` groups is the dominant one.
fn growth_prior(prior: &GroupPrior, rates_per_h: &[f64], groups: f64) -> ([f64; 2], [f64; 2]) {
    let weighted = |value: &dyn Fn(f64) -> f64| -> f64 {
        prior.rate_weights.iter().zip(rates_per_h).map(|(weight, &rate)| weight * value(rate)).sum()
    };
    let rate = weighted(&|rate| rate);
    let classes = [(1.0 / groups, prior.dominant), (1.0 - 1.0 / groups, prior.minor)];
    let bias: f64 = classes.iter().map(|(share, class)| share * class.mean_per_h).sum();
    let square = classes.iter().map(|(share, class)| {
        share * (class.sd_per_h * class.sd_per_h + (class.mean_per_h - bias) * (class.mean_per_h - bias))
    });
    ([rate, bias], [weighted(&|r| (r - rate) * (r - rate)), square.sum()])
}

struct Life<'a> {
    ridge: &'a Ridge<'a>,
    open: OpenBlock,
    /// Centre of the last block, hours since the start of the life.
    t_fh: f64,
    observations: usize,
    entries: Vec<Entry>,
}

impl Life<'_> {
    fn update(&mut self, block: &Block) {
        let dt_fh = block.centre_fh - self.t_fh;
        self.t_fh = block.centre_fh;
        self.observations = block.observations.end;
        let noise = self.ridge.prior.process_noise;
        for (index, entry) in self.entries.iter_mut().enumerate() {
            let observed = block.mean[index] - self.ridge.model.nominal[index];
            entry.integral += 0.5 * dt_fh * (entry.observed + observed);
            entry.observed = observed;
            entry.covariance[2][2] += noise * noise * dt_fh;
            entry.correct([entry.integral, self.t_fh, 1.0], block.variance[index]);
        }
    }
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        if let Some(block) = self.open.push(observation.clone()) {
            self.update(&block);
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let Ridge { model, prior, boundary } = *self.ridge;
        let factors: Vec<_> = self.entries.iter().map(Entry::factor).collect();
        let start = |stream: &mut Stream| {
            let mut growth = Separate { rate_per_h: Vec::new(), bias_per_h: Vec::new() };
            let mut deviation = Vec::new();
            for (entry, factor) in self.entries.iter().zip(&factors) {
                let [rate, bias, wander] = entry.draw(factor, stream);
                growth.rate_per_h.push(rate);
                growth.bias_per_h.push(bias);
                deviation.push(rate * entry.integral + bias * self.t_fh + wander);
            }
            Start { deviation, growth }
        };
        let moments = |entry: &Entry| {
            [0, 1].map(|i| Moments { mean: entry.mean[i], sigma: entry.covariance[i][i].max(0.0).sqrt() })
        };
        let growth: Vec<_> = self.entries.iter().map(moments).collect();
        RulEstimate {
            ends_fh: Extrapolation::new(model, prior, boundary).ends_fh(start, now_fh - self.t_fh, settings, stream),
            propagation: Some(propagation(&growth, NAME, self.observations)),
            doubted: false,
        }
    }
}

/// The regression of one entry of the fault vector.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    /// lambda, b, w.
    mean: [f64; UNKNOWNS],
    covariance: [[f64; UNKNOWNS]; UNKNOWNS],
    /// Deviation of the last block.
    observed: f64,
    /// Its integral over time, h.
    integral: f64,
}

impl Entry {
    /// The entry of a new life; mean and variance of lambda and b.
    fn new(mean: [f64; 2], variance: [f64; 2]) -> Self {
        let mut covariance = [[0.0; UNKNOWNS]; UNKNOWNS];
        (0..2).for_each(|i| covariance[i][i] = variance[i]);
        covariance[2][2] = START_SD * START_SD;
        Self { mean: [mean[0], mean[1], 0.0], covariance, observed: 0.0, integral: 0.0 }
    }

    /// Kalman update with the last block: observed = row . unknowns + error.
    fn correct(&mut self, row: [f64; UNKNOWNS], variance: f64) {
        let p = self.covariance;
        let shared: [f64; UNKNOWNS] = std::array::from_fn(|i| (0..UNKNOWNS).map(|j| p[i][j] * row[j]).sum());
        let predicted: f64 = (0..UNKNOWNS).map(|i| row[i] * self.mean[i]).sum();
        let spread: f64 = (0..UNKNOWNS).map(|i| row[i] * shared[i]).sum::<f64>() + variance;
        for i in 0..UNKNOWNS {
            self.mean[i] += shared[i] / spread * (self.observed - predicted);
            for j in 0..UNKNOWNS {
                self.covariance[i][j] -= shared[i] * shared[j] / spread;
            }
        }
    }

    /// The lower Cholesky factor of the covariance; a direction without variance stays out.
    fn factor(&self) -> [[f64; UNKNOWNS]; UNKNOWNS] {
        let mut factor = [[0.0; UNKNOWNS]; UNKNOWNS];
        for j in 0..UNKNOWNS {
            for i in j..UNKNOWNS {
                let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let left = self.covariance[i][j] - known;
                factor[i][j] = match i == j {
                    true => left.max(0.0).sqrt(),
                    false if factor[j][j] > 0.0 => left / factor[j][j],
                    false => 0.0,
                };
            }
        }
        factor
    }

    fn draw(&self, factor: &[[f64; UNKNOWNS]; UNKNOWNS], stream: &mut Stream) -> [f64; UNKNOWNS] {
        let z: [f64; UNKNOWNS] = std::array::from_fn(|_| stream.normal());
        std::array::from_fn(|i| self.mean[i] + (0..=i).map(|j| factor[i][j] * z[j]).sum::<f64>())
    }
}
