//! Mixed-effects degradation models: every life follows a curve of one family, with coefficients of its own.
//!
//! - What: y(x) = c0 + c1 t (+ c2 t^2) + e of the damage x at age t. The polynomial model takes y = x and a parabola,
//!   the exponential one y = ln(x + offset) and a line, so that x + offset grows by e^(c1 t).
//! - Update rule: the coefficients of a life are normal over the fleet ([`Population`], learned by expectation and
//!   maximisation), and of a life under way they are their posterior. The offset is the one of those tried that makes
//!   the earlier lives likeliest. A draw is a curve below the limit now; the remaining life is its first passage of the
//!   limit. Each fault goes by itself, and the first passage of any ends a life.
//! - Requirements: deviations in reference units with limits at [`REFERENCE_LIMIT`]. Errors e count as independent,
//!   which rows close to one another seldom are: then these models are surer than they should be.
//! - Source: Lu and Meeker 1993 for the polynomial model, Gebraeel, Lawley, Li and Ryan 2005 for the exponential one
//!   with a posterior per unit and a passage that is known to lie ahead.

mod brownian;
mod population;

use numerics::Stream;
use prognosis::{
    EndedLife, Estimator, Follower, Observation, PredictionSettings, REFERENCE_LIFE_FH, REFERENCE_LIMIT, RulEstimate,
};

use self::population::{Coefficients, Population, Sums};

pub use self::brownian::MixedBrownian;

/// Offsets that are tried: powers of two of the way to the limit, from a sixty-fourth to sixteen.
const OFFSETS: std::ops::RangeInclusive<i32> = -6..=4;
const FARTHEST: f64 = 16.0;
/// Damage this near to minus the offset, as a share of it, counts as this far from it.
const LEAST: f64 = 0.1;
/// Curves tried for one that is below the limit now; none means that it is passed.
const TRIES: usize = 100;

/// A mixed-effects model with so many coefficients a life as an [`Estimator`].
pub struct MixedEffects<const K: usize> {
    name: &'static str,
    faults: Vec<Fault<K>>,
}

impl MixedEffects<2> {
    /// The exponential model that earlier lives teach; `None` where they have no observation.
    pub fn exponential(lives: &[EndedLife]) -> Option<Self> {
        Self::learn("mixed-exponential", lives, exponential_responses)
    }
}

impl MixedEffects<3> {
    /// The quadratic model that earlier lives teach; `None` where they have no observation.
    pub fn polynomial(lives: &[EndedLife]) -> Option<Self> {
        Self::learn("mixed-polynomial", lives, |_, _| vec![Response::Plain])
    }
}

impl<const K: usize> MixedEffects<K> {
    fn learn(name: &'static str, lives: &[EndedLife], tried: fn(&[Seen], usize) -> Vec<Response>) -> Option<Self> {
        let lives = seen(lives);
        let faults = lives.first()?[0].sigma.len();
        Some(Self {
            name,
            faults: (0..faults).map(|fault| Fault::learn(&lives, fault, &tried(&lives, fault))).collect(),
        })
    }
}

/// What was observed of a life, something at least.
type Seen<'a> = &'a [Observation];

fn seen(lives: &[EndedLife]) -> Vec<Seen<'_>> {
    lives.iter().map(|life| life.observations.as_slice()).filter(|seen| !seen.is_empty()).collect()
}

/// The exponential responses that damage as it was seen lies well within; the farthest where none is.
fn exponential_responses(lives: &[Seen], fault: usize) -> Vec<Response> {
    let lowest = lives.iter().flat_map(|life| life.iter()).map(|seen| severity(seen, fault)).fold(0.0, f64::min);
    let offsets = OFFSETS.map(|power| libm::exp2(f64::from(power)));
    let reaching = offsets.filter(|offset| lowest > -0.5 * offset || *offset == FARTHEST);
    reaching.map(|offset| Response::Log { offset }).collect()
}

/// What is known of one fault.
struct Fault<const K: usize> {
    response: Response,
    population: Population<K>,
}

impl<const K: usize> Fault<K> {
    /// The likeliest of the responses that are tried.
    fn learn(lives: &[Seen], fault: usize, tried: &[Response]) -> Self {
        let least_noise = lives[0][0].sigma[fault] / REFERENCE_LIMIT;
        let learned = tried.iter().map(|&response| {
            let sums: Vec<Sums<K>> = lives.iter().map(|life| response.sums(life, fault)).collect();
            let population = Population::learn(&sums, response.slope(1.0) * least_noise);
            let severities = lives.iter().flat_map(|life| life.iter()).map(|seen| severity(seen, fault));
            let stretch: f64 = severities.map(|severity| libm::log(response.slope(severity))).sum();
            (population.log_likelihood(&sums) + stretch, Self { response, population })
        });
        learned.max_by(|a, b| a.0.total_cmp(&b.0)).expect("one is tried").1
    }
}

/// The measure of damage in which a curve is a polynomial of the age.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Response {
    Plain,
    Log { offset: f64 },
}

impl Response {
    fn of(self, severity: f64) -> f64 {
        match self {
            Self::Plain => severity,
            Self::Log { offset } => libm::log((severity + offset).max(LEAST * offset)),
        }
    }

    /// Its derivative.
    fn slope(self, severity: f64) -> f64 {
        match self {
            Self::Plain => 1.0,
            Self::Log { offset } => 1.0 / (severity + offset).max(LEAST * offset),
        }
    }

    fn sums<const K: usize>(self, life: &[Observation], fault: usize) -> Sums<K> {
        let mut sums = Sums::default();
        life.iter().for_each(|seen| sums.add(age(seen.t_fh), self.of(severity(seen, fault))));
        sums
    }
}

/// The share of the way from nominal to the limit.
fn severity(seen: &Observation, fault: usize) -> f64 {
    seen.fault_vector.values()[fault] / REFERENCE_LIMIT
}

/// The age in characteristic lives.
fn age(t_fh: f64) -> f64 {
    t_fh / REFERENCE_LIFE_FH
}

impl<const K: usize> Estimator for MixedEffects<K> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { faults: &self.faults, sums: vec![Sums::default(); self.faults.len()] })
    }
}

struct Life<'a, const K: usize> {
    faults: &'a [Fault<K>],
    sums: Vec<Sums<K>>,
}

impl<const K: usize> Follower for Life<'_, K> {
    fn observe(&mut self, observation: &Observation) {
        for (index, (fault, sums)) in self.faults.iter().zip(&mut self.sums).enumerate() {
            sums.add(age(observation.t_fh), fault.response.of(severity(observation, index)));
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let known = self.faults.iter().zip(&self.sums);
        let known: Vec<_> =
            known.map(|(fault, sums)| (fault.population.posterior(sums), fault.response.of(1.0))).collect();
        let end_fh = |draw: usize| {
            let mut stream = stream.substream(draw as u64);
            let passages = known.iter().filter_map(|(coefficients, limit)| {
                let curve = below(coefficients, *limit, age(now_fh), &mut stream);
                curve.map_or(Some(0.0), |curve| curve.passage(*limit))
            });
            passages.reduce(f64::min).map(|ages| ages * REFERENCE_LIFE_FH).filter(|fh| *fh < settings.horizon_fh)
        };
        RulEstimate { ends_fh: (0..settings.draws).map(end_fh).collect(), propagation: None, doubted: false }
    }
}

/// A curve that is below the limit now.
fn below<const K: usize>(coefficients: &Coefficients<K>, limit: f64, age: f64, stream: &mut Stream) -> Option<Curve> {
    (0..TRIES).map(|_| Curve::new(&coefficients.draw(stream), age)).find(|curve| curve.value < limit)
}

/// A parabola as it goes on from now.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Curve {
    value: f64,
    slope: f64,
    /// Half of the second derivative.
    bend: f64,
}

impl Curve {
    /// The polynomial of these coefficients from an age on.
    fn new(coefficients: &[f64], age: f64) -> Self {
        let c = |power: usize| coefficients.get(power).copied().unwrap_or_default();
        Self { value: c(0) + age * (c(1) + age * c(2)), slope: c(1) + 2.0 * age * c(2), bend: c(2) }
    }

    /// The time to the first passage of a limit above; `None` where it never is.
    fn passage(self, limit: f64) -> Option<f64> {
        let missing = limit - self.value;
        let discriminant = self.slope * self.slope + 4.0 * self.bend * missing;
        let steepness = self.slope + discriminant.max(0.0).sqrt();
        (discriminant >= 0.0 && steepness > 0.0).then(|| 2.0 * missing / steepness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_passes_a_limit_where_it_says() {
        for (value, slope, bend) in [(0.1, 0.5, 0.0), (0.1, 0.5, 2.0), (0.1, -0.5, 2.0), (0.1, 2.0, -0.5)] {
            let passage = Curve { value, slope, bend }.passage(1.0).expect("it passes");
            assert!((value + passage * (slope + passage * bend) - 1.0).abs() < 1e-12, "{value} {slope} {bend}");
            let before = 0.999 * passage;
            assert!(passage > 0.0 && value + before * (slope + before * bend) < 1.0, "not the first of two");
        }
        for (slope, bend) in [(0.0, 0.0), (-0.1, 0.0), (0.5, -0.2), (-0.5, -0.2)] {
            assert_eq!(Curve { value: 0.1, slope, bend }.passage(1.0), None, "{slope} {bend}");
        }
    }
}
