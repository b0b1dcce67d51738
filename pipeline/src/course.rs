//! The course of a life: what counts of it, in closed blocks, each with the digest of all that its state
//! rests on.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use domain::{
    AsOf, ContentHash, Estimate, NUMERICS_VERSION, Outcome, SetAside, SetAsideReason, State, UploadId,
    block::MIN_OBSERVATIONS, prognosis::Gap,
};
use prognosis::{Block, Clock, Flight, LifePrior, MeasuredLife, MotorCalibration, Observation, WearClock, blocks};
use serde::Serialize;

use crate::{
    LifeContext, Model,
    chronology::implausible_hours,
    loads::{LoadTeller, known_load},
};

/// All that the states and the prognosis of a life are computed from, made ready.
#[derive(Debug, Clone)]
pub struct Course {
    /// Estimates that do not count, with the reason for each.
    pub(crate) excluded: Vec<SetAside>,
    /// How many of them contradict the others, where those are hardly more.
    pub(crate) contested: Option<Contested>,
    /// Those that do, in the order of the life.
    pub(crate) usable: Vec<Estimate>,
    /// Why some of those that are believed do not count.
    pub(crate) unusable: Unusable,
    /// The newest estimate that is believed, usable or not.
    pub(crate) newest: Option<Estimate>,
    /// Closed blocks of the usable ones.
    pub(crate) blocks: Vec<Block>,
    /// The life's damage-equivalent hours, where the pace of wear is known: blocks lie by them.
    pub(crate) wear_clock: Option<WearClock>,
    /// What the prior's laws and levels make of them.
    pub(crate) measured: MeasuredLife,
    /// What lies between the last closed block and those of no block yet, where that is a gap.
    pub(crate) gap: Option<Gap>,
    /// Digests of bundle, prior, life and every observation up to the end of each block.
    pub(crate) digests: Vec<ContentHash>,
    /// The digest of the same and of what no block has closed over yet.
    pub(crate) inputs_digest: ContentHash,
}

impl Model {
    /// The course of a life, whose `estimates` are given in its order.
    pub fn course(&self, context: &LifeContext, estimates: &[Estimate]) -> Course {
        let mut excluded = repeated_measurements(estimates);
        let distinct = without(estimates.iter(), &excluded);
        let contradicting = implausible_hours(&distinct);
        let contested = Contested::of(contradicting.len(), distinct.len());
        let believed = without(distinct.iter().copied(), &contradicting);
        excluded.extend(contradicting);
        let usable: Vec<Estimate> = believed.iter().copied().filter(|e| e.usable().is_some()).cloned().collect();
        let unusable = Unusable::of(&believed);
        let newest = usable.last().or(believed.last().copied()).cloned();
        let observations: Vec<Observation> = usable.iter().filter_map(|estimate| self.observation(estimate)).collect();
        let began_fh = self.units.reference_fh(context.began_fh);
        let clock = context.prior.body.clock();
        let wear_clock = self.wear_clock(context, &believed);
        let mut blocks = blocks(&observations, clock);
        if let Some(wear_clock) = &wear_clock {
            blocks = blocks.into_iter().map(|block| wear_clock.aged(block, &observations)).collect();
        }
        for block in &mut blocks {
            // A mean may be rounded to before all that it is the mean of.
            block.centre_fh = block.centre_fh.max(began_fh);
        }
        let mut digest = self.root(context);
        let mut chained = |inside: Range<usize>| {
            digest = ContentHash::of_parts([digest.bytes().as_slice(), &json(&usable[inside.clone()])]);
            if let Some(wear_clock) = &wear_clock {
                let worn_h: Vec<f64> = observations[inside].iter().map(|seen| wear_clock.worn_h(seen.t_fh)).collect();
                digest = ContentHash::of_parts([digest.bytes().as_slice(), &json(&worn_h)]);
            }
            digest
        };
        let digests = blocks.iter().map(|block| chained(block.observations.clone())).collect();
        let open = blocks.last().map_or(0, |block| block.observations.end);
        let inputs_digest = chained(open..usable.len());
        let gap = gap(&usable, &observations, open, clock);
        let assessed = (&self.followed, self.boundary());
        let measured =
            MeasuredLife::new((&observations, &blocks), (began_fh, wear_clock.as_ref()), &context.prior.body, assessed);
        Course {
            excluded,
            contested,
            unusable,
            newest,
            blocks,
            wear_clock,
            measured,
            gap,
            digests,
            inputs_digest,
            usable,
        }
    }

    /// What a usable estimate says, as priors count.
    pub(crate) fn observation(&self, estimate: &Estimate) -> Option<Observation> {
        observation(estimate).map(|seen| self.units.observation(seen))
    }

    /// The life's damage-equivalent hours by the flights that these estimates tell of; `None` where nobody
    /// knows the pace, or no flight tells of load or temperature.
    fn wear_clock(&self, context: &LifeContext, believed: &[&Estimate]) -> Option<WearClock> {
        let law = context.prior.body.pace.as_ref().filter(|law| law.acts())?;
        let flights = self.flights(believed.iter().copied(), self.motor(&context.prior.body));
        let clock = WearClock::new(law, self.units.reference_fh(context.began_fh), &flights);
        (!clock.is_silent()).then_some(clock)
    }

    /// The flights that estimates tell of, as priors count.
    pub(crate) fn flights<'a>(
        &self,
        estimates: impl Iterator<Item = &'a Estimate>,
        motor: Option<&MotorCalibration>,
    ) -> Vec<Flight> {
        let flight = |estimate: &Estimate| {
            let known = known_load(estimate, motor);
            Flight {
                t_fh: self.units.reference_fh(estimate.flight_hours),
                load: known.map(|(load, _)| load),
                temperature: estimate.temperature,
                by_motor: known.is_some_and(|(_, teller)| teller == LoadTeller::Motor),
            }
        };
        estimates.filter(|estimate| !estimate.on_ground).map(flight).collect()
    }

    /// How the motor tells a load, by the lives that taught the prior or by the bundle.
    pub(crate) fn motor<'a>(&'a self, prior: &'a LifePrior) -> Option<&'a MotorCalibration> {
        prior.motor.as_ref().or_else(|| self.bundle.loads.as_ref()?.motor.as_ref())
    }

    /// What every digest of the life begins with.
    fn root(&self, context: &LifeContext) -> ContentHash {
        let version = NUMERICS_VERSION.to_le_bytes();
        let root = ContentHash::of_parts([
            self.hash.bytes().as_slice(),
            context.prior.hash.bytes().as_slice(),
            &version,
            &json(context.life),
        ]);
        match context.life.overhaul_index {
            0 => root,
            _ => ContentHash::of_parts([root.bytes().as_slice(), &json(&context.began_fh)]),
        }
    }
}

impl Course {
    /// The newest observation that is believed.
    pub fn as_of(&self) -> Option<AsOf> {
        self.newest.as_ref().map(Estimate::as_of)
    }

    /// Blocks after which a filter may be recalled instead of following the life from its beginning, the
    /// first first: those whose `known` states stand, by index and digest.
    pub fn recallable(&self, known: &[State]) -> Vec<(u64, ContentHash)> {
        let blocks = self.blocks.iter().zip(&self.digests).map(|(block, digest)| (block.index, *digest));
        blocks.take(self.standing(known)).collect()
    }

    /// How many of the `known` states stand, from the first on.
    pub(crate) fn standing(&self, known: &[State]) -> usize {
        let blocks = self.blocks.iter().zip(&self.digests).zip(known);
        blocks.take_while(|((block, digest), state)| state.block == block.index && state.digest == **digest).count()
    }

    /// How many observations the closed blocks hold.
    pub(crate) fn in_closed_blocks(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.observations.end)
    }

    /// Estimates of a block.
    pub(crate) fn inside(&self, block: &Block) -> &[Estimate] {
        &self.usable[block.observations.clone()]
    }
}

/// The gap between the observations of closed blocks and those from `open` on, if there is one.
fn gap(usable: &[Estimate], seen: &[Observation], open: usize, clock: &Clock) -> Option<Gap> {
    let (last, next) = (open.checked_sub(1)?, usable.get(open)?);
    clock.is_gap(seen[last].t_fh, seen[open].t_fh).then_some(Gap {
        from_fh: usable[last].flight_hours,
        to_fh: next.flight_hours,
        observations: usable.len() - open,
    })
}

/// Uploads whose hours and times contradict others, where it is not clear which are right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Contested {
    /// Uploads that are set aside for that.
    pub set_aside: usize,
    /// Those and the ones that they contradict.
    pub of: usize,
}

impl Contested {
    /// A third or more, and as many as agree by chance at most.
    fn of(set_aside: usize, of: usize) -> Option<Self> {
        (set_aside >= MIN_OBSERVATIONS && 3 * set_aside >= of).then_some(Self { set_aside, of })
    }
}

/// Estimates from which a filter learns nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unusable {
    /// No healthy or faulty map fits their samples.
    pub implausible: usize,
    /// They have too few samples.
    pub undiagnosable: usize,
}

impl Unusable {
    fn of(estimates: &[&Estimate]) -> Self {
        let undiagnosable = |estimate: &&&Estimate| matches!(estimate.outcome, Outcome::Undiagnosable { .. });
        let undiagnosable = estimates.iter().filter(undiagnosable).count();
        let unusable = estimates.iter().filter(|estimate| estimate.usable().is_none()).count();
        Self { implausible: unusable - undiagnosable, undiagnosable }
    }
}

/// All but the first of the estimates of the same measurement, given in the order of the life.
fn repeated_measurements(estimates: &[Estimate]) -> Vec<SetAside> {
    let mut first: HashMap<_, &UploadId> = HashMap::new();
    let mut repeated = Vec::new();
    for estimate in estimates {
        let Some(measured) = estimate.measured() else { continue };
        let known = *first.entry(measured).or_insert(&estimate.upload_id);
        if *known != estimate.upload_id {
            repeated.push(SetAside {
                upload_id: estimate.upload_id.clone(),
                reason: SetAsideReason::RepeatedMeasurement,
                detail: format!(
                    "the same measurement as upload {known}: equal hours, time{}. A measurement that is sent again keeps \
                     its upload_id",
                    if estimate.mask_id.is_some() { ", mask and samples" } else { " and faults" }
                ),
            });
        }
    }
    repeated
}

/// The estimates that are not set aside.
fn without<'a>(estimates: impl Iterator<Item = &'a Estimate>, set_aside: &[SetAside]) -> Vec<&'a Estimate> {
    let set_aside: HashSet<&UploadId> = set_aside.iter().map(|one| &one.upload_id).collect();
    estimates.filter(|estimate| !set_aside.contains(&estimate.upload_id)).collect()
}

fn observation(estimate: &Estimate) -> Option<Observation> {
    let diagnosis = estimate.usable()?;
    Some(Observation {
        t_fh: estimate.flight_hours,
        fault_vector: diagnosis.fault_vector.clone(),
        sigma: diagnosis.sigma.clone(),
        load: estimate.load.as_ref().map(|load| load.ratio),
        temperature: estimate.temperature,
    })
}

fn json<T: Serialize + ?Sized>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).expect("nouns serialise: no maps with non-text keys")
}
