//! Lives drawn from a fleet prior: the very model that the filter assumes.

use domain::{FaultGroup, FaultModel, FaultVector};
use numerics::Stream;
use prognosis::{BiasPrior, FleetPrior, Observation};

/// Standard deviation of one observation: one-sided faults, pairs.
pub const SIGMA: [f64; 2] = [0.0075, 0.02];
/// Time between observations and of a step, hours.
pub const STEP_FH: f64 = 2.0;

/// Growth of each entry of the electrical faults.
#[derive(Debug, Clone)]
pub struct Growth {
    pub rate_per_h: [f64; 5],
    pub bias_per_h: [f64; 5],
    pub process_noise: f64,
    /// Multiplier of the rates from each time on, hours, in ascending order; one before.
    pub changes: Vec<(f64, f64)>,
}

impl Growth {
    /// A draw from the prior.
    pub fn draw(prior: &FleetPrior, random: &mut Stream) -> Self {
        let model = FaultModel::electrical();
        let dominant = pick(&model.groups.iter().map(|group| prior.of(group).dominance).collect::<Vec<_>>(), random);
        let mut growth = Self {
            rate_per_h: [0.0; 5],
            bias_per_h: [0.0; 5],
            process_noise: prior.process_noise,
            changes: Vec::new(),
        };
        for (index, group) in model.groups.iter().enumerate() {
            let kind = prior.of(group);
            let BiasPrior { mean_per_h, sd_per_h } = if index == dominant { kind.dominant } else { kind.minor };
            let rate = prior.rates_per_h[pick(&kind.rate_weights, random)];
            let entries = match group {
                FaultGroup::OneSided { index } | FaultGroup::Free { index } => vec![*index],
                FaultGroup::Pair { indices } => indices.to_vec(),
            };
            for entry in entries {
                growth.rate_per_h[entry] = rate;
                growth.bias_per_h[entry] = mean_per_h + sd_per_h * random.normal();
            }
        }
        growth
    }

    /// Deviations every step from 0 to `until_fh`, by exact steps.
    pub fn path(&self, until_fh: f64, random: &mut Stream) -> Vec<[f64; 5]> {
        let mut x = [0.0; 5];
        let mut path = vec![x];
        while (path.len() - 1) as f64 * STEP_FH < until_fh {
            let multiplier = self.multiplier_at((path.len() - 1) as f64 * STEP_FH);
            for (entry, x) in x.iter_mut().enumerate() {
                let (rate, bias) = (multiplier * self.rate_per_h[entry], self.bias_per_h[entry]);
                let grown = (rate * STEP_FH).exp();
                let noise = self.process_noise * ((grown * grown - 1.0) / (2.0 * rate)).sqrt();
                *x = grown * *x + (grown - 1.0) / rate * bias + noise * random.normal();
                *x = if entry < 3 { x.abs() } else { *x };
            }
            path.push(x);
        }
        path
    }

    fn multiplier_at(&self, t_fh: f64) -> f64 {
        let begun = self.changes.partition_point(|(from_fh, _)| *from_fh <= t_fh);
        if begun == 0 { 1.0 } else { self.changes[begun - 1].1 }
    }
}

/// Observations of a path, clipped at zero, with errors as heavy-tailed as those of fault estimates:
/// Student's t with four degrees of freedom, standard deviation `scale` times [`SIGMA`].
pub fn observe(path: &[[f64; 5]], scale: f64, random: &mut Stream) -> Vec<Observation> {
    let sigma: Vec<f64> = (0..5).map(|entry| scale * SIGMA[usize::from(entry >= 3)]).collect();
    let observation = |(step, x): (usize, &[f64; 5])| {
        let k = (0..5).map(|entry| {
            let nominal = if entry < 3 { 0.0 } else { 0.5 };
            let error = random.normal() / (random.exponential() + random.exponential()).sqrt();
            (nominal + x[entry] + sigma[entry] * error).max(0.0)
        });
        Observation {
            t_fh: step as f64 * STEP_FH,
            fault_vector: FaultVector(k.collect()),
            sigma: sigma.clone(),
            load: None,
            temperature: None,
        }
    };
    path.iter().enumerate().map(observation).collect()
}

/// An index with probability proportional to its weight.
fn pick(weights: &[f64], random: &mut Stream) -> usize {
    let mut left = random.uniform() * weights.iter().sum::<f64>();
    for (index, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 {
            return index;
        }
    }
    weights.len() - 1
}
