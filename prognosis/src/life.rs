//! One life as its prior sees it.
//!
//! - What: the blocks of a life in the measure of each growth law and the levels that it reached ([`MeasuredLife`]),
//!   the filters that follow them ([`LifeFilter`]), and what is known by then ([`Known`]).
//! - Update rule: those of the filters and of the level. A law weighs its share of the fleet times the evidence of the
//!   life so far.
//! - Requirements: observations in the order of the life; faults and trends are told by the fleet's most frequent law.
//! - Source: Hoeting et al. 1999 for weights by evidence.

use domain::{Doubt, FaultModel, FaultTrend, Propagation, explanation::Growth};
use numerics::log_sum_exp::normalised;

use crate::{
    block::{Block, Observation, blocks, unclosed},
    boundary::Boundary,
    coordinate::Coordinate,
    filter::Filter,
    growth_laws::GrowthLaw,
    level::{Ascent, Gauge},
    life_prior::LifePrior,
    moments::Moments,
    pace::PaceLaw,
    particle::log_evidence,
    posterior::Posterior,
    wear_clock::{Stretch, WearClock},
};

/// The observations of a life, measured by its prior.
#[derive(Debug, Clone)]
pub struct MeasuredLife {
    laws: Vec<MeasuredLaw>,
    /// The level that was reached by the end of each block; none where nobody asks for levels.
    levels: Vec<f64>,
    /// The same by the last observation.
    level_now: f64,
}

/// A life in the measure of one law.
#[derive(Debug, Clone)]
struct MeasuredLaw {
    coordinate: Coordinate,
    log_share: f64,
    blocks: Vec<Block>,
    /// What is known since the last block, as if it were closed.
    since: Option<Block>,
    /// Log of how much the measure stretches what was seen up to each block.
    log_stretch: Vec<f64>,
}

impl MeasuredLife {
    /// A life that began at some hours, whose `blocks` are closed; they lie where its clock tells, where there is one.
    pub fn new(
        (observations, blocks): (&[Observation], &[Block]),
        (began_fh, wear_clock): (f64, Option<&WearClock>),
        prior: &LifePrior,
        (model, boundary): (&FaultModel, &dyn Boundary),
    ) -> Self {
        let law = |law| MeasuredLaw::new(law, observations, blocks, wear_clock);
        let laws = prior.growth.laws.iter().map(law).collect();
        let mut ascent = Ascent::new(Gauge::new(boundary, &model.nominal));
        let mut levels = Vec::new();
        if prior.companions.is_some() {
            let mut closing = blocks.iter().map(|block| block.observations.end).peekable();
            for (index, observation) in observations.iter().enumerate() {
                let t_fh = wear_clock.map_or(observation.t_fh, |clock| clock.worn_h(observation.t_fh));
                ascent.observe(&Observation { t_fh: t_fh - began_fh, ..observation.clone() });
                levels.extend(closing.next_if_eq(&(index + 1)).map(|_| ascent.level()));
            }
        }
        Self { laws, levels, level_now: ascent.level() }
    }
}

impl MeasuredLaw {
    fn new(law: &GrowthLaw, observations: &[Observation], plain: &[Block], wear_clock: Option<&WearClock>) -> Self {
        let (blocks, since) = match law.coordinate {
            identity if identity == Coordinate::IDENTITY => {
                (plain.to_vec(), unclosed(observations, plain, &law.prior.clock))
            }
            _ => law.blocks(observations, plain),
        };
        let since = match wear_clock {
            Some(clock) => since.map(|since| clock.aged(since, observations)),
            None => since,
        };
        let stretched = plain.iter().scan(0.0, |sum, block| {
            *sum += law.log_stretch(&block.mean);
            Some(*sum)
        });
        Self {
            coordinate: law.coordinate,
            log_share: libm::log(law.share),
            log_stretch: stretched.collect(),
            blocks,
            since,
        }
    }
}

impl GrowthLaw {
    /// Blocks in its measure, closed where the plain ones are, and what is known since.
    fn blocks(&self, observations: &[Observation], plain: &[Block]) -> (Vec<Block>, Option<Block>) {
        let clock = &self.prior.clock;
        let measured: Vec<Observation> = observations.iter().map(|seen| self.coordinate.observation(seen)).collect();
        let mut blocks = blocks(&measured, clock);
        let since = unclosed(&measured, &blocks, clock);
        // Times are those of the plain ones, which may have been mended.
        blocks.iter_mut().zip(plain).for_each(|(block, plain)| block.centre_fh = plain.centre_fh);
        (blocks, since)
    }
}

/// Filters that follow one life, one per law.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeFilter {
    pub(crate) filters: Vec<Filter>,
}

impl LifeFilter {
    /// Filters at the start of a life that begins at some hours.
    pub fn new(model: &FaultModel, prior: &LifePrior, began_fh: f64) -> Self {
        let at_start = |law: &GrowthLaw| Filter::new(model, &law.prior).beginning_at(began_fh);
        Self { filters: prior.growth.laws.iter().map(at_start).collect() }
    }

    /// Takes the next block.
    pub fn update(&mut self, life: &MeasuredLife, index: usize) {
        self.filters.iter_mut().zip(&life.laws).for_each(|(filter, law)| filter.update(&law.blocks[index]));
    }

    /// What the blocks so far lead one to expect of each fault in a block, and what was seen there, in the measure of
    /// the first law.
    pub fn expect(&self, life: &MeasuredLife, index: usize) -> Vec<Expectation> {
        let MeasuredLaw { coordinate, blocks, .. } = &life.laws[0];
        let expected = self.filters[0].expect(&blocks[index]).into_iter().zip(&blocks[index].mean);
        expected.map(|(expected, &seen)| Expectation { expected, seen, coordinate: *coordinate }).collect()
    }

    /// What is known after a block, which was the last one.
    pub fn known(&self, life: &MeasuredLife, index: usize) -> Known {
        let level = life.levels.get(index).copied().unwrap_or_default();
        Known::new(&self.filters, life, index, level)
    }

    /// What is known by the last observation. What was seen since the last block counts where one is told to, as if it
    /// were a block.
    pub fn known_now(&self, life: &MeasuredLife, with_unclosed: bool) -> Known {
        let index = life.laws[0].blocks.len() - 1;
        let ahead = |(filter, law): (&Filter, &MeasuredLaw)| match &law.since {
            Some(since) if with_unclosed => filter.with(since),
            _ => filter.clone(),
        };
        let filters: Vec<Filter> = self.filters.iter().zip(&life.laws).map(ahead).collect();
        Known::new(&filters, life, index, life.level_now)
    }

    /// Why the life so far should not be taken for one of the fleet. `flight_hours` tells when some hours of wear were.
    pub fn doubt(&self, flight_hours: &dyn Fn(f64) -> f64) -> Option<Doubt> {
        self.filters[0].doubt_in(flight_hours)
    }
}

/// One fault of a block against its expectation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    expected: Moments,
    seen: f64,
    coordinate: Coordinate,
}

impl Expectation {
    /// The value that the blocks before led one to expect.
    pub fn expected(&self) -> f64 {
        self.coordinate.deviation(self.expected.mean)
    }

    /// The value that was seen.
    pub fn seen(&self) -> f64 {
        self.coordinate.deviation(self.seen)
    }

    /// By how many standard deviations the two differ.
    pub fn z(&self) -> f64 {
        (self.seen - self.expected.mean) / self.expected.sigma
    }
}

/// What is known of a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// What each law's filter knows, with the law's weight in this life.
    pub(crate) growth: Vec<(f64, Posterior)>,
    /// The greatest level so far.
    pub(crate) level: f64,
    coordinate: Coordinate,
}

impl Known {
    fn new(filters: &[Filter], life: &MeasuredLife, index: usize, level: f64) -> Self {
        let log_weight = |(filter, law): (&Filter, &MeasuredLaw)| {
            law.log_share + log_evidence(&filter.particles) + law.log_stretch[index]
        };
        let weights = normalised(&filters.iter().zip(&life.laws).map(log_weight).collect::<Vec<_>>());
        let growth = weights.into_iter().zip(filters.iter().map(Filter::posterior)).collect();
        Self { growth, level, coordinate: life.laws[0].coordinate }
    }

    /// Time that it belongs to, hours since new.
    pub fn t_fh(&self) -> f64 {
        self.first().t_fh()
    }

    /// Filtered faults with their trends.
    pub fn trends(&self) -> Vec<FaultTrend> {
        let mut trends = self.first().trends();
        if self.coordinate != Coordinate::IDENTITY {
            for trend in &mut trends {
                let value = self.coordinate.deviation(trend.value);
                let slope = self.coordinate.slope(value);
                trend.value = value;
                trend.sigma /= slope;
                trend.trend_per_1000_fh /= slope;
            }
        }
        trends
    }

    /// The refitted damage-propagation model, in the measure of the first law.
    pub fn propagation(&self) -> Propagation {
        self.first().propagation()
    }

    /// The same per flight hour of a mission.
    pub fn propagation_at(&self, law: &PaceLaw, mission: &Stretch) -> Propagation {
        self.first().propagation_at(law, mission)
    }

    /// How growth has changed, where that is followed.
    pub fn growth_summary(&self) -> Option<Growth> {
        self.first().growth_summary()
    }

    fn first(&self) -> &Posterior {
        &self.growth[0].1
    }
}
