//! Linear growth, carried to the boundary.
//!
//! - What: draws of the end of life of x' = A x + b + noise, each draw with a [`Growth`] of its own.
//! - Update rule: steps of second order in A dt, noise with the square root of time, one-sided
//!   faults reflected at nominal. The boundary is asked at every eighth step; a faulty answer starts a
//!   bisection over the steps between, and the margin is interpolated linearly inside the step found.
//! - Requirements: a path that is healthy at two such looks counts as healthy between them.

use domain::{FaultModel, Propagation};
use numerics::Stream;
use prognosis::{Boundary, FailureTimeError, FleetPrior, Moments, PredictionSettings};

/// Length of a step, flight hours.
pub(super) const STEP_FH: f64 = 25.0;
/// Steps between looks at the boundary.
const STRIDE: usize = 8;
/// A path is far from the boundary when its margin would last for so many strides.
const FAR: f64 = 4.0;
/// Columns of B: u = [1, load, temperature].
const INPUTS: usize = 3;

/// How one draw grows, noise apart.
pub(super) trait Growth {
    /// The deviation one step of [`STEP_FH`] after `x`; steps are asked for one after the other.
    fn step(&mut self, x: &[f64]) -> Vec<f64>;
}

/// One draw of where a life stands and how it grows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Start<G> {
    /// Deviation from nominal.
    pub deviation: Vec<f64>,
    /// Growth from there on.
    pub growth: G,
}

/// Every entry of the fault vector grows by itself: x' = lambda x + b.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Separate {
    /// lambda, 1/h.
    pub rate_per_h: Vec<f64>,
    /// b, 1/h.
    pub bias_per_h: Vec<f64>,
}

impl Growth for Separate {
    fn step(&mut self, x: &[f64]) -> Vec<f64> {
        let next = |entry: usize| {
            let z = self.rate_per_h[entry] * STEP_FH;
            x[entry] * (1.0 + z * (1.0 + 0.5 * z)) + self.bias_per_h[entry] * STEP_FH * (1.0 + 0.5 * z)
        };
        (0..x.len()).map(next).collect()
    }
}

/// What paths have in common.
pub(super) struct Extrapolation<'a> {
    boundary: &'a dyn Boundary,
    nominal: &'a [f64],
    one_sided: Vec<bool>,
    process_noise: f64,
    error: Option<FailureTimeError>,
}

impl<'a> Extrapolation<'a> {
    pub fn new(model: &'a FaultModel, prior: &FleetPrior, boundary: &'a dyn Boundary) -> Self {
        let mut one_sided = vec![false; model.len()];
        model.one_sided().for_each(|entry| one_sided[entry] = true);
        let FleetPrior { process_noise, failure_time_error: error, .. } = *prior;
        Self { boundary, nominal: &model.nominal, one_sided, process_noise, error }
    }

    /// Draws of the remaining life at a time `lag_fh` after that of the starts.
    pub fn ends_fh<G: Growth>(
        &self,
        start: impl Fn(&mut Stream) -> Start<G>,
        lag_fh: f64,
        settings: &PredictionSettings,
        stream: &Stream,
    ) -> Vec<Option<f64>> {
        let end = |draw: usize| {
            let mut stream = stream.substream(draw as u64);
            let delay_fh = self.error.map_or(0.0, |error| error.offset_fh + error.sd_fh * stream.normal()) - lag_fh;
            let crossing_fh = self.crossing_fh(start(&mut stream), settings.horizon_fh - delay_fh, &mut stream)?;
            Some((crossing_fh + delay_fh).max(0.0)).filter(|end_fh| *end_fh < settings.horizon_fh)
        };
        (0..settings.draws).map(end).collect()
    }

    /// First crossing of the boundary, hours from the start, unless it is after `until_fh`.
    fn crossing_fh<G: Growth>(&self, start: Start<G>, until_fh: f64, stream: &mut Stream) -> Option<f64> {
        let Start { mut deviation, mut growth } = start;
        self.reflect(&mut deviation);
        let mut healthy = self.margin(&deviation);
        if healthy <= 0.0 {
            return Some(0.0);
        }
        let (mut t_fh, mut stride) = (0.0, 1);
        while t_fh < until_fh {
            let mut states = vec![deviation];
            for step in 0..stride {
                states.push(self.step(&mut growth, &states[step], stream));
            }
            let next = self.margin(&states[stride]);
            if next <= 0.0 {
                return Some(t_fh + self.refine(&states, healthy, next));
            }
            deviation = states.swap_remove(stride);
            t_fh += stride as f64 * STEP_FH;
            stride = if (next - healthy).abs() * STRIDE as f64 * FAR < next * stride as f64 { STRIDE } else { 1 };
            healthy = next;
        }
        None
    }

    fn step(&self, growth: &mut impl Growth, x: &[f64], stream: &mut Stream) -> Vec<f64> {
        let noise = self.process_noise * STEP_FH.sqrt();
        let mut next = growth.step(x);
        next.iter_mut().for_each(|x| *x += noise * stream.normal());
        self.reflect(&mut next);
        next
    }

    fn reflect(&self, x: &mut [f64]) {
        x.iter_mut().zip(&self.one_sided).filter(|(_, one_sided)| **one_sided).for_each(|(x, _)| *x = x.abs());
    }

    /// The time at which the margin is used up between a healthy first state and a faulty last one.
    fn refine(&self, states: &[Vec<f64>], mut healthy: f64, mut faulty: f64) -> f64 {
        let (mut low, mut high) = (0, states.len() - 1);
        while high - low > 1 {
            let middle = (low + high) / 2;
            match self.margin(&states[middle]) {
                margin if margin <= 0.0 => (high, faulty) = (middle, margin),
                margin => (low, healthy) = (middle, margin),
            }
        }
        STEP_FH * (low as f64 + healthy / (healthy - faulty))
    }

    /// The margin of a deviation, faults kept within [0, 1].
    fn margin(&self, x: &[f64]) -> f64 {
        let k: Vec<f64> = x.iter().zip(self.nominal).map(|(x, nominal)| (nominal + x).clamp(0.0, 1.0)).collect();
        self.boundary.margin(&k)
    }
}

/// What is known of lambda and b, as A and B (Berri 2021, eq. 2.26): A is diagonal, and the first column
/// of B absorbs load and temperature.
pub(super) fn propagation(growth: &[[Moments; 2]], estimator: &str, observations: usize) -> Propagation {
    let n = growth.len();
    let state = |value: fn(&Moments) -> f64| {
        let row = |i: usize| (0..n).map(|j| if i == j { value(&growth[i][0]) } else { 0.0 }).collect();
        (0..n).map(row).collect()
    };
    let control = |value: fn(&Moments) -> f64| {
        let row = |growth: &[Moments; 2]| (0..INPUTS).map(|j| if j == 0 { value(&growth[1]) } else { 0.0 }).collect();
        growth.iter().map(row).collect()
    };
    Propagation {
        state_matrix: state(|moments| moments.mean),
        state_matrix_sigma: state(|moments| moments.sigma),
        control_matrix: control(|moments| moments.mean),
        control_matrix_sigma: control(|moments| moments.sigma),
        estimator: estimator.to_owned(),
        observations,
    }
}
