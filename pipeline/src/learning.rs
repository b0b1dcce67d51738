//! What the lives of an operator teach that are over: a prior.

use domain::{Estimate, UploadId};
use prognosis::{
    EndedLife, Ending, Flight, LifePrior, LoadPair, MotorCalibration, block::Observation, learn_from_ended,
};

use crate::{Model, Prior, loads::motor_ratio};

/// Seed of everything random in learning.
const SEED: u64 = 1;

/// A life that is over, as the service has followed it.
#[derive(Debug, Clone, PartialEq)]
pub struct PastLife {
    /// Estimates that count in it, in its order.
    pub estimates: Vec<Estimate>,
    /// The component's hours since new at which it began.
    pub began_fh: f64,
    /// The hours since new at which it was found failed; `None` of one whose component was removed serviceable or
    /// overhauled in time, of which the last estimate tells how far it went.
    pub failure_fh: Option<f64>,
}

/// A life that is to teach holds an estimate that is not of the bundle's faults.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the estimate of {upload_id} tells {found} faults, the bundle knows {expected}")]
pub struct OtherFaults {
    /// The upload.
    pub upload_id: UploadId,
    /// How many faults its estimate tells.
    pub found: usize,
    /// How many the bundle knows.
    pub expected: usize,
}

impl Model {
    /// What lives that are over teach, starting from the bundle's own prior, which stays where nothing was seen of
    /// them. Offline: seconds to minutes on all cores. Refuses estimates that are not of the bundle's faults.
    pub fn learn_prior(&self, lives: &[PastLife]) -> Result<Prior, OtherFaults> {
        lives.iter().flat_map(|life| &life.estimates).try_for_each(|estimate| self.knows_faults_of(estimate))?;
        let reference_fh = |flight_hours: f64| self.units.reference_fh(flight_hours);
        let since_beginning = |life: &PastLife, observation: Observation| Observation {
            t_fh: observation.t_fh - reference_fh(life.began_fh),
            ..observation
        };
        let calibrated = MotorCalibration::fit(&lives.iter().map(load_pairs).collect::<Vec<_>>());
        let motor = calibrated.as_ref().or_else(|| self.motor(&self.prior.body));
        let ended = |life: &PastLife| {
            let seen =
                life.estimates.iter().filter_map(|one| self.observation(one)).map(|one| since_beginning(life, one));
            let observations: Vec<Observation> = seen.collect();
            let (end_fh, ending) = match life.failure_fh {
                Some(failure_fh) => (reference_fh(failure_fh) - reference_fh(life.began_fh), Ending::Failed),
                None => (observations.last()?.t_fh, Ending::Removed),
            };
            let flown = |flight: Flight| Flight { t_fh: flight.t_fh - reference_fh(life.began_fh), ..flight };
            let flights = self.flights(life.estimates.iter(), motor).into_iter().map(flown).collect();
            Some(EndedLife { observations, flights, end_fh, ending })
        };
        let lives: Vec<EndedLife> = lives.iter().filter_map(ended).collect();
        let Self { followed, prior, .. } = self;
        let learned = learn_from_ended(&prior.body, &lives, followed, self.boundary(), SEED);
        Ok(learned.map_or_else(
            |_| Prior::clone(prior),
            |body| Prior::new(LifePrior { motor: calibrated.or(body.motor.clone()), ..body }),
        ))
    }

    fn knows_faults_of(&self, estimate: &Estimate) -> Result<(), OtherFaults> {
        let Some(diagnosis) = estimate.usable() else { return Ok(()) };
        let (found, expected) = (diagnosis.fault_vector.values().len(), self.bundle.faults.nominal.len());
        if [found, diagnosis.sigma.len()] == [expected; 2] {
            return Ok(());
        }
        Err(OtherFaults { upload_id: estimate.upload_id.clone(), found, expected })
    }
}

/// What wing and motor tell of the flights of a life.
fn load_pairs(life: &PastLife) -> Vec<LoadPair> {
    let pair =
        |estimate: &Estimate| Some(LoadPair { load: estimate.load.as_ref()?.ratio, ratio: motor_ratio(estimate)? });
    life.estimates.iter().filter(|estimate| !estimate.on_ground).filter_map(pair).collect()
}
