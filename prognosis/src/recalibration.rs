//! What makes the probabilities of forecasts hold, learned on past lives.
//!
//! - What: a monotone map of the level at which a forecast puts something to the share of cases in which it was so.
//!   Levels and shares are kept as probits, and the map is linear between its knots.
//! - Update rule: from the levels at which forecasts of past lives put their ends, every life weighing one. Under ten lives
//!   nothing is learned; from ten on a shift and a scale, drawn to none by n / (n + 20); from forty on the distribution of the
//!   levels itself, with twenty lives' worth of levels that need no map. Neither narrows a forecast: lives to come differ
//!   from past ones in more than these differ from one another.
//! - Requirements: levels of forecasts that the life had no part in. A removed life ends anywhere above its level.
//! - Source: Kuleshov, Fenner and Ermon 2018; isotonic regression on a single sample is its distribution function.

use numerics::normal;
use serde::{Deserialize, Serialize};

/// Fewest lives that teach a shift and a scale, and that teach a curve.
const FEWEST: usize = 10;
const FEWEST_OF_CURVE: usize = 40;
/// Lives that say that forecasts hold.
const TRUSTING_LIVES: f64 = 20.0;
/// Knots of the curve, by the probits of the levels that hold.
const KNOTS: [f64; 9] = [-2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0];
/// Steps of the bisection for a knot.
const BISECTIONS: usize = 50;
/// Probits beyond count as this one.
const OUTERMOST: f64 = 8.0;
/// Probability between the outermost draw and the one that the tail is laid through.
const TAIL: f64 = 0.05;

/// The probit of the level at which a forecast put what came true, and how much it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    pub probit: f64,
    pub weight: f64,
}

/// A map of levels of a forecast to levels that hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recalibration {
    /// Knots in ascending order: probit of a level of the forecast, and probit of the level that holds.
    knots: Vec<(f64, f64)>,
}

impl Recalibration {
    /// Whether it is a monotone map.
    pub(crate) fn is_sound(&self) -> bool {
        let ascends = |pair: &[(f64, f64)]| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1;
        let is_finite = |knot: &(f64, f64)| knot.0.is_finite() && knot.1.is_finite();
        self.knots.len() > 1 && self.knots.iter().all(is_finite) && self.knots.windows(2).all(ascends)
    }

    /// What the levels of the forecasts of some lives teach, so many of which failed; `None` of too few failures.
    pub(crate) fn learn(lives: &[Vec<Level>], failed: usize) -> Option<Self> {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for levels in lives {
            let total: f64 = levels.iter().map(|level| level.weight).sum();
            let weight = |level: &Level| level.weight / total / lives.len() as f64;
            points.extend(levels.iter().map(|level| (level.probit.clamp(-OUTERMOST, OUTERMOST), weight(level))));
        }
        let share = failed as f64 / (failed as f64 + TRUSTING_LIVES);
        match failed {
            ..FEWEST => None,
            FEWEST..FEWEST_OF_CURVE => Some(Self { knots: shift_and_scale(&points, share) }),
            _ => Some(Self { knots: curve(&points, share) }),
        }
    }

    /// The probit of the level that holds, for that of a level of the forecast.
    pub(crate) fn probit(&self, forecast: f64) -> f64 {
        interpolated(&self.knots, forecast)
    }

    /// As many draws whose levels hold, each at the place of the draw of its rank; `None` is beyond the horizon, and stays
    /// unknown.
    pub fn apply(&self, ends_fh: &[Option<f64>], horizon_fh: f64) -> Vec<Option<f64>> {
        let mut order: Vec<usize> = (0..ends_fh.len()).collect();
        order.sort_by(|a, b| ends_fh[*a].unwrap_or(f64::INFINITY).total_cmp(&ends_fh[*b].unwrap_or(f64::INFINITY)));
        let ascending: Vec<Option<f64>> = order.iter().map(|draw| ends_fh[*draw]).collect();
        let inverse: Vec<(f64, f64)> = self.knots.iter().map(|knot| (knot.1, knot.0)).collect();
        let sample = Sample { ends_fh: &ascending };
        let mut held_fh = vec![None; ends_fh.len()];
        for (rank, draw) in order.into_iter().enumerate() {
            let raw = interpolated(&inverse, sample.probit(rank));
            held_fh[draw] = sample.at(raw).filter(|end_fh| *end_fh < horizon_fh);
        }
        held_fh
    }
}

/// Two knots of a straight line.
fn shift_and_scale(points: &[(f64, f64)], share: f64) -> Vec<(f64, f64)> {
    let mean: f64 = points.iter().map(|(probit, weight)| probit * weight).sum();
    let variance: f64 = points.iter().map(|(probit, weight)| weight * (probit - mean) * (probit - mean)).sum();
    let (shift, scale) = (share * mean, (1.0 + share * (libm::sqrt(variance) - 1.0)).max(1.0));
    [-1.0, 1.0].map(|holds| (shift + scale * holds, holds)).to_vec()
}

/// The inverse of the distribution function of the levels at each of the knots, never nearer to its middle than where levels hold.
fn curve(points: &[(f64, f64)], share: f64) -> Vec<(f64, f64)> {
    let distribution = |raw: f64| {
        let at_most: f64 = points.iter().filter(|(probit, _)| *probit <= raw).map(|(_, weight)| weight).sum();
        share * at_most + (1.0 - share) * normal::cumulative(raw)
    };
    let raw = |holds: f64| {
        let (mut low, mut high) = (-OUTERMOST, OUTERMOST);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if distribution(middle) < normal::cumulative(holds) {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    };
    let middle = raw(0.0);
    let wide = |holds: f64| match holds < 0.0 {
        true => raw(holds).min(middle + holds),
        false => raw(holds).max(middle + holds),
    };
    KNOTS.map(|holds| (wide(holds), holds)).to_vec()
}

/// Between knots in ascending order, and beyond them at the mean slope of all.
fn interpolated(knots: &[(f64, f64)], x: f64) -> f64 {
    let (first, last) = (knots[0], knots[knots.len() - 1]);
    let slope = (last.1 - first.1) / (last.0 - first.0);
    if x <= first.0 {
        return first.1 + slope * (x - first.0);
    }
    if x >= last.0 {
        return last.1 + slope * (x - last.0);
    }
    let above = knots.partition_point(|knot| knot.0 <= x);
    let (low, high) = (knots[above - 1], knots[above]);
    low.1 + (x - low.0) * (high.1 - low.1) / (high.0 - low.0)
}

/// Draws in ascending order.
struct Sample<'a> {
    ends_fh: &'a [Option<f64>],
}

impl Sample<'_> {
    fn probit(&self, index: usize) -> f64 {
        normal::quantile((index as f64 + 0.5) / self.ends_fh.len() as f64)
    }

    /// The quantile at a probit; beyond the outermost draws their logarithms go on straight.
    fn at(&self, probit: f64) -> Option<f64> {
        let last = self.ends_fh.len() - 1;
        let place = normal::cumulative(probit) * self.ends_fh.len() as f64 - 0.5;
        if place < 0.0 {
            return self.beyond(0, last / 20, probit);
        }
        if place > last as f64 {
            return self.beyond(last, last - last / 20, probit);
        }
        let below = place as usize;
        let low_fh = self.ends_fh[below]?;
        if place == below as f64 {
            return Some(low_fh);
        }
        Some(low_fh + (place - below as f64) * (self.ends_fh[below + 1]? - low_fh))
    }

    fn beyond(&self, outermost: usize, inner: usize, probit: f64) -> Option<f64> {
        let (end_fh, inner_fh) = (self.ends_fh[outermost]?, self.ends_fh[inner]?);
        let tail = Tail::through((self.probit(inner), inner_fh), (self.probit(outermost), end_fh));
        Some(tail.map_or(end_fh, |tail| tail.end_fh(probit)))
    }
}

/// The logarithm of what is beyond the outermost draw, straight in the probit.
struct Tail {
    probit: f64,
    end_fh: f64,
    slope: f64,
}

impl Tail {
    /// Through two points of probit and end, the outermost last; `None` where they tell no slope.
    fn through(inner: (f64, f64), outermost: (f64, f64)) -> Option<Self> {
        let known = inner.1 > 0.0 && outermost.1 > 0.0 && inner.1 != outermost.1 && outermost.1.is_finite();
        let slope = libm::log(outermost.1 / inner.1) / (outermost.0 - inner.0);
        (known && slope > 0.0).then_some(Self { probit: outermost.0, end_fh: outermost.1, slope })
    }

    fn end_fh(&self, probit: f64) -> f64 {
        self.end_fh * libm::exp(self.slope * (probit - self.probit))
    }

    fn probit(&self, end_fh: f64) -> f64 {
        self.probit + libm::log(end_fh.max(f64::MIN_POSITIVE) / self.end_fh) / self.slope
    }
}

/// The probit of the level at which a sample of ends and weights puts what came true. The weights sum to one, infinite ends
/// are somewhere beyond all others.
pub(crate) fn probit_in(mut sample: Vec<(f64, f64)>, truth_fh: f64) -> f64 {
    sample.retain(|(_, weight)| *weight > 0.0);
    sample.sort_by(|a, b| a.0.total_cmp(&b.0));
    let below =
        |inside: &dyn Fn(f64) -> bool| -> f64 { sample.iter().filter(|end| inside(end.0)).map(|end| end.1).sum() };
    let level = 0.5 * (below(&|end_fh| end_fh < truth_fh) + below(&|end_fh| end_fh <= truth_fh));
    let (first, last) = (sample[0], sample[sample.len() - 1]);
    let outside = truth_fh < first.0 || truth_fh > last.0;
    let outermost = if truth_fh < first.0 { first } else { last };
    let level = level.clamp(0.5 * first.1, 1.0 - 0.5 * last.1);
    let tail = outside.then(|| tail(&sample, outermost)).flatten();
    tail.map_or_else(|| normal::quantile(level), |tail| tail.probit(truth_fh)).clamp(-OUTERMOST, OUTERMOST)
}

/// The tail of an ascending sample at its first or last draw.
fn tail(sample: &[(f64, f64)], outermost: (f64, f64)) -> Option<Tail> {
    let mut before = 0.0;
    let mut points = sample.iter().map(|(end_fh, weight)| {
        before += weight;
        (before - 0.5 * weight, *end_fh)
    });
    let probit = |level: f64| normal::quantile(level.clamp(1e-12, 1.0 - 1e-12));
    let lower = outermost == sample[0];
    let inner =
        if lower { points.find(|point| point.0 >= TAIL)? } else { points.find(|point| point.0 >= 1.0 - TAIL)? };
    let level = if lower { 0.5 * outermost.1 } else { 1.0 - 0.5 * outermost.1 };
    Tail::through((probit(inner.0), inner.1), (probit(level), outermost.0))
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    /// Of `lives` lives whose ends are spread `times` as much as forecasts say.
    fn learn(lives: usize, times: f64, shift: f64) -> Option<Recalibration> {
        let mut random = Stream::new(5, &["recalibration"]);
        let mut level = || Level { probit: shift + times * random.normal(), weight: 1.0 };
        let levels: Vec<Vec<Level>> = (0..lives).map(|_| (0..5).map(|_| level()).collect()).collect();
        Recalibration::learn(&levels, lives)
    }

    fn sample(count: usize) -> Vec<Option<f64>> {
        (0..count).map(|i| Some(libm::exp(6.0 + 0.3 * normal::quantile((i as f64 + 0.5) / count as f64)))).collect()
    }

    #[test]
    fn what_no_draw_reached_is_as_far_out_as_the_draws_lead_one_to_expect() {
        let draws: Vec<(f64, f64)> = sample(500).into_iter().flatten().map(|end_fh| (end_fh, 1.0 / 500.0)).collect();
        for probit in [-5.0, -1.0, 0.0, 2.0, 4.5] {
            let found = probit_in(draws.clone(), libm::exp(6.0 + 0.3 * probit));
            assert!((found - probit).abs() < 0.02, "{found} {probit}");
        }
        assert_eq!(probit_in(vec![(f64::INFINITY, 0.5), (1.0, 0.5)], 1e6), 0.0);
    }

    #[test]
    fn few_lives_teach_nothing_and_a_narrow_forecast_is_widened() {
        assert_eq!(learn(9, 2.0, 0.0), None);
        for lives in [39, 400] {
            let recalibration = learn(lives, 2.0, 0.0).expect("enough lives");
            let (before, after) = (sample(1000), recalibration.apply(&sample(1000), f64::INFINITY));
            let spread = |ends_fh: &[Option<f64>]| libm::log(ends_fh[900].unwrap() / ends_fh[100].unwrap());
            assert!(spread(&after) > 1.5 * spread(&before), "{lives}");
            assert!(after.is_sorted() && after.len() == 1000 && after[0] < before[0]);
        }
    }

    #[test]
    fn a_wide_forecast_is_not_narrowed() {
        let of = |lives| learn(lives, 0.5, 0.0).expect("enough lives").apply(&sample(100), 1e9);
        for lives in [30, 300] {
            let spread = |ends_fh: &[Option<f64>]| ends_fh[90].unwrap() / ends_fh[10].unwrap();
            assert!((spread(&of(lives)) / spread(&sample(100)) - 1.0).abs() < 0.05, "{lives}");
        }
    }

    #[test]
    fn what_is_beyond_the_horizon_stays_unknown() {
        let recalibration = learn(30, 1.0, 1.0).expect("enough lives");
        let mut ends_fh = sample(100);
        ends_fh[60..].fill(None);
        ends_fh.reverse();
        let mut after = recalibration.apply(&ends_fh, 1e9);
        after.reverse();
        let known = after.iter().flatten().count();
        assert!((30..60).contains(&known), "ends come later than forecast: {known}");
        assert!(after[..known].iter().all(Option::is_some) && after[..known].is_sorted());
    }
}
