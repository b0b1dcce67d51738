//! The fleet prior that judges a life: the bundle's own, or one that an operator's finished lives taught.

use std::sync::Arc;

use domain::{ContentHash, Estimate};
use prognosis::{FinishedLife, FleetPrior, NoHistory, block::Observation, learn_from_finished};

use crate::{Model, course::observation};

/// Seed of everything random in learning.
const SEED: u64 = 1;

/// A fleet prior under its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// SHA-256 of its canonical JSON.
    pub hash: ContentHash,
    /// What it says.
    pub body: FleetPrior,
}

/// A life that ended in failure, as the service has followed it.
#[derive(Debug, Clone, PartialEq)]
pub struct PastLife {
    /// Estimates that count in it, in its order.
    pub estimates: Vec<Estimate>,
    /// The component's hours since new at which it began.
    pub began_fh: f64,
    /// When it was found failed, hours since new.
    pub failure_fh: f64,
}

impl Prior {
    /// Under the name that its content gives it.
    pub fn new(body: FleetPrior) -> Self {
        Self { hash: ContentHash::of_json(&body), body }
    }

    /// Reads canonical JSON.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, serde_json::Error> {
        serde_json::from_slice(bytes).map(Self::new)
    }

    /// Canonical JSON.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(&self.body).expect("priors serialise: no maps with non-text keys")
    }
}

impl Model {
    /// The bundle's own prior.
    pub fn prior(&self) -> &Arc<Prior> {
        &self.prior
    }

    /// What finished lives teach, starting from the bundle's own prior. Offline: seconds to minutes on all cores.
    pub fn learn_prior(&self, lives: &[PastLife]) -> Result<Prior, NoHistory> {
        let since_beginning = |life: &PastLife, observation: Observation| Observation {
            t_fh: observation.t_fh - life.began_fh,
            ..observation
        };
        let finished = |life: &PastLife| FinishedLife {
            observations: life.estimates.iter().filter_map(observation).map(|one| since_beginning(life, one)).collect(),
            failure_fh: life.failure_fh - life.began_fh,
        };
        let lives: Vec<FinishedLife> = lives.iter().map(finished).collect();
        let Self { bundle, prior, .. } = self;
        learn_from_finished(&prior.body, &lives, &bundle.faults, &bundle.surrogate, SEED).map(Prior::new)
    }
}
