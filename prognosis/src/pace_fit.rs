//! Learning what load and temperature do to wear, by evidence.
//!
//! - What: exponent and temperature coefficient of a part number from lives that are over.
//! - Update rule: for each pair that is tried, lives count in the damage-equivalent hours of it, a prior of constant growth
//!   is fitted on, and the evidence of its filter, together with what was known of the pair before, says how good it is.
//!   A paraboloid through six pairs says which to try next; after three of them the last gives mean and covariance. The
//!   lives of which little is known weigh little. A pair is believed where its evidence is greater by five nats.
//! - Requirements: offline; flights that tell load or temperature.
//! - Source: MacKay 1992 for evidence; Nelson 1990 for accelerated lives.

use domain::FaultModel;
use numerics::quantile;
use rayon::prelude::*;

use crate::{
    block::{Block, blocks},
    coordinate::Coordinate,
    ended::EndedLife,
    fit::{evidence_each, fit_to_the_end},
    missions::Missions,
    pace::{Basis, Coefficient, PaceLaw},
    prior::FleetPrior,
};

/// What is known of exponent and temperature coefficient before any life: nothing in particular.
const VAGUE: [Coefficient; 2] = [Coefficient { mean: 0.0, sd: 1.0 }, Coefficient { mean: 0.0, sd: 0.5 }];
/// What is told as exact is known so well.
const SURE: f64 = 1e-3;
/// First distance between pairs that are tried, and by how much it shrinks.
const FIRST_STEP: [f64; 2] = [0.8, 0.3];
const SHRINK: f64 = 0.4;
const PARABOLOIDS: usize = 3;
/// The next centre lies within so many distances.
const REACH: f64 = 3.0;
/// Evidence that makes load and temperature believed, nats.
const BELIEVED: f64 = 5.0;
/// Loads of the lives that count as seen, by quantile.
const SEEN: [f64; 2] = [0.02, 0.98];

/// What was learned of the pace, believed or not.
#[derive(Debug, Clone, PartialEq)]
pub struct PaceLesson {
    /// The law.
    pub law: PaceLaw,
    /// By how much evidence is greater than for what was known before, nats: no effect of load and temperature, or what was told.
    pub gain: f64,
}

impl PaceLesson {
    /// Whether the evidence is enough.
    pub fn is_believed(&self) -> bool {
        self.gain >= BELIEVED
    }
}

/// Lives whose pace is sought.
struct Search<'a> {
    lives: Vec<&'a EndedLife>,
    /// Their blocks in the measure of damage, in flight hours: whatever the pair, evidence is that of the same values.
    blocks: Vec<Vec<Block>>,
    model: &'a FaultModel,
    known: [Coefficient; 2],
    /// Share of each life that is known.
    shares: Vec<f64>,
    /// Least and greatest load of their flights.
    seen_loads: Option<[f64; 2]>,
}

impl PaceLaw {
    /// What lives tell of the pace, their growth being constant in a measure of damage, as `prior` knows of it; `told` is what
    /// was known before. `None` where no life tells of load or temperature.
    pub fn learn(
        lives: &[EndedLife],
        model: &FaultModel,
        (coordinate, prior): (Coordinate, &FleetPrior),
        told: Option<&Self>,
    ) -> Option<PaceLesson> {
        let lives: Vec<&EndedLife> = lives.iter().filter(|life| life.tells_of_pace()).collect();
        let known = told.map_or(VAGUE, |told| [told.exponent, told.temperature]);
        let known = known.map(|known| Coefficient { sd: known.sd.max(SURE), ..known });
        let no_pace = Self::told(Coefficient::default(), Coefficient::default());
        let share = |life: &&EndedLife| life.clock(&no_pace).life(life.end_fh).known_share;
        let shares: Vec<f64> = lives.iter().map(share).collect();
        if shares.iter().all(|share| *share == 0.0) {
            return None;
        }
        let measured =
            |life: &&EndedLife| life.observations.iter().map(|seen| coordinate.observation(seen)).collect::<Vec<_>>();
        let cut = lives.par_iter().map(|life| blocks(&measured(life), &prior.clock)).collect();
        let seen_loads = seen_loads(&lives);
        let search = Search { lives, blocks: cut, model, known, shares, seen_loads };
        let prior = FleetPrior { growth_changes: None, consistency: None, ..prior.clone() };
        let (best, covariance, gain) = search.run(&prior);
        let [exponent, temperature] = [0, 1].map(|i| Coefficient { mean: best[i], sd: covariance[i].sqrt() });
        let basis = Basis::Learned { lives: search.lives.len(), gain };
        let law = Self { exponent, temperature, basis, seen_loads: search.seen_loads, ..no_pace };
        Some(PaceLesson { law: Self { missions: search.missions(&law), ..law }, gain })
    }
}

impl Search<'_> {
    /// The best pair, the variances of both, and by how much evidence is greater than for what was known before.
    fn run(&self, prior: &FleetPrior) -> ([f64; 2], [f64; 2], f64) {
        let before = self.known.map(|known| known.mean);
        let start = self.evidence(before, prior);
        let (mut best, mut center, mut step) = ((before, start.clone()), before, FIRST_STEP);
        let mut covariance = self.known.map(|known| known.sd * known.sd);
        for _ in 0..PARABOLOIDS {
            let [p, beta] = center;
            let [dp, db] = step;
            let pairs =
                [[p, beta], [p + dp, beta], [p - dp, beta], [p, beta + db], [p, beta - db], [p + dp, beta + db]];
            let tried = pairs.map(|pair| (pair, self.evidence(pair, &best.1.prior)));
            for (pair, tried) in &tried {
                if tried.log_posterior > best.1.log_posterior {
                    best = (*pair, tried.clone());
                }
            }
            let heights: Vec<f64> = tried.iter().map(|(_, tried)| tried.log_posterior).collect();
            (center, covariance) = match paraboloid(&heights, step) {
                Some((way, variances)) => {
                    let reached = [0, 1].map(|i| center[i] + way[i].clamp(-REACH * step[i], REACH * step[i]));
                    (reached, variances)
                }
                None => (best.0, covariance),
            };
            step = step.map(|step| SHRINK * step);
        }
        let last = self.evidence(center, &best.1.prior);
        if last.log_posterior > best.1.log_posterior {
            best = (center, last);
        }
        (best.0, covariance, best.1.log_posterior - start.log_posterior)
    }

    /// The blocks of each life where they are by the hours of a pair.
    fn aged(&self, [p, beta]: [f64; 2]) -> Vec<Vec<Block>> {
        let told = PaceLaw::told(Coefficient { mean: p, sd: 0.0 }, Coefficient { mean: beta, sd: 0.0 });
        let law = PaceLaw { seen_loads: self.seen_loads, ..told };
        let of_life = |(life, blocks): (&&EndedLife, &Vec<Block>)| {
            let clock = life.clock(&law);
            blocks.iter().map(|block| clock.aged(block.clone(), &life.observations)).collect()
        };
        self.lives.par_iter().zip(&self.blocks).map(of_life).collect()
    }

    fn evidence(&self, pair: [f64; 2], prior: &FleetPrior) -> Tried {
        let lives = self.aged(pair);
        let prior = fit_to_the_end(prior.clone(), &lives, self.model);
        let each = evidence_each(&lives, self.model, &prior);
        let weighed: f64 = each.iter().zip(&self.shares).map(|(evidence, share)| evidence * share).sum();
        let before = |i: usize| {
            let z = (pair[i] - self.known[i].mean) / self.known[i].sd;
            -0.5 * z * z
        };
        Tried { log_posterior: weighed + before(0) + before(1), prior }
    }

    /// The missions that the lives flew.
    fn missions(&self, law: &PaceLaw) -> Missions {
        let windows: Vec<_> = self.lives.iter().map(|life| life.clock(law).windows(life.end_fh)).collect();
        Missions::learn(&windows, Missions::usual(law.exponent.mean, law.temperature.mean))
    }
}

/// Least and greatest load of flights, but for a few; `None` where none tells one.
fn seen_loads(lives: &[&EndedLife]) -> Option<[f64; 2]> {
    let told = lives.iter().flat_map(|life| &life.flights).filter_map(|flight| flight.load);
    let loads = quantile::sorted(told.collect());
    (!loads.is_empty()).then(|| SEEN.map(|level| quantile::nearest(&loads, level)))
}

/// A pair that was tried.
#[derive(Clone)]
struct Tried {
    log_posterior: f64,
    /// The prior of growth by it.
    prior: FleetPrior,
}

/// Where the paraboloid through the heights at [0, 0], [+, 0], [-, 0], [0, +], [0, -], [+, +] steps has its top, and the
/// variances of the normal density of which it is the log; `None` where it has no top.
fn paraboloid(heights: &[f64], [dp, db]: [f64; 2]) -> Option<([f64; 2], [f64; 2])> {
    let &[o, right, left, up, down, corner] = heights else { unreachable!("six heights") };
    let slope = [(right - left) / (2.0 * dp), (up - down) / (2.0 * db)];
    let (pp, bb) = ((2.0 * o - right - left) / (dp * dp), (2.0 * o - up - down) / (db * db));
    let pb = -(corner - right - up + o) / (dp * db);
    let determinant = pp * bb - pb * pb;
    if !(pp > 0.0 && determinant > 0.0) {
        return None;
    }
    let way = [(bb * slope[0] - pb * slope[1]) / determinant, (pp * slope[1] - pb * slope[0]) / determinant];
    Some((way, [bb / determinant, pp / determinant]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paraboloid_tells_where_its_top_is_and_how_wide_it_is() {
        let height = |p: f64, b: f64| {
            let (x, y) = (p - 0.3, b + 0.2);
            7.0 - 0.5 * (4.0 * x * x + 2.0 * x * y + 9.0 * y * y)
        };
        let (dp, db) = (0.5, 0.25);
        let heights =
            [height(0.0, 0.0), height(dp, 0.0), height(-dp, 0.0), height(0.0, db), height(0.0, -db), height(dp, db)];
        let (top, variances) = paraboloid(&heights, [dp, db]).unwrap();
        assert!((top[0] - 0.3).abs() < 1e-12 && (top[1] + 0.2).abs() < 1e-12, "{top:?}");
        assert!((variances[0] - 9.0 / 35.0).abs() < 1e-12 && (variances[1] - 4.0 / 35.0).abs() < 1e-12);
        assert_eq!(paraboloid(&heights.map(|height| -height), [dp, db]), None);
    }
}
