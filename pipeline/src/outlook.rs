//! From the estimates of a life to its states and its prognosis.
//!
//! A state rests on all usable estimates up to its block and on nothing else; its digest says so.
//! States whose digest still matches are kept, all others are computed anew, so the result depends on
//! the set of estimates and not on the order of their arrival.

use domain::{
    AsOf, ContentHash, Estimate, Explanation, FaultGroup, FaultModel, FaultTrend, Life, NUMERICS_VERSION, Prognosis,
    RulDistribution, SetAside, State, Stream,
    prognosis::{Forecast, InsufficientHistory},
    state::{BLOCK_FH, MIN_OBSERVATIONS},
};
use prognosis::{
    block::{Block, Observation, blocks},
    filter::Filter,
    forecast::{self, ForecastSettings, forecast},
    posterior::Posterior,
};

use crate::{Model, chronology::implausible_hours};

/// Draws of an issued prognosis.
const ISSUED_DRAWS: usize = 1000;
/// Draws of a state's quantiles: they make the history chart, nobody acts on them.
const STATE_DRAWS: usize = 200;
/// Ends of life beyond are censored, flight hours.
const HORIZON_FH: f64 = 10_000.0;
/// Seed of every draw; the natural key tells lives and uploads apart.
const SEED: u64 = 1;

/// Whose estimates these are.
#[derive(Debug, Clone, Copy)]
pub struct LifeContext<'a> {
    /// The life.
    pub life: &'a Life,
    /// Number of its generation.
    pub generation: u32,
}

/// States to replace, and the prognosis for the newest data.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// States of this block and later ones are replaced by `states`; `None` = all known ones stand.
    pub states_from: Option<u64>,
    /// New states.
    pub states: Vec<State>,
    /// For the newest data; `None` for a life without estimates.
    pub prognosis: Option<Prognosis>,
    /// The estimates that neither rests on, with the reason for each.
    pub excluded: Vec<SetAside>,
}

/// Why a life has no outlook.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OutlookError {
    /// An intermediate was not finite.
    #[error("the {what} of block {block} is {value}")]
    NotFinite {
        /// Which figure.
        what: &'static str,
        /// Of which block.
        block: u64,
        /// Its value.
        value: f64,
    },
}

impl Model {
    /// States and prognosis of a life.
    ///
    /// `estimates` are all of the life, in its order; `known` its stored states, by block.
    pub fn outlook(
        &self,
        context: &LifeContext,
        estimates: &[Estimate],
        known: &[State],
    ) -> Result<Outlook, OutlookError> {
        let excluded = implausible_hours(estimates);
        let believed = |estimate: &&Estimate| excluded.iter().all(|other| other.upload_id != estimate.upload_id);
        let believed: Vec<&Estimate> = estimates.iter().filter(believed).collect();
        let usable: Vec<&Estimate> = believed.iter().copied().filter(|estimate| estimate.usable().is_some()).collect();
        let Some(newest) = usable.last().or(believed.last()).copied() else {
            return Ok(Outlook { states_from: first_block(known), states: Vec::new(), prognosis: None, excluded });
        };
        let observations: Vec<Observation> = usable.iter().filter_map(|estimate| observation(estimate)).collect();
        let closed = blocks(&observations);
        let mut history =
            History { model: self, life: context.life, usable: &usable, known, states_from: None, states: Vec::new() };
        let (posterior, digest) = history.follow(&closed)?;
        let History { states_from, states, .. } = history;

        let open = &usable[closed.last().map_or(0, |block| block.observations.end)..];
        let inputs_digest = ContentHash::of_parts([digest.bytes().as_slice(), &json(&open)]);
        let forecast = match posterior {
            None => Err(insufficient(&observations)),
            Some(posterior) => {
                let block = closed.last().map_or(0, |block| block.index);
                Ok(self.forecast(context.life, &posterior, newest, block)?)
            }
        };
        let prognosis = Prognosis {
            as_of: as_of(newest),
            forecast,
            load: usable.iter().rev().find_map(|estimate| estimate.load.clone()),
            mask_id: newest.mask_id,
            model: self.hash,
            prior: self.prior,
            generation: context.generation,
            numerics_version: NUMERICS_VERSION,
            inputs_digest,
        };
        Ok(Outlook { states_from, states, prognosis: Some(prognosis), excluded })
    }

    fn forecast(
        &self,
        life: &Life,
        posterior: &Posterior,
        newest: &Estimate,
        block: u64,
    ) -> Result<Forecast, OutlookError> {
        let draws = self.draw(life, posterior, newest, ISSUED_DRAWS);
        let faults = posterior.trends();
        check_finite(&faults, block)?;
        Ok(Forecast {
            dominant_fault: dominant_fault(&self.bundle.faults, draws.dominant_group(), &faults),
            faults,
            propagation: posterior.propagation(),
            rul: RulDistribution::from_draws(&draws.ends_fh, HORIZON_FH),
            probability_failed: draws.failed_fraction,
            seed: SEED,
            explanation: Explanation::default(),
            doubts: Vec::new(),
        })
    }

    /// Draws of the end of life, counted from `newest`, keyed by its upload.
    fn draw(&self, life: &Life, posterior: &Posterior, newest: &Estimate, draws: usize) -> forecast::Forecast {
        let component = &life.component;
        let stream = Stream::new(
            SEED,
            &[
                component.operator.as_str(),
                component.part_number.as_str(),
                component.serial_number.as_str(),
                &life.overhaul_index.to_string(),
                newest.upload_id.as_str(),
            ],
        );
        let lag_fh = newest.flight_hours - posterior.t_fh();
        let settings = ForecastSettings { draws, horizon_fh: HORIZON_FH, ..ForecastSettings::default() };
        let error = self.bundle.prior.failure_time_error;
        forecast(posterior, lag_fh, &self.bundle.surrogate, error, &settings, &stream)
    }
}

/// Follows a life block by block.
struct History<'a> {
    model: &'a Model,
    life: &'a Life,
    usable: &'a [&'a Estimate],
    known: &'a [State],
    states_from: Option<u64>,
    states: Vec<State>,
}

impl History<'_> {
    /// The posterior after the last closed block, with the digest of all that it rests on.
    fn follow(&mut self, closed: &[Block]) -> Result<(Option<Posterior>, ContentHash), OutlookError> {
        let mut filter = Filter::new(&self.model.bundle.faults, &self.model.bundle.prior);
        let mut digest = self.root();
        for (i, block) in closed.iter().enumerate() {
            filter.update(block);
            let inside: Vec<&Estimate> = self.usable[block.observations.clone()].to_vec();
            digest = ContentHash::of_parts([digest.bytes().as_slice(), &json(&inside)]);
            let stands = self.states_from.is_none()
                && self.known.get(i).is_some_and(|state| state.block == block.index && state.digest == digest);
            if !stands {
                let replaced = self.known.get(i).map_or(block.index, |state| state.block.min(block.index));
                self.states_from.get_or_insert(replaced);
                let state = self.state(block, &inside, &filter.posterior(), digest)?;
                self.states.push(state);
            }
        }
        if self.states_from.is_none() {
            self.states_from = first_block(self.known.get(closed.len()..).unwrap_or_default());
        }
        Ok(((!closed.is_empty()).then(|| filter.posterior()), digest))
    }

    /// What every digest of the life begins with.
    fn root(&self) -> ContentHash {
        let version = NUMERICS_VERSION.to_le_bytes();
        ContentHash::of_parts([
            self.model.hash.bytes().as_slice(),
            self.model.prior.bytes().as_slice(),
            &version,
            &json(self.life),
        ])
    }

    fn state(
        &self,
        block: &Block,
        inside: &[&Estimate],
        posterior: &Posterior,
        digest: ContentHash,
    ) -> Result<State, OutlookError> {
        let last = inside[inside.len() - 1];
        let faults = posterior.trends();
        check_finite(&faults, block.index)?;
        let draws = self.model.draw(self.life, posterior, last, STATE_DRAWS);
        let rul = RulDistribution::from_draws(&draws.ends_fh, HORIZON_FH);
        Ok(State {
            block: block.index,
            from_fh: inside[0].flight_hours,
            as_of: as_of(last),
            observations: inside.len(),
            faults,
            propagation: posterior.propagation(),
            rul_quantiles_fh: rul.quantiles_fh(),
            rul_mean_fh: rul.mean_fh(),
            censored_fraction: rul.censored_fraction(),
            horizon_fh: rul.horizon_fh(),
            growth: None,
            movement: None,
            doubts: Vec::new(),
            digest,
        })
    }
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

fn as_of(estimate: &Estimate) -> AsOf {
    AsOf {
        flight_hours: estimate.flight_hours,
        recorded_at: estimate.recorded_at,
        upload_id: estimate.upload_id.clone(),
    }
}

/// The entry of the dominant group that is furthest from nominal.
fn dominant_fault(model: &FaultModel, group: usize, faults: &[FaultTrend]) -> String {
    let index = match model.groups[group] {
        FaultGroup::OneSided { index } => index,
        FaultGroup::Pair { indices: [a, b] } => {
            let deviation = |i: usize| (faults[i].value - model.nominal[i]).abs();
            if deviation(b) > deviation(a) { b } else { a }
        }
    };
    model.names[index].clone()
}

fn insufficient(observations: &[Observation]) -> InsufficientHistory {
    let missing = match observations {
        [] => "no upload so far could be diagnosed".to_owned(),
        [first, .., last] if observations.len() >= MIN_OBSERVATIONS => format!(
            "{} usable observations from {} to {} fh, none of them in a later {BLOCK_FH}-hour block than the others",
            observations.len(),
            first.t_fh,
            last.t_fh
        ),
        _ => format!(
            "{} of at least {MIN_OBSERVATIONS} usable observations, followed by one in a later {BLOCK_FH}-hour block",
            observations.len()
        ),
    };
    InsufficientHistory { missing }
}

fn check_finite(faults: &[FaultTrend], block: u64) -> Result<(), OutlookError> {
    for fault in faults {
        for (what, value) in [("value", fault.value), ("sigma", fault.sigma), ("trend", fault.trend_per_1000_fh)] {
            if !value.is_finite() {
                return Err(OutlookError::NotFinite { what, block, value });
            }
        }
    }
    Ok(())
}

fn first_block(states: &[State]) -> Option<u64> {
    states.first().map(|state| state.block)
}

fn json<T: serde::Serialize>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).expect("nouns serialise: no maps with non-text keys")
}
