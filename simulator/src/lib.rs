//! A simulated fleet: every actuator has a hidden wear, its motor physics makes the samples under the load of its flight, and
//! it uploads over REST as an aircraft would. Nothing of the hidden truth leaves but by the truth file.

mod avionics;
mod client;
mod crew;
mod fleet;
mod instrument;
mod linkage;
mod lives;
mod mission;
mod plan;
mod roster;
mod truth;
mod unit;
mod uplink;
mod wing;

pub use client::{Client, Sent};
pub use crew::Flown;
pub use fleet::Fleet;
pub use instrument::{OutputTorque, Physics};
pub use lives::{LifeFlight, Lives};
pub use mission::{Mission, Pace, Surroundings, UnknownMission};
pub use plan::{FH_PER_DAY, FleetPlan, Upkeep};
pub use truth::{Truth, write_truth};
pub use uplink::{Fetched, FrameKeys};

use domain::Invalid;
use reqwest::{StatusCode, Url};

/// Why the fleet cannot fly.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// Nobody answers.
    #[error("no service answers")]
    NotReachable {
        /// The service's address, which may hold secrets.
        url: Url,
        /// Why not.
        #[source]
        error: reqwest::Error,
    },
    /// The service is there, but takes nothing.
    #[error("the service takes nothing: it answers {0} again and again")]
    Overloaded(StatusCode),
    /// The service has no active bundle, so there is no mask to sample by.
    #[error("the service has no active model")]
    NoModel,
    /// The mask is a function of something that the simulated motor does not have.
    #[error("a mask over {0:?} cannot be sampled by a motor with an electrical angle")]
    UnknownCoordinate(String),
    /// The points of the mask are no bins.
    #[error("mask: {0}")]
    BadMask(Invalid),
    /// The mask belongs to a map of another length.
    #[error("mask {mask_id} does not belong to a map of {map_length} bins")]
    ForeignMask {
        /// The mask.
        mask_id: String,
        /// The length of the simulated motor's map.
        map_length: usize,
    },
    /// The service refuses an upload or an event.
    #[error("{name} was refused: {reason}")]
    Refused {
        /// The name of what was refused.
        name: String,
        /// The service's words.
        reason: String,
    },
    /// The service answers with something else than the contract says.
    #[error("unexpected answer: {0}")]
    BadAnswer(String),
    /// A number in the plan that makes no fleet.
    #[error("{field} must be {rule}, not {given}")]
    BadPlan {
        /// The field.
        field: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        given: String,
    },
    /// A simulation ended abnormally.
    #[error("a simulation ended abnormally: {0}")]
    Abnormal(#[from] tokio::task::JoinError),
}
