//! Lives as they were recorded, in the units that their user counts in.
//!
//! Nothing but times, severities and ends: no bundle, no diagnosis. A severity is the share of the way from a unit's
//! nominal value to its limit: zero where nominal, one where life ends.

use domain::FaultVector;
use numerics::quantile;
use prognosis::{EndedLife, Ending, Flight, Observation, Scale, scale::reference_deviation};

use crate::{Recorded, backtest::Run};

/// Times so close to a multiple of the time between predictions, as a share of it or of themselves, are at it.
const AT_MULTIPLE: f64 = 1e-9;

/// Recorded lives of one fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Records {
    /// What times are counted in, such as `cycles`.
    pub time_unit: String,
    /// Names of the faults that have a limit.
    pub faults: Vec<String>,
    /// Standard deviation of one observation of each fault, as a severity, where it was told.
    pub sigma: Vec<Option<f64>>,
    /// The lives, in order of first appearance.
    pub lives: Vec<RecordedLife>,
}

/// One unit.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedLife {
    /// Its name.
    pub unit: String,
    /// Times of its observations since the start of its life, ascending, in [`Records::time_unit`]; none after the end.
    pub times: Vec<f64>,
    /// Severity of each fault at each time.
    pub severities: Vec<Vec<f64>>,
    /// What acts on wear at each time, load and temperature relative to their references; empty where neither is told.
    pub stress: Vec<[Option<f64>; 2]>,
    /// When it ended: the interpolated first passage of a limit, the last time else. `None` for one that goes on.
    pub end: Option<RecordedEnd>,
}

/// The end of a recorded life.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedEnd {
    /// When, in [`Records::time_unit`].
    pub time: f64,
    /// How.
    pub ending: Ending,
}

impl Records {
    /// The lives as estimators are fed with them: in reference hours and deviations, with the noise of one observation of each
    /// fault. Whatever is seen, or fails, at a multiple of the time between predictions is so to the last bit.
    pub fn runs(&self, scale: &Scale, sigma: &[f64], every: f64) -> Vec<Recorded> {
        let every_fh = scale.reference_fh(every);
        let reference_fh = |time: f64| {
            let multiple = (time / every).round();
            let is_there = (time - multiple * every).abs() <= AT_MULTIPLE * every.max(time);
            if is_there { multiple * every_fh } else { scale.reference_fh(time) }
        };
        let run = |life: &RecordedLife| {
            let failure = life.end.filter(|end| end.ending == Ending::Failed);
            let failure_fh = failure.map(|end| reference_fh(end.time));
            Recorded {
                run: Run { id: life.unit.clone(), observations: life.observations(sigma, reference_fh), failure_fh },
                regime: None,
                goes_on: life.end.is_none(),
                law: None,
                plan: Vec::new(),
            }
        };
        self.lives.iter().map(run).collect()
    }

    /// The lives that ended, as they teach: in reference hours and deviations, with the noise of one observation of each fault.
    pub fn ended(&self, scale: &Scale, sigma: &[f64]) -> Vec<EndedLife> {
        let ended = |life: &RecordedLife| {
            let RecordedEnd { time, ending } = life.end?;
            let observations = life.observations(sigma, |time| scale.reference_fh(time));
            let flights = observations.iter().map(Flight::of).collect();
            Some(EndedLife { flights, observations, end_fh: scale.reference_fh(time), ending })
        };
        self.lives.iter().filter_map(ended).collect()
    }

    /// The scale whose characteristic life is the median of the lives that failed; `None` where none did.
    pub fn scale(&self) -> Option<Scale> {
        let ends = self.lives.iter().filter_map(|life| life.end);
        let failures = ends.filter(|end| end.ending == Ending::Failed).map(|end| end.time);
        quantile::median(&quantile::sorted(failures.collect())).map(|characteristic_life| Scale { characteristic_life })
    }

    /// Failures among the lives.
    pub fn failures(&self) -> usize {
        self.lives.iter().filter(|life| life.end.is_some_and(|end| end.ending == Ending::Failed)).count()
    }
}

impl RecordedLife {
    fn observations(&self, sigma: &[f64], reference_fh: impl Fn(f64) -> f64) -> Vec<Observation> {
        let observation = |(index, (time, severities)): (usize, (&f64, &Vec<f64>))| Observation {
            t_fh: reference_fh(*time),
            fault_vector: FaultVector(severities.iter().map(|severity| reference_deviation(*severity)).collect()),
            sigma: sigma.to_vec(),
            load: self.stress.get(index).and_then(|[load, _]| *load),
            temperature: self.stress.get(index).and_then(|[_, temperature]| *temperature),
        };
        self.times.iter().zip(&self.severities).enumerate().map(observation).collect()
    }
}
