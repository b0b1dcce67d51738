//! How the faults of a fleet grow: laws, each linear in a measure of damage of its own.
//!
//! - What: up to three measures of damage ([`Coordinate`]), each with the [`FleetPrior`] of a filter that follows growth in
//!   it, and the share of the fleet that goes by it.
//! - Update rule: a law's weight in a life is its share times the evidence of the life so far. Evidences are of the same
//!   observations: those in another measure are divided by how much it stretches them.
//! - Requirements: deviations in reference units with limits at [`REFERENCE_LIMIT`](crate::REFERENCE_LIMIT).
//! - Source: MacKay 1992 for evidence.

mod learn;
mod left_out;

use domain::FaultModel;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    block::{Observation, blocks},
    coordinate::Coordinate,
    ended::EndedLife,
    filter::Filter,
    particle::log_evidence,
    prior::FleetPrior,
};

pub use left_out::LawsWithout;

/// Growth in one measure of damage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrowthLaw {
    /// The measure.
    pub coordinate: Coordinate,
    /// What is known of growth in it.
    pub prior: FleetPrior,
    /// Share of the fleet that goes by it.
    pub share: f64,
}

/// The laws of a fleet, the most frequent first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrowthLaws {
    /// One to three.
    pub laws: Vec<GrowthLaw>,
}

impl GrowthLaw {
    /// Lives in this law's measure.
    pub(crate) fn measured(&self, lives: &[EndedLife]) -> Vec<Vec<Observation>> {
        measured(lives, &self.coordinate)
    }

    /// Log of the probability of each life's observations, up to a constant that is the same for all laws.
    fn log_evidence(&self, lives: &[EndedLife], model: &FaultModel) -> Vec<f64> {
        let of_life = |(life, measured): (&EndedLife, Vec<Observation>)| {
            let mut filter = Filter::new(model, &self.prior);
            blocks(&measured, &self.prior.clock).iter().for_each(|block| filter.update(block));
            let stretched = blocks(&life.observations, &self.prior.clock);
            log_evidence(&filter.particles) + stretched.iter().map(|block| self.log_stretch(&block.mean)).sum::<f64>()
        };
        lives.par_iter().zip(self.measured(lives)).map(of_life).collect()
    }

    /// Log of how much the measure stretches deviations there.
    pub(crate) fn log_stretch(&self, deviations: &[f64]) -> f64 {
        deviations.iter().map(|x| libm::log(self.coordinate.slope(*x))).sum()
    }
}

fn measured(lives: &[EndedLife], coordinate: &Coordinate) -> Vec<Vec<Observation>> {
    let of_life = |life: &EndedLife| life.observations.iter().map(|seen| coordinate.observation(seen)).collect();
    lives.iter().map(of_life).collect()
}
