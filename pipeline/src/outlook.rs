//! From the course of a life to its states and its prognosis.
//!
//! A state rests on all usable estimates up to its block and on nothing else; its digest says so.
//! States whose digest still matches are kept, all others are computed anew, so the result depends on
//! the set of estimates and not on the order of their arrival. A filter that was kept after some block
//! spares the way up to it and changes no result.

use domain::{
    Ahead, Doubt, DoubtKind, Estimate, Explanation, FaultGroup, FaultModel, FaultTrend, NUMERICS_VERSION, Prognosis,
    RulDistribution, SetAside, State,
    explanation::Driver,
    prognosis::{Forecast, Gap, InsufficientHistory},
};
use prognosis::{
    Clock, Companions, LifeFilter,
    forecast::{Draws, Forecast as Drawn},
};

use crate::{
    Course, LifeContext, Model,
    agreement::load_agreement,
    checkpoint::Checkpoint,
    course::{Contested, Unusable},
    draws::{self, SEED},
    paced::Paced,
    walk::{OutlookError, Walk, check_finite},
};

/// Largest share of the draws whose end may lie where the surrogate has learned nothing.
const OUTSIDE_TRAINING: f64 = 0.1;

/// States to replace, and the prognosis for the newest data.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// States of this block and later ones are replaced by `states`; `None` = all known ones stand.
    pub states_from: Option<u64>,
    /// New states.
    pub states: Vec<State>,
    /// The prognosis for the newest data; `None` for a life without estimates, and where newer data wait and no state
    /// is new.
    pub prognosis: Option<Prognosis>,
    /// The estimates that neither rests on, with the reason for each.
    pub excluded: Vec<SetAside>,
    /// Filters after new blocks that are worth keeping for good.
    pub checkpoints: Vec<Checkpoint>,
    /// The filter after the last closed block, from which the life goes on.
    pub latest: Option<Checkpoint>,
}

impl Model {
    /// States and prognosis of a life.
    ///
    /// `known` are its stored states, by block; `recalled` is one of the filters that
    /// [`Course::recallable`] asks for, or none. Where newer data of the life wait already (`superseded`), a forecast
    /// that would differ from the last one by an open block only is left to them. The prognosis, and it alone, reckons with
    /// what is told of the flights `ahead`.
    pub fn outlook(
        &self,
        context: &LifeContext,
        course: &Course,
        known: &[State],
        recalled: Option<Checkpoint>,
        superseded: bool,
        ahead: &Ahead,
    ) -> Result<Outlook, OutlookError> {
        let mut outlook = Outlook {
            states_from: first_block(known),
            states: Vec::new(),
            prognosis: None,
            excluded: course.excluded.clone(),
            checkpoints: Vec::new(),
            latest: None,
        };
        let Some(newest) = &course.newest else { return Ok(outlook) };
        let standing = course.standing(known);
        outlook.states_from = states_from(course, known, standing);
        let mut walk = Walk { model: self, context, course, recalled };
        outlook.latest = walk.follow(standing, &mut outlook.states, &mut outlook.checkpoints)?;
        if superseded && outlook.states_from.is_none() && standing > 0 {
            return Ok(outlook);
        }
        let clock = context.prior.body.clock();
        let last_state = outlook.states.last().or(known[..standing].last());
        let forecast = match (&outlook.latest, last_state) {
            (Some(latest), Some(state)) if course.in_closed_blocks() >= clock.observations => {
                let life = draws::Life { context, course, ahead };
                Ok(self.forecast(&life, &latest.filter, newest, state)?)
            }
            _ => Err(insufficient(course, clock, (10.0 * self.units.flight_hours(clock.block_fh)).round() / 10.0)),
        };
        outlook.prognosis = Some(Prognosis {
            as_of: newest.as_of(),
            forecast,
            load: course.usable.iter().rev().find_map(|estimate| estimate.load.clone()),
            load_agreement: load_agreement(&course.usable, self.motor(&context.prior.body)),
            mask_id: newest.mask_id,
            model: self.hash,
            prior: context.prior.hash,
            generation: context.generation,
            numerics_version: NUMERICS_VERSION,
            inputs_digest: course.inputs_digest,
        });
        Ok(outlook)
    }

    /// The forecast for the newest data, `state` being that of the last closed block. Where a gap lies behind that
    /// block, or where uploads may be a good part of a life apart, what is known since counts as well, before it is a
    /// block of its own.
    fn forecast(
        &self,
        life: &draws::Life,
        filter: &LifeFilter,
        newest: &Estimate,
        state: &State,
    ) -> Result<Forecast, OutlookError> {
        let draws::Life { context, course, .. } = *life;
        let gap = course.gap;
        let known = filter.known_now(&course.measured, gap.is_some() || self.units.are_own());
        let draws = self.draw(life, &known, newest, newest, Draws::precise());
        let paced = Paced::new(self, life, newest);
        let faults = self.units.trends(paced.trends(&known));
        check_finite(&faults, state.block)?;
        let mut doubts = state.doubts.clone();
        doubts.extend(outside_training(&draws));
        doubts.extend(gap.map(carried_over));
        doubts.extend(course.contested.map(contested));
        let beyond = self.units.probability_beyond(&faults).unwrap_or_default();
        Ok(Forecast {
            dominant_fault: dominant_fault(&self.bundle.faults, draws.dominant_group(), &faults),
            faults,
            propagation: self.units.propagation(paced.propagation(&known)),
            rul: RulDistribution::from_draws(&draws.ends_fh, self.horizon_fh(context)),
            p10_error_fh: draws.p10_error_fh,
            median_error_fh: draws.median_error_fh,
            probability_failed: beyond.max(draws.failed_fraction),
            seed: SEED,
            pace: paced.pace(),
            ensemble: context.prior.body.companions.as_ref().map(Companions::ensemble),
            explanation: Explanation {
                drivers: drivers(&self.bundle.faults, &draws),
                growth: state.growth.clone(),
                shift: state.shift.clone().filter(|_| gap.is_none()),
            },
            doubts,
            gap,
        })
    }
}

/// States of this block and later ones do not stand; `None` when all do.
fn states_from(course: &Course, known: &[State], standing: usize) -> Option<u64> {
    let known = known.get(standing).map(|state| state.block);
    let closed = course.blocks.get(standing).map(|block| block.index);
    match (known, closed) {
        (Some(known), Some(closed)) => Some(known.min(closed)),
        (known, closed) => known.or(closed),
    }
}

/// The fault groups that drive the end of life, the most frequent first.
fn drivers(model: &FaultModel, draws: &Drawn) -> Vec<Driver> {
    let faults = |group: &FaultGroup| match *group {
        FaultGroup::OneSided { index } | FaultGroup::Free { index } => vec![model.names[index].clone()],
        FaultGroup::Pair { indices } => indices.iter().map(|&index| model.names[index].clone()).collect(),
    };
    let shares = model.groups.iter().zip(draws.driver_shares()).filter(|(_, share)| *share > 0.0);
    let mut drivers: Vec<Driver> = shares.map(|(group, share)| Driver { faults: faults(group), share }).collect();
    drivers.sort_by(|a, b| b.share.total_cmp(&a.share));
    drivers
}

/// The surrogate is asked where it has learned nothing.
fn outside_training(draws: &Drawn) -> Option<Doubt> {
    let share = draws.outside_training_fraction;
    (share > OUTSIDE_TRAINING).then(|| Doubt {
        kind: DoubtKind::OutsideTraining,
        detail: format!(
            "{:.0} % of the simulated ends of life lie where the assessment has not been learned",
            100.0 * share
        ),
    })
}

/// The forecast reaches over a gap.
fn carried_over(Gap { from_fh, to_fh, observations }: Gap) -> Doubt {
    let since = match observations {
        1 => "1 observation".to_owned(),
        count => format!("{count} observations"),
    };
    let detail = format!("no data from {from_fh} to {to_fh} fh; {since} since, and no closed block");
    Doubt { kind: DoubtKind::Gap, detail }
}

/// Nobody knows whether the uploads that count are the right ones.
fn contested(Contested { set_aside, of }: Contested) -> Doubt {
    let detail = format!("hours and times of {set_aside} of {of} uploads contradict those of the others");
    Doubt { kind: DoubtKind::Hours, detail }
}

/// The entry of the dominant group that is furthest from nominal.
fn dominant_fault(model: &FaultModel, group: usize, faults: &[FaultTrend]) -> String {
    let index = match model.groups[group] {
        FaultGroup::OneSided { index } | FaultGroup::Free { index } => index,
        FaultGroup::Pair { indices: [a, b] } => {
            let deviation = |i: usize| (faults[i].value - model.nominal[i]).abs();
            if deviation(b) > deviation(a) { b } else { a }
        }
    };
    model.names[index].clone()
}

fn insufficient(course: &Course, Clock { observations, .. }: &Clock, block_fh: f64) -> InsufficientHistory {
    let usable = course.usable.as_slice();
    let missing = match usable {
        [] => "no upload so far could be diagnosed".to_owned(),
        [first, .., last] if usable.len() >= *observations => format!(
            "{} usable observations from {} to {} fh; one in a later {block_fh}-hour block is missing",
            usable.len(),
            first.flight_hours,
            last.flight_hours
        ),
        _ => format!(
            "{} of at least {observations} usable observations, followed by one in a later {block_fh}-hour block",
            usable.len()
        ),
    };
    InsufficientHistory { missing: missing + &unusable(course.unusable) }
}

/// Why uploads that were judged do not help.
fn unusable(Unusable { implausible, undiagnosable }: Unusable) -> String {
    let told = |count: usize, what: &str| match count {
        0 => String::new(),
        count => format!("; {count} {what}"),
    };
    told(implausible, "implausible: no healthy or faulty map fits the samples")
        + &told(undiagnosable, "undiagnosable: too few valid samples")
}

fn first_block(states: &[State]) -> Option<u64> {
    states.first().map(|state| state.block)
}
