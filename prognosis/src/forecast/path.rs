//! One draw of a life on its way to the boundary.
//!
//! - What: the first time at which the path of a draw reaches the boundary.
//! - Update rule: exact steps of the linear stochastic growth (noise grows with the square root of
//!   time), aimed at where the present growth meets the boundary; steps end where the growth of the draw
//!   changes. One-sided faults are reflected at nominal: pushed by what the least point of a Brownian
//!   bridge over a small step lacks. A stretch that may hide a crossing is divided by a
//!   Brownian bridge, at best just before and just behind the crossing; when it is short enough, the
//!   margin along it is a Brownian bridge itself, about a slightly bent line, whose first passage is drawn
//!   in closed form.
//! - Requirements: a margin that is about linear in the faults over a short stretch. Four to six looks
//!   at the boundary per draw, whatever the length of the life.
//! - Source: exact discretisation of the Ornstein-Uhlenbeck process and its bridge; Skorokhod's reflection.

use domain::FaultGroup;
use numerics::Stream;

use super::passage::BrownianBridge;
use crate::{
    boundary::Boundary,
    growth_changes::ChangesToCome,
    kalman::Transition,
    posterior::{Draw, Posterior},
};

/// Farthest that a fault is expected to move in one step, so that no step leaps over the boundary to
/// where no fault vector ever was.
const STRIDE: f64 = 0.05;
/// A step is never shorter, hours, so that every path gets to its horizon, however fast its faults move.
const LEAST_STEP_FH: f64 = 1.0;
/// A one-sided fault so many standard deviations of the noise above nominal does not meet it.
const FREE_SD: f64 = 3.0;
/// Steps of one that may, hours.
const HELD_FH: f64 = 80.0;
/// A stretch whose probability of hiding a crossing is below this is not looked into.
const NEGLIGIBLE: f64 = 1e-2;
/// A stretch is divided into pieces of this share of the longest that is not, clearly shorter.
const SHORT: f64 = 0.8;
/// A group whose linearised weight on the margin is below this share of the largest cannot be the driver.
const CONTENDER: f64 = 0.5;

/// How a path ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct End {
    /// Hours from its start; `None` when it outlived the horizon.
    pub t_fh: Option<f64>,
    /// The group of the fault model that weighs most on the margin there.
    pub driver: usize,
    /// Whether the boundary was never learned there.
    pub outside_training: bool,
}

/// One draw on its way to the boundary.
pub(super) struct Path<'a> {
    posterior: &'a Posterior,
    boundary: &'a dyn Boundary,
    /// Longest stretch that is not divided any more, hours.
    step_fh: f64,
    stream: Stream,
    /// How the boundary of this draw deviates from the learned one, in standard deviations.
    tilt: f64,
    draw: Draw,
    growth: Growth,
    one_sided: Vec<bool>,
    /// Present growth rate of each entry, 1/h.
    rates_per_h: Vec<f64>,
    here: Point,
    /// Later points of the path that are known already, the nearest last.
    ahead: Vec<Point>,
}

/// A point of a path, with what the boundary says of it.
#[derive(Debug, Clone)]
struct Point {
    /// Hours from the start of the path.
    t_fh: f64,
    /// Deviation from nominal.
    x: Vec<f64>,
    /// Margin as this draw sees it.
    margin: f64,
    /// Derivative of the margin by each entry.
    gradient: Vec<f64>,
    outside_training: bool,
}

impl<'a> Path<'a> {
    pub fn new(posterior: &'a Posterior, step_fh: f64, boundary: &'a dyn Boundary, mut stream: Stream) -> Self {
        let tilt = stream.normal();
        let draw = posterior.draw(&mut stream);
        let mut one_sided = vec![false; draw.deviation.len()];
        posterior.model.one_sided().for_each(|entry| one_sided[entry] = true);
        let start = draw.deviation.clone();
        let here = Point { t_fh: 0.0, x: Vec::new(), margin: 0.0, gradient: Vec::new(), outside_training: false };
        let mut path = Self {
            growth: Growth::new(&draw, &stream),
            rates_per_h: Vec::new(),
            ahead: Vec::new(),
            posterior,
            boundary,
            step_fh,
            stream,
            tilt,
            draw,
            one_sided,
            here,
        };
        path.grow();
        path.here = path.look(0.0, start);
        path
    }

    /// Follows the path to the boundary, for `until_fh` hours at most.
    pub fn end(mut self, until_fh: f64) -> End {
        let t_fh = self.crossing_fh(until_fh);
        End { t_fh, driver: self.driver(), outside_training: self.here.outside_training }
    }

    /// First crossing of the boundary; moves to it, or to the horizon.
    fn crossing_fh(&mut self, until_fh: f64) -> Option<f64> {
        if self.here.margin <= 0.0 {
            return Some(0.0);
        }
        while self.here.t_fh < until_fh {
            let next = match self.ahead.pop() {
                Some(known) => known,
                None => self.advance(until_fh),
            };
            let bridge = self.margin_bridge(&next);
            let hidden = bridge.passage_probability();
            if hidden > NEGLIGIBLE && next.t_fh - self.here.t_fh > self.step_fh {
                let middle = self.divide(&next);
                self.ahead.extend([next, middle]);
            } else if hidden > NEGLIGIBLE && self.stream.uniform() < hidden {
                let share = bridge.passage_share(&mut self.stream);
                // Where a margin is no number, all that is known is that the crossing comes before `next`.
                let share = self.bent(share, &next).min(1.0);
                self.move_between(next, share);
                return Some(self.here.t_fh);
            } else {
                self.here = next;
                if self.growth.change_at(self.here.t_fh) {
                    self.grow();
                }
            }
        }
        None
    }

    /// The margin from here to `next`, linear in the faults.
    fn margin_bridge(&self, next: &Point) -> BrownianBridge {
        let steepness: f64 = nearer(&self.here, next).gradient.iter().map(|slope| slope * slope).sum();
        let noise = self.posterior.process_noise;
        let variance = noise * noise * steepness * (next.t_fh - self.here.t_fh);
        BrownianBridge { from: self.here.margin, to: next.margin, variance }
    }

    /// Takes over the present growth multiplier.
    fn grow(&mut self) {
        let rate = |&rate: &usize| self.growth.multiplier * self.posterior.rates_per_h[rate];
        self.rates_per_h = self.draw.rates.iter().map(rate).collect();
    }

    /// The next step into the unknown.
    fn advance(&mut self, until_fh: f64) -> Point {
        let aim_fh = f64::min(self.stride_fh(), self.expected_crossing_fh() + 0.5 * self.step_fh);
        let t_fh = f64::min(self.here.t_fh + aim_fh.max(LEAST_STEP_FH), until_fh).min(self.growth.next_change_fh());
        let dt_fh = t_fh - self.here.t_fh;
        let x = (0..self.here.x.len()).map(|entry| self.carry(entry, dt_fh)).collect();
        self.look(t_fh, x)
    }

    /// An entry `dt_fh` from here: in one step, unless it is one-sided and may meet nominal on its way.
    fn carry(&mut self, entry: usize, dt_fh: f64) -> f64 {
        let (mut x, mut left_fh) = (self.here.x[entry], dt_fh);
        while left_fh > 0.0 {
            let reach =
                if self.one_sided[entry] { x / (FREE_SD * self.posterior.process_noise) } else { f64::INFINITY };
            let free_fh = reach * reach;
            let step_fh = left_fh.min(free_fh.max(HELD_FH));
            let Transition { growth, drive, noise } = self.step(entry, step_fh);
            let free = growth * x + drive * self.draw.bias_per_h[entry] + noise.sqrt() * self.stream.normal();
            if step_fh > free_fh {
                // The least point of a Brownian bridge; what it lacks to nominal is pushed, and grows from then on.
                let spread = ((free - x) * (free - x) + 2.0 * noise * self.stream.exponential()).sqrt();
                let least = 0.5 * (x + free - spread);
                x = free - least.min(0.0) * 0.5 * (1.0 + growth);
            } else {
                x = free;
            }
            left_fh -= step_fh;
        }
        x
    }

    /// Hours until the first fault is expected to have moved by [`STRIDE`], or to have doubled beyond it.
    fn stride_fh(&self) -> f64 {
        let stride_fh = |(entry, rate): (usize, &f64)| {
            let stride = STRIDE.max(self.here.x[entry].abs());
            libm::log1p(stride * rate / self.trend(&self.here, entry).abs()) / rate
        };
        self.rates_per_h.iter().enumerate().map(stride_fh).fold(f64::INFINITY, f64::min)
    }

    /// Hours until the growth from here meets the boundary, by its first and second derivative in time.
    fn expected_crossing_fh(&self) -> f64 {
        let (slope, curvature) = self.drift(&self.here);
        let root = 2.0 * self.here.margin / ((slope * slope - 2.0 * curvature * self.here.margin).sqrt() - slope);
        if root > 0.0 { root } else { f64::INFINITY }
    }

    /// Present growth of an entry, 1/h.
    fn trend(&self, point: &Point, entry: usize) -> f64 {
        self.rates_per_h[entry] * point.x[entry] + self.draw.bias_per_h[entry]
    }

    /// First and second derivative of the margin in time, without noise and curvature of the boundary.
    fn drift(&self, point: &Point) -> (f64, f64) {
        let mut drift = (0.0, 0.0);
        for (entry, slope) in point.gradient.iter().enumerate() {
            let trend = self.trend(point, entry);
            drift.0 += slope * trend;
            drift.1 += slope * self.rates_per_h[entry] * trend;
        }
        drift
    }

    /// The step of an entry over `dt_fh`.
    fn step(&self, entry: usize, dt_fh: f64) -> Transition {
        Transition::new(self.rates_per_h[entry], self.posterior.process_noise, dt_fh)
    }

    /// A point between here and `next`, so that the crossing lies in a short stretch beside it.
    ///
    /// It is an eighth of the stretch away from here at least, and from `next` by half a short one at least, so
    /// that divisions come to an end.
    fn divide(&mut self, next: &Point) -> Point {
        let whole_fh = next.t_fh - self.here.t_fh;
        let short_fh = SHORT * self.step_fh;
        let before_fh = self.likely_crossing_fh(next).min(whole_fh) - 0.5 * short_fh;
        let dt_fh = if before_fh > 0.125 * whole_fh { before_fh } else { short_fh.max(0.25 * whole_fh) };
        let x = self.bridge(next, dt_fh);
        self.look(self.here.t_fh + dt_fh, x)
    }

    /// Hours to where the margin most likely vanishes before `next`: a parabola through the margins of
    /// both, bent as much as their drifts differ; the end of a stretch that ends healthy.
    fn likely_crossing_fh(&self, next: &Point) -> f64 {
        let whole_fh = next.t_fh - self.here.t_fh;
        if next.margin > 0.0 {
            return if next.margin < self.here.margin { whole_fh - 0.5 * SHORT * self.step_fh } else { 0.0 };
        }
        let bend = self.bend(next);
        let slope = (next.margin - self.here.margin) / whole_fh - bend * whole_fh;
        2.0 * self.here.margin / ((slope * slope - 4.0 * bend * self.here.margin).max(0.0).sqrt() - slope)
    }

    /// Half the second derivative in time of the expected margin from here to `next`.
    fn bend(&self, next: &Point) -> f64 {
        0.5 * (self.drift(next).0 - self.drift(&self.here).0) / (next.t_fh - self.here.t_fh)
    }

    /// The share of the way to `next` at which a bent margin is where a straight one is at `share`.
    ///
    /// m(u) = m0 + dm (u - k u (1 - u)), k = bend dt^2 / dm, to first order in k.
    fn bent(&self, share: f64, next: &Point) -> f64 {
        if next.margin > 0.0 {
            return share;
        }
        let whole_fh = next.t_fh - self.here.t_fh;
        let k = self.bend(next) * whole_fh * whole_fh / (next.margin - self.here.margin);
        share + k.clamp(-0.5, 0.5) * share * (1.0 - share)
    }

    /// A draw of where the path to `next` is after `dt_fh`.
    ///
    /// With m ~ N(E x + d, q) and next | m ~ N(F m + e, r): mean E x + d + (next - F (E x + d) - e) F q /
    /// (F^2 q + r), variance q r / (F^2 q + r); without noise the path is known.
    fn bridge(&mut self, next: &Point, dt_fh: f64) -> Vec<f64> {
        let rest_fh = next.t_fh - self.here.t_fh - dt_fh;
        let mut middle = Vec::with_capacity(next.x.len());
        for (entry, x) in self.here.x.iter().enumerate() {
            let (to, from) = (self.step(entry, dt_fh), self.step(entry, rest_fh));
            let bias = self.draw.bias_per_h[entry];
            let expected = to.growth * x + to.drive * bias;
            let missed = next.x[entry] - from.growth * expected - from.drive * bias;
            let total = (from.growth * from.growth * to.noise + from.noise).max(f64::MIN_POSITIVE);
            let noise = (to.noise * from.noise / total).sqrt() * self.stream.normal();
            middle.push(expected + missed * from.growth * to.noise / total + noise);
        }
        middle
    }

    /// Asks the boundary for a point of the path; one-sided faults are reflected at nominal.
    fn look(&self, t_fh: f64, mut x: Vec<f64>) -> Point {
        let mut faults = Vec::with_capacity(x.len());
        for (entry, x) in x.iter_mut().enumerate() {
            *x = if self.one_sided[entry] { x.abs() } else { *x };
            faults.push(*x + self.posterior.model.nominal[entry]);
        }
        let mut gradient = vec![0.0; x.len()];
        let seen = self.boundary.look(&faults, &mut gradient);
        Point { t_fh, x, margin: seen.value + self.tilt * seen.sigma, gradient, outside_training: seen.sigma > 0.0 }
    }

    /// Moves a share of the way towards `next`, where the boundary is crossed.
    fn move_between(&mut self, next: Point, share: f64) {
        let between = |from: f64, to: f64| from + share * (to - from);
        let x = self.here.x.iter().zip(&next.x).map(|(&from, &to)| between(from, to)).collect();
        let t_fh = between(self.here.t_fh, next.t_fh);
        let margin = between(self.here.margin, next.margin);
        let nearer = if next.margin.abs() < self.here.margin.abs() { next } else { self.here.clone() };
        self.here = Point { t_fh, x, margin, ..nearer };
    }

    /// The group whose reset to nominal raises the margin most.
    ///
    /// The gradient says which groups can be the one; only several of them are tried.
    fn driver(&self) -> usize {
        let groups = &self.posterior.model.groups;
        let weight =
            |group: &FaultGroup| -> f64 { group.entries().map(|e| -self.here.gradient[e] * self.here.x[e]).sum() };
        let weights: Vec<f64> = groups.iter().map(weight).collect();
        let largest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let contends = |&group: &usize| largest <= 0.0 || weights[group] >= CONTENDER * largest;
        let mut contenders = (0..groups.len()).filter(contends).peekable();
        let Some(first) = contenders.next() else { return 0 };
        if contenders.peek().is_none() {
            return first;
        }
        let mut best = (first, self.margin_without(&groups[first]));
        for group in contenders {
            let margin = self.margin_without(&groups[group]);
            if margin > best.1 {
                best = (group, margin);
            }
        }
        best.0
    }

    fn margin_without(&self, group: &FaultGroup) -> f64 {
        let nominal = &self.posterior.model.nominal;
        let mut faults: Vec<f64> = self.here.x.iter().zip(nominal).map(|(x, nominal)| x + nominal).collect();
        group.entries().for_each(|entry| faults[entry] = nominal[entry]);
        self.boundary.margin(&faults)
    }
}

fn nearer<'a>(a: &'a Point, b: &'a Point) -> &'a Point {
    if b.margin.abs() < a.margin.abs() { b } else { a }
}

/// The growth multiplier of one draw, from now on.
struct Growth {
    multiplier: f64,
    changes: Option<ChangesToCome>,
}

impl Growth {
    fn new(draw: &Draw, stream: &Stream) -> Self {
        Self { multiplier: draw.growth, changes: draw.changes.map(|law| ChangesToCome::new(law, stream)) }
    }

    /// The time at which it changes next, hours from now.
    fn next_change_fh(&self) -> f64 {
        self.changes.as_ref().map_or(f64::INFINITY, ChangesToCome::next_fh)
    }

    /// Makes the change that comes at `t_fh`, and says whether one does.
    fn change_at(&mut self, t_fh: f64) -> bool {
        match &mut self.changes {
            Some(changes) if t_fh >= changes.next_fh() => {
                self.multiplier *= changes.make();
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use domain::FaultModel;
    use rayon::prelude::*;

    use super::*;
    use crate::{filter::Filter, prior::FleetPrior};

    /// No life is as long.
    const UNTIL_FH: f64 = 20_000.0;

    /// Margin 1 - 8 (x1 + x2 + x3) - 60 (x4^2 + x5^2): smooth, with edges at nominal only.
    struct Smooth;

    impl Boundary for Smooth {
        fn margin(&self, k: &[f64]) -> f64 {
            let pair = (k[3] - 0.5) * (k[3] - 0.5) + (k[4] - 0.5) * (k[4] - 0.5);
            1.0 - 8.0 * (k[0] + k[1] + k[2]) - 60.0 * pair
        }
    }

    /// The first crossing of a path in steps of 2 h, what happens inside them included.
    fn crossing_in_small_steps_fh(posterior: &Posterior, stream: Stream) -> Option<f64> {
        const STEP_FH: f64 = 2.0;
        let mut path = Path::new(posterior, STEP_FH, &Smooth, stream);
        let margin = |path: &Path, x: &[f64]| {
            let k: Vec<f64> = x.iter().zip(&path.posterior.model.nominal).map(|(x, nominal)| x + nominal).collect();
            Smooth.margin(&k)
        };
        let steps: Vec<Transition> = (0..path.here.x.len()).map(|entry| path.step(entry, STEP_FH)).collect();
        let (mut x, mut before, mut t_fh) = (path.here.x.clone(), path.here.margin, 0.0);
        while t_fh < UNTIL_FH {
            for (entry, x) in x.iter_mut().enumerate() {
                let Transition { growth, drive, noise } = steps[entry];
                *x = growth * *x + drive * path.draw.bias_per_h[entry] + noise.sqrt() * path.stream.normal();
                *x = if path.one_sided[entry] { x.abs() } else { *x };
            }
            let now = margin(&path, &x);
            let steepness = 3.0 * 64.0 + 120.0 * 120.0 * (x[3] * x[3] + x[4] * x[4]);
            let noise = path.posterior.process_noise;
            let bridge = BrownianBridge { from: before, to: now, variance: noise * noise * STEP_FH * steepness };
            if path.stream.uniform() < bridge.passage_probability() {
                return Some(t_fh + 0.5 * STEP_FH);
            }
            (before, t_fh) = (now, t_fh + STEP_FH);
        }
        None
    }

    /// New lives from the prior: the mean end is within 3 h, quantiles within 1 %.
    #[test]
    fn slow_ends_are_those_of_small_steps() {
        let posterior = Filter::new(&FaultModel::electrical(), &FleetPrior::vague()).posterior();
        let root = Stream::new(1, &["small steps"]);
        let ends = |end: &(dyn Fn(Stream) -> Option<f64> + Sync)| -> Vec<f64> {
            let end = |index: u64| end(root.substream(index)).expect("every life ends");
            let mut ends: Vec<f64> = (0..30_000).into_par_iter().map(end).collect();
            ends.sort_by(f64::total_cmp);
            ends
        };
        let small = ends(&|stream| crossing_in_small_steps_fh(&posterior, stream));
        let large = ends(&|stream| Path::new(&posterior, 80.0, &Smooth, stream).end(UNTIL_FH).t_fh);
        let mean = |ends: &[f64]| ends.iter().sum::<f64>() / ends.len() as f64;
        println!("{} and {}", mean(&small), mean(&large));
        assert!((mean(&large) - mean(&small)).abs() < 3.0, "{} and {}", mean(&large), mean(&small));
        for level in [0.05, 0.1, 0.5, 0.9, 0.95] {
            let [small, large] = [&small, &large].map(|ends| ends[(level * ends.len() as f64) as usize]);
            assert!((large / small - 1.0).abs() < 0.01, "{large} and {small} at {level}");
        }
    }
}
