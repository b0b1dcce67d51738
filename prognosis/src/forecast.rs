//! Remaining useful life by Monte Carlo.
//!
//! **What**: draws of the end of life: first time at which a draw's fault vector is on the faulty
//! side of the boundary.
//! **Update rule**: a draw from the posterior is carried forward in coarse exact steps of the linear
//! stochastic growth (noise grows with the square root of time), one-sided faults reflected at
//! nominal; steps end where the growth of the draw changes. The step that ends faulty is halved by Brownian bridges, so that the path is refined
//! only around its crossing, and the margin is interpolated linearly inside the last step.
//! **Requirements**: a margin that is continuous along paths. About log2(coarse) + life/coarse
//! evaluations of the boundary per draw, and one per group for the attribution.
//! **Source**: exact discretisation of the Ornstein-Uhlenbeck process and its bridge.
//!
//! Draw i depends on the stream's i-th substream only: neither on other draws nor on threads.

use domain::{FaultGroup, Stream};

use crate::{
    boundary::Boundary,
    growth_changes::GrowthChanges,
    kalman::Transition,
    posterior::{Draw, Posterior},
    prior::FailureTimeError,
};

/// A coarse step is 2^5 fine ones.
const HALVINGS: usize = 5;

/// How to forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForecastSettings {
    /// Number of draws.
    pub draws: usize,
    /// Ends beyond are censored, flight hours from now.
    pub horizon_fh: f64,
    /// Resolution of the paths around their crossing, flight hours.
    pub step_fh: f64,
}

impl Default for ForecastSettings {
    fn default() -> Self {
        Self { draws: 1000, horizon_fh: 10_000.0, step_fh: 20.0 }
    }
}

/// Draws of the end of life.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Flight hours from now, zero where already faulty; `None` beyond the horizon.
    pub ends_fh: Vec<Option<f64>>,
    /// Per draw, the group of the fault model that weighs most on the margin at the end: whose reset
    /// to nominal raises it most.
    pub drivers: Vec<usize>,
    /// Share of the draws that are faulty now.
    pub failed_fraction: f64,
}

impl Forecast {
    /// The group that most often drives the end of life; the first of equals.
    pub fn dominant_group(&self) -> usize {
        let count = |group| self.drivers.iter().filter(|&&driver| driver == group).count();
        let groups = self.drivers.iter().max().map_or(0, |last| last + 1);
        (0..groups).rev().max_by_key(|&group| count(group)).unwrap_or(0)
    }
}

/// Draws the end of life from what is known at the centre of the last block, `lag_fh` before now.
///
/// `error` is the boundary's own error in failure time, added to each crossing.
pub fn forecast(
    posterior: &Posterior,
    lag_fh: f64,
    boundary: &dyn Boundary,
    error: Option<FailureTimeError>,
    settings: &ForecastSettings,
    stream: &Stream,
) -> Forecast {
    let (mut ends_fh, mut drivers) = (Vec::with_capacity(settings.draws), Vec::with_capacity(settings.draws));
    for index in 0..settings.draws {
        let mut stream = stream.substream(index as u64);
        let delay_fh = error.map_or(0.0, |error| error.offset_fh + error.sd_fh * stream.normal()) - lag_fh;
        let mut path = Path::new(posterior, settings.step_fh, boundary, stream);
        let crossing = path.cross(settings.horizon_fh - delay_fh);
        ends_fh.push(crossing.map(|t_fh| (t_fh + delay_fh).max(0.0)).filter(|&end| end < settings.horizon_fh));
        drivers.push(path.driver());
    }
    let failed = ends_fh.iter().filter(|end| **end == Some(0.0)).count();
    Forecast { failed_fraction: failed as f64 / settings.draws.max(1) as f64, ends_fh, drivers }
}

/// The growth multiplier of one draw, from now on.
struct Growth {
    multiplier: f64,
    /// The law, its random numbers, and when the next change comes, hours from now.
    changes: Option<(GrowthChanges, Stream, f64)>,
}

impl Growth {
    fn new(draw: &Draw, stream: &Stream) -> Self {
        let changes = draw.changes.map(|law| {
            let mut stream = stream.substream(0);
            let first_fh = law.wait_fh(&mut stream);
            (law, stream, first_fh)
        });
        Self { multiplier: draw.growth, changes }
    }

    /// Hours without a change from `t_fh` on, at most `longest_fh`.
    fn constant_fh(&self, t_fh: f64, longest_fh: f64) -> f64 {
        self.changes.as_ref().map_or(longest_fh, |(_, _, next_fh)| f64::min(longest_fh, next_fh - t_fh))
    }

    /// Makes the change that comes at `t_fh`, if one does.
    fn change_at(&mut self, t_fh: f64) {
        if let Some((law, stream, next_fh)) = &mut self.changes
            && t_fh >= *next_fh
        {
            self.multiplier *= law.factor(stream);
            *next_fh = t_fh + law.wait_fh(stream);
        }
    }
}

/// One draw on its way to the boundary.
struct Path<'a> {
    posterior: &'a Posterior,
    boundary: &'a dyn Boundary,
    /// Resolution around the crossing, hours.
    step_fh: f64,
    stream: Stream,
    draw: Draw,
    growth: Growth,
    one_sided: Vec<bool>,
    /// Where the path is: deviation from nominal.
    x: Vec<f64>,
    /// Room for the fault vector of an evaluation.
    faults: Vec<f64>,
}

impl<'a> Path<'a> {
    fn new(posterior: &'a Posterior, step_fh: f64, boundary: &'a dyn Boundary, mut stream: Stream) -> Self {
        let draw = posterior.draw(&mut stream);
        let mut one_sided = vec![false; draw.deviation.len()];
        for group in &posterior.model.groups {
            if let FaultGroup::OneSided { index } = *group {
                one_sided[index] = true;
            }
        }
        let mut path = Self {
            x: draw.deviation.clone(),
            faults: draw.deviation.clone(),
            growth: Growth::new(&draw, &stream),
            posterior,
            boundary,
            step_fh,
            stream,
            draw,
            one_sided,
        };
        for entry in 0..path.x.len() {
            path.x[entry] = path.reflected(entry, path.x[entry]);
        }
        path
    }

    /// First crossing of the boundary in hours from the start of the path, unless it is after `until_fh`.
    fn cross(&mut self, until_fh: f64) -> Option<f64> {
        let coarse_fh = self.step_fh * (1u64 << HALVINGS) as f64;
        let mut margin = self.margin(&self.x.clone());
        if margin <= 0.0 {
            return Some(0.0);
        }
        let mut t_fh = 0.0;
        while t_fh < until_fh {
            let dt_fh = self.growth.constant_fh(t_fh, coarse_fh);
            let next = self.advance(dt_fh);
            let next_margin = self.margin(&next);
            if next_margin <= 0.0 {
                return Some(t_fh + self.refine(next, dt_fh, margin, next_margin));
            }
            (self.x, margin) = (next, next_margin);
            t_fh += dt_fh;
            self.growth.change_at(t_fh);
        }
        None
    }

    /// The step of an entry over `dt_fh`.
    fn step(&self, entry: usize, dt_fh: f64) -> Transition {
        let rate_per_h = self.growth.multiplier * self.posterior.rates_per_h[self.draw.rates[entry]];
        Transition::new(rate_per_h, self.posterior.process_noise, dt_fh)
    }

    /// One coarse step.
    fn advance(&mut self, dt_fh: f64) -> Vec<f64> {
        let mut next = self.x.clone();
        for (entry, x) in next.iter_mut().enumerate() {
            let step = self.step(entry, dt_fh);
            let moved =
                step.growth * *x + step.drive * self.draw.bias_per_h[entry] + step.noise.sqrt() * self.stream.normal();
            *x = self.reflected(entry, moved);
        }
        next
    }

    /// Crossing inside the coarse step of `dt_fh` from here to `end`, hours from here; moves to just behind it.
    fn refine(&mut self, mut end: Vec<f64>, mut dt_fh: f64, mut margin: f64, mut end_margin: f64) -> f64 {
        let mut before_fh = 0.0;
        while dt_fh > self.step_fh {
            dt_fh *= 0.5;
            let middle = self.bridge(&end, dt_fh);
            let middle_margin = self.margin(&middle);
            if middle_margin <= 0.0 {
                (end, end_margin) = (middle, middle_margin);
            } else {
                (self.x, margin) = (middle, middle_margin);
                before_fh += dt_fh;
            }
        }
        self.x = end;
        before_fh + dt_fh * margin / (margin - end_margin)
    }

    /// A point half way between here and `end`, which is two steps of `dt_fh` away.
    ///
    /// With x_m ~ N(E x + d, q) and end | x_m ~ N(E x_m + d, q): mean E x + d + (end - E (E x + d) - d)
    /// E / (E^2 + 1), variance q / (E^2 + 1).
    fn bridge(&mut self, end: &[f64], dt_fh: f64) -> Vec<f64> {
        let mut middle = self.x.clone();
        for (entry, x) in middle.iter_mut().enumerate() {
            let Transition { growth, drive, noise } = self.step(entry, dt_fh);
            let drift = drive * self.draw.bias_per_h[entry];
            let expected = growth * *x + drift;
            let pull = growth / (growth * growth + 1.0);
            let mean = expected + pull * (end[entry] - growth * expected - drift);
            let noise = (noise / (growth * growth + 1.0)).sqrt() * self.stream.normal();
            *x = self.reflected(entry, mean + noise);
        }
        middle
    }

    /// The group whose reset to nominal raises the margin most.
    fn driver(&mut self) -> usize {
        let mut best = (0, f64::NEG_INFINITY);
        for (index, group) in self.posterior.model.groups.iter().enumerate() {
            let mut without = self.x.clone();
            match *group {
                FaultGroup::OneSided { index } => without[index] = 0.0,
                FaultGroup::Pair { indices } => indices.iter().for_each(|&index| without[index] = 0.0),
            }
            let margin = self.margin(&without);
            if margin > best.1 {
                best = (index, margin);
            }
        }
        best.0
    }

    fn margin(&mut self, x: &[f64]) -> f64 {
        for ((k, x), nominal) in self.faults.iter_mut().zip(x).zip(&self.posterior.model.nominal) {
            *k = x + nominal;
        }
        self.boundary.margin(&self.faults)
    }

    fn reflected(&self, entry: usize, x: f64) -> f64 {
        if self.one_sided[entry] { x.abs() } else { x }
    }
}
