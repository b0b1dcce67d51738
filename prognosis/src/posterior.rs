//! What the filter knows about a life at the centre of its last block.

use domain::{FaultGroup, FaultModel, FaultTrend, Propagation};
use numerics::{
    Stream,
    log_sum_exp::{log_sum, normalised, shares},
};

use crate::{
    bank::{Axis, Bank},
    growth_changes::GrowthChanges,
    kalman::Track,
    moments::Moments,
    pace::{Coefficient, LOADS, PaceLaw},
    particle::{Change, Particle, Totals, log_dominance_by},
    wear_clock::Stretch,
};

/// Columns of B: u = [1, load, temperature].
const INPUTS: usize = 3;

/// The estimator's name in reports, which tells whether growth may change.
pub(crate) fn estimator(growth_changes: bool) -> &'static str {
    if growth_changes { "rbg" } else { "rbg_constant" }
}

/// A mixture over (growth, dominant group, rates) of Gaussians in (deviation, bias).
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    pub(crate) model: FaultModel,
    pub(crate) rates_per_h: Vec<f64>,
    pub(crate) process_noise: f64,
    pub(crate) growth_changes: Option<GrowthChanges>,
    pub(crate) t_fh: f64,
    pub(crate) observations: usize,
    pub(crate) particles: Vec<ParticlePosterior>,
}

/// One hypothesis about the growth so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParticlePosterior {
    pub weight: f64,
    /// The present growth multiplier.
    pub growth: f64,
    /// How it came about, unless it is that of the start.
    pub latest_change: Option<Change>,
    pub modes: Vec<ModePosterior>,
}

/// One group of the fault model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModePosterior {
    pub dominant_probability: f64,
    pub minor: BankPosterior,
    pub dominant: BankPosterior,
}

/// One group under one hypothesis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BankPosterior {
    /// Probability of each rate.
    pub weights: Vec<f64>,
    pub axes: Vec<Axis>,
}

/// What is known about one entry of the fault vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EntryEstimate {
    /// Deviation from nominal; one-sided entries are never below zero.
    pub deviation: Moments,
    /// Present growth, 1/h.
    pub trend_per_h: Moments,
    /// Growth rate lambda, 1/h.
    pub rate_per_h: Moments,
    /// Bias b, 1/h.
    pub bias_per_h: Moments,
}

/// One draw from the posterior, per entry of the fault vector.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Draw {
    /// The present growth multiplier.
    pub growth: f64,
    /// How it changes from now on, if it does.
    pub changes: Option<GrowthChanges>,
    /// Which rate of the grid.
    pub rates: Vec<usize>,
    /// Deviation from nominal at the centre of the last block.
    pub deviation: Vec<f64>,
    /// Bias, 1/h.
    pub bias_per_h: Vec<f64>,
}

impl Posterior {
    /// The time that it belongs to, hours since the start of the life: the centre of the last block.
    pub fn t_fh(&self) -> f64 {
        self.t_fh
    }

    /// Probability of each group of the fault model being the dominant one.
    pub fn dominance(&self) -> Vec<f64> {
        let of_group = |group: usize| {
            self.particles.iter().map(|particle| particle.weight * particle.modes[group].dominant_probability).sum()
        };
        (0..self.model.groups.len()).map(of_group).collect()
    }

    /// The present growth multiplier: one at the start of a life whose growth never changes.
    pub fn growth(&self) -> Moments {
        Moments::of(self.particles.iter().map(|particle| (particle.weight, particle.growth, 0.0)))
    }

    /// Probability that the growth of this life changes.
    pub fn changing_probability(&self) -> f64 {
        self.particles[1..].iter().map(|particle| particle.weight).sum()
    }

    /// What is known about each entry of the fault vector.
    pub fn entries(&self) -> Vec<EntryEstimate> {
        let mut entries = vec![None; self.model.len()];
        for (index, group) in self.model.groups.iter().enumerate() {
            for (axis, entry) in group.entries().enumerate() {
                let mut estimate = self.entry(index, axis);
                if matches!(group, FaultGroup::OneSided { .. }) {
                    estimate.deviation.mean = estimate.deviation.mean.max(0.0);
                }
                entries[entry] = Some(estimate);
            }
        }
        entries.into_iter().map(|entry| entry.expect("every entry of the fault vector is in one group")).collect()
    }

    fn entry(&self, group: usize, axis: usize) -> EntryEstimate {
        let parts = || self.mixture(group, axis);
        EntryEstimate {
            deviation: Moments::of(parts().map(|(weight, _, track)| (weight, track.x, track.p_xx))),
            trend_per_h: Moments::of(parts().map(|(weight, rate, track)| {
                let variance = rate * rate * track.p_xx + 2.0 * rate * track.p_xb + track.p_bb;
                (weight, rate * track.x + track.b, variance)
            })),
            rate_per_h: Moments::of(parts().map(|(weight, rate, _)| (weight, rate, 0.0))),
            bias_per_h: Moments::of(parts().map(|(weight, _, track)| (weight, track.b, track.p_bb))),
        }
    }

    /// (weight, present growth rate in 1/h, belief) of every component of the mixture of one axis of a group.
    pub(crate) fn mixture(&self, group: usize, axis: usize) -> impl Iterator<Item = (f64, f64, &Track)> {
        self.particles.iter().flat_map(move |particle| {
            let parts = particle.modes[group].mixture(axis);
            parts.map(|(weight, rate, track)| {
                (particle.weight * weight, particle.growth * self.rates_per_h[rate], track)
            })
        })
    }

    /// The filtered fault vector with its present trends, as users see it.
    pub fn trends(&self) -> Vec<FaultTrend> {
        let named = self.model.names.iter().zip(&self.model.nominal).zip(self.entries());
        named
            .map(|((name, nominal), entry)| FaultTrend {
                name: name.clone(),
                value: nominal + entry.deviation.mean,
                sigma: entry.deviation.sigma,
                trend_per_1000_fh: 1000.0 * entry.trend_per_h.mean,
            })
            .collect()
    }

    /// The refitted propagation x' = A x + B u (Berri 2021, eq. 2.26): A is diagonal with the
    /// rates, the first column of B holds the biases, which absorb load and temperature.
    pub fn propagation(&self) -> Propagation {
        let entries = self.entries();
        let n = entries.len();
        let diagonal = |value: fn(&EntryEstimate) -> f64| {
            let row = |i: usize| (0..n).map(|j| if i == j { value(&entries[i]) } else { 0.0 }).collect();
            (0..n).map(row).collect()
        };
        let first_column = |value: fn(&EntryEstimate) -> f64| {
            let row = |entry| (0..INPUTS).map(|j| if j == 0 { value(entry) } else { 0.0 }).collect();
            entries.iter().map(row).collect()
        };
        Propagation {
            state_matrix: diagonal(|entry| entry.rate_per_h.mean),
            state_matrix_sigma: diagonal(|entry| entry.rate_per_h.sigma),
            control_matrix: first_column(|entry| entry.bias_per_h.mean),
            control_matrix_sigma: first_column(|entry| entry.bias_per_h.sigma),
            estimator: estimator(self.growth_changes.is_some()).to_owned(),
            observations: self.observations,
        }
    }

    /// The refitted propagation per flight hour of a mission: [`propagation`](Self::propagation) is per damage-equivalent hour.
    /// What the pace m = (L / L_ref)^p exp(beta T) makes of A x + b is told to first order about the present faults, load and
    /// temperature.
    pub fn propagation_at(&self, law: &PaceLaw, mission: &Stretch) -> Propagation {
        let Stretch { pace, load, temperature, .. } = *mission;
        let per_h = self.propagation();
        let times =
            |rows: &Vec<Vec<f64>>| rows.iter().map(|row| row.iter().map(|rate| pace * rate).collect()).collect();
        let mut at = Propagation {
            state_matrix: times(&per_h.state_matrix),
            state_matrix_sigma: times(&per_h.state_matrix_sigma),
            control_matrix: times(&per_h.control_matrix),
            control_matrix_sigma: times(&per_h.control_matrix_sigma),
            ..per_h
        };
        let slope = |of: Coefficient, per: f64, trend: Moments| {
            let value = of.mean / per * pace * trend.mean;
            (value, pace / per * libm::hypot(of.sd * trend.mean, of.mean * trend.sigma))
        };
        for (entry, (row, sigma)) in
            self.entries().iter().zip(at.control_matrix.iter_mut().zip(&mut at.control_matrix_sigma))
        {
            (row[1], sigma[1]) = slope(law.exponent, load.max(LOADS[0]), entry.trend_per_h);
            (row[2], sigma[2]) = slope(law.temperature, 1.0, entry.trend_per_h);
            row[0] -= row[1] * load + row[2] * temperature;
        }
        at
    }

    /// One draw: the growth where it may change, the dominant group, then a rate for each group, then deviation and bias.
    pub(crate) fn draw(&self, stream: &mut Stream) -> Draw {
        let n = self.model.len();
        let chosen = match self.particles.len() {
            1 => 0,
            _ => pick(self.particles.iter().map(|particle| particle.weight), stream),
        };
        let particle = &self.particles[chosen];
        let mut draw = Draw {
            growth: particle.growth,
            changes: self.growth_changes.filter(|_| chosen > 0),
            rates: vec![0; n],
            deviation: vec![0.0; n],
            bias_per_h: vec![0.0; n],
        };
        let dominant = pick(particle.modes.iter().map(|mode| mode.dominant_probability), stream);
        for (group, mode) in particle.modes.iter().enumerate() {
            let bank = if group == dominant { &mode.dominant } else { &mode.minor };
            let rate = pick(bank.weights.iter().copied(), stream);
            for axis in &bank.axes {
                let track = &axis.tracks[rate];
                let (z_x, z_b) = (stream.normal(), stream.normal());
                let x_sd = track.p_xx.sqrt();
                let shared = track.p_xb / x_sd;
                let b_sd = (track.p_bb - shared * shared).max(0.0).sqrt();
                draw.rates[axis.entry] = rate;
                draw.deviation[axis.entry] = track.x + x_sd * z_x;
                draw.bias_per_h[axis.entry] = track.b + shared * z_x + b_sd * z_b;
            }
        }
        draw
    }
}

/// The particles of a filter, with weights that sum to one.
pub(crate) fn weighted(particles: &[Particle]) -> Vec<ParticlePosterior> {
    let totals: Vec<Vec<Totals>> = particles.iter().map(|particle| Totals::of(&particle.modes)).collect();
    let log_dominance = |(particle, totals): (&Particle, &Vec<Totals>)| log_dominance_by(&particle.modes, totals);
    let log_dominance: Vec<Vec<f64>> = particles.iter().zip(&totals).map(log_dominance).collect();
    let log_sums: Vec<f64> = log_dominance.iter().map(|logs| log_sum(logs)).collect();
    let log_weights: Vec<f64> = particles.iter().zip(&log_sums).map(|(one, sum)| one.log_prior + sum).collect();
    let weights = normalised(&log_weights);
    let of = |index: usize| {
        let dominance = shares(&log_dominance[index], log_sums[index]);
        ParticlePosterior::of(&particles[index], weights[index], &totals[index], &dominance)
    };
    (0..particles.len()).map(of).collect()
}

impl ParticlePosterior {
    fn of(particle: &Particle, weight: f64, totals: &[Totals], dominance: &[f64]) -> Self {
        let bank = |bank: &Bank, total: f64| BankPosterior {
            weights: shares(&bank.log_weights, total),
            axes: bank.axes.clone(),
        };
        let modes = particle.modes.iter().zip(totals).zip(dominance);
        let modes = modes.map(|((mode, totals), &dominant_probability)| ModePosterior {
            dominant_probability,
            minor: bank(&mode.minor, totals.minor),
            dominant: bank(&mode.dominant, totals.dominant),
        });
        Self { weight, growth: particle.growth, latest_change: particle.latest_change, modes: modes.collect() }
    }
}

impl ModePosterior {
    /// (weight, rate, belief) of every component of the mixture of one axis.
    fn mixture(&self, axis: usize) -> impl Iterator<Item = (f64, usize, &Track)> {
        let hypotheses = [(1.0 - self.dominant_probability, &self.minor), (self.dominant_probability, &self.dominant)];
        hypotheses.into_iter().flat_map(move |(probability, bank)| {
            let tracks = bank.weights.iter().zip(&bank.axes[axis].tracks).enumerate();
            tracks.map(move |(rate, (weight, track))| (probability * weight, rate, track))
        })
    }
}

/// An index with probability as given; the last takes what rounding leaves over.
fn pick(probabilities: impl ExactSizeIterator<Item = f64>, stream: &mut Stream) -> usize {
    let last = probabilities.len() - 1;
    let mut left = stream.uniform();
    for (index, probability) in probabilities.enumerate() {
        left -= probability;
        if left < 0.0 {
            return index;
        }
    }
    last
}
