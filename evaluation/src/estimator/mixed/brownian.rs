//! The exponential model whose errors go on: a Brownian motion with a drift of each life's own.
//!
//! - What: ln(x + offset) = c0 + c1 t + sigma W(t) of the damage x at age t, seen without error of its own.
//! - Update rule: increments teach the drift c1, normal over the fleet, and sigma; what was seen last is where a life
//!   stands. The first passage of the limit from there is inverse Gaussian, and known to lie ahead. The offset is the
//!   one of those tried that makes the increments of the earlier lives likeliest.
//! - Requirements: as of [`MixedEffects`](super::MixedEffects). What is error of the measurement counts as motion.
//! - Source: Gebraeel, Lawley, Li and Ryan 2005, the second of their error models; Michael, Schucany and Haas 1976 for
//!   draws.

use nalgebra::SVector;
use numerics::Stream;
use prognosis::{
    EndedLife, Estimator, Follower, Observation, PredictionSettings, REFERENCE_LIFE_FH, REFERENCE_LIMIT, RulEstimate,
};

use super::{
    Response, Seen, TRIES, age, exponential_responses,
    population::{Population, Sums},
    seen, severity,
};

const NAME: &str = "mixed-brownian";

/// The model as an [`Estimator`].
pub struct MixedBrownian {
    faults: Vec<Fault>,
}

impl MixedBrownian {
    /// What earlier lives teach; `None` where they have no observation.
    pub fn learn(lives: &[EndedLife]) -> Option<Self> {
        let lives = seen(lives);
        let faults = lives.first()?[0].sigma.len();
        Some(Self { faults: (0..faults).map(|fault| Fault::learn(&lives, fault)).collect() })
    }
}

/// What is known of one fault: its drifts, and the variance of its motion in a characteristic life.
struct Fault {
    response: Response,
    population: Population<1>,
}

impl Fault {
    fn learn(lives: &[Seen], fault: usize) -> Self {
        let least_noise = lives[0][0].sigma[fault] / REFERENCE_LIMIT;
        let learned = exponential_responses(lives, fault).into_iter().map(|response| {
            let paths = lives.iter().map(|life| {
                let mut path = Path::default();
                life.iter().for_each(|seen| path.add(age(seen.t_fh), response.of(severity(seen, fault))));
                path
            });
            let sums: Vec<Sums<1>> = paths.map(|path| path.drift).collect();
            let population = Population::learn(&sums, response.slope(1.0) * least_noise);
            let later = lives.iter().flat_map(|life| &life[1..]);
            let stretch: f64 = later.map(|seen| libm::log(response.slope(severity(seen, fault)))).sum();
            (population.log_likelihood(&sums) + stretch, Self { response, population })
        });
        learned.max_by(|a, b| a.0.total_cmp(&b.0)).expect("one is tried").1
    }
}

/// What was seen of a motion.
#[derive(Debug, Clone, Default)]
struct Path {
    /// The increments so far.
    drift: Sums<1>,
    /// Age and place when it was seen last.
    last: Option<(f64, f64)>,
}

impl Path {
    fn add(&mut self, age: f64, place: f64) {
        if let Some((before, from)) = self.last.replace((age, place)).filter(|(before, _)| *before < age) {
            let root = (age - before).sqrt();
            self.drift.add_row(SVector::from([root]), (place - from) / root);
        }
    }
}

impl Estimator for MixedBrownian {
    fn name(&self) -> &'static str {
        NAME
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { faults: &self.faults, paths: vec![Path::default(); self.faults.len()] })
    }
}

struct Life<'a> {
    faults: &'a [Fault],
    paths: Vec<Path>,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        for (index, (fault, path)) in self.faults.iter().zip(&mut self.paths).enumerate() {
            path.add(age(observation.t_fh), fault.response.of(severity(observation, index)));
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let known = self.faults.iter().zip(&self.paths);
        let known: Vec<_> = known.map(|(fault, path)| (fault, path, fault.population.posterior(&path.drift))).collect();
        let end_fh = |draw: usize| {
            let mut stream = stream.substream(draw as u64);
            let passages = known.iter().filter_map(|(fault, path, drift)| {
                let (last, place) = path.last.unwrap_or((0.0, fault.response.of(0.0)));
                let (missing, lag) = (fault.response.of(1.0) - place, age(now_fh) - last);
                let mut passage = || passage(missing, drift.draw(&mut stream)[0], fault.population.noise, &mut stream);
                let ahead = (0..TRIES).map(|_| passage()).find(|passage| passage.is_none_or(|passage| passage > lag));
                ahead.map_or(Some(0.0), |passage| passage.map(|passage| passage - lag))
            });
            passages.reduce(f64::min).map(|ages| ages * REFERENCE_LIFE_FH).filter(|fh| *fh < settings.horizon_fh)
        };
        RulEstimate { ends_fh: (0..settings.draws).map(end_fh).collect(), propagation: None, doubted: false }
    }
}

/// A draw of the time that a Brownian motion takes for a way up; `None` where it never gets there.
fn passage(way: f64, drift: f64, variance: f64, stream: &mut Stream) -> Option<f64> {
    if way <= 0.0 {
        return Some(0.0);
    }
    let comes = drift > 0.0 || stream.uniform() < libm::exp(2.0 * drift * way / variance);
    comes.then(|| inverse_gaussian(way / drift.abs().max(f64::MIN_POSITIVE), way * way / variance, stream))
}

fn inverse_gaussian(mean: f64, shape: f64, stream: &mut Stream) -> f64 {
    let z = stream.normal();
    let w = 0.5 * mean * z * z / shape;
    let small = mean / (1.0 + w + (w * (2.0 + w)).sqrt());
    if stream.uniform() * (mean + small) <= mean { small } else { mean * (mean / small) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of an inverse Gaussian, and the share of motions that drift away and come nevertheless.
    #[test]
    fn passages_have_their_moments() {
        let (mut stream, count) = (Stream::new(1, &["passages"]), 40_000);
        let passages: Vec<f64> = (0..count).filter_map(|_| passage(0.8, 1.6, 0.2, &mut stream)).collect();
        let mean = passages.iter().sum::<f64>() / f64::from(count);
        let variance = passages.iter().map(|t| (t - mean) * (t - mean)).sum::<f64>() / f64::from(count);
        assert!((mean - 0.5).abs() < 0.003, "{mean}");
        // way variance / drift^3.
        assert!((variance - 0.8 * 0.2 / 1.6_f64.powi(3)).abs() < 0.002, "{variance}");
        let come = (0..count).filter(|_| passage(0.3, -0.2, 0.2, &mut stream).is_some()).count();
        assert!((come as f64 / f64::from(count) - (-0.6_f64).exp()).abs() < 0.01, "{come}");
        assert_eq!(passage(-0.1, 1.0, 0.2, &mut stream), Some(0.0));
    }
}
