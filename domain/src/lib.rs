//! The nouns of the service: parsed or rejected once, at the border; immutable afterwards.
//!
//! This crate never does I/O, never asks the time and holds no randomness of its own: clocks and
//! seeds are arguments everywhere.
//!
//! ```
//! use domain::{ContentHash, RulDistribution, rul::HORIZON_FH};
//!
//! // Draws of the remaining life, flight hours; one of the four outlives the horizon.
//! let rul = RulDistribution::from_draws(&[Some(100.0), Some(200.0), Some(300.0), None], HORIZON_FH);
//! assert_eq!(rul.quantile_fh(0.5), Some(250.0));
//! assert_eq!(rul.quantile_fh(0.95), None);
//!
//! // What is no hash is refused once, where it is parsed.
//! assert!("ba78".parse::<ContentHash>().is_err());
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod ahead;
mod as_of;
mod assumption;
pub mod audit;
pub mod block;
pub mod bundle_summary;
pub mod check;
pub mod component;
pub mod day;
pub mod ensemble;
mod estimate;
pub mod explanation;
pub mod fault;
mod fault_measure;
pub mod frame_key;
mod generation;
pub mod hash;
pub mod hinge_load;
pub mod ident;
mod installation;
pub mod invalid;
pub mod json;
pub mod load_agreement;
pub mod load_ratio;
pub mod maintenance;
pub mod mask;
mod own_diagnosis;
mod pace;
pub mod plan;
pub mod principal;
pub mod prognosis;
pub mod range;
mod reading;
pub mod redundancy;
pub mod rul;
mod schedule;
pub mod scoreboard;
pub mod sensor_configuration;
pub mod set_aside;
mod settings;
pub mod state;
pub mod text;
pub mod time;
pub mod token;
pub mod upload;
mod upload_state;
mod urgency;
mod warning;

pub use ahead::Ahead;
pub use as_of::AsOf;
pub use assumption::Assumption;
pub use audit::{Act, Action, Actor, AuditRecord};
pub use bundle_summary::BundleSummary;
pub use check::{Check, CheckDue, Checks, Flights, Period, PeriodEnd};
pub use component::{Component, Life};
pub use day::{Day, DayTime, Zone};
pub use ensemble::{Ensemble, PastCoverage};
pub use estimate::{Diagnosis, Estimate, MapFit, Outcome};
pub use explanation::{Doubt, DoubtKind, Explanation};
pub use fault::{FaultGroup, FaultModel, FaultVector};
pub use fault_measure::FaultMeasure;
pub use frame_key::{FrameKeyId, FrameSubject};
pub use generation::GenerationState;
pub use hash::ContentHash;
pub use hinge_load::{HingeLoad, LoadSource};
pub use ident::{CheckName, EventId, OperatorId, PartNumber, Position, SerialNumber, TailNumber, TokenName, UploadId};
pub use installation::InstallationSource;
pub use invalid::{Invalid, Violation};
pub use load_agreement::{Disagreement, DisagreementKind, LoadAgreement};
pub use load_ratio::LoadRatio;
pub use maintenance::{EventKind, Finding, MaintenanceEvent};
pub use mask::{Coordinate, Mask};
pub use own_diagnosis::{OwnDiagnosis, OwnFault};
pub use pace::Pace;
pub use plan::{Plan, PlannedStretch};
pub use principal::{Permission, Principal, Scope};
pub use prognosis::{FaultTrend, Prognosis, Propagation, Status};
pub use reading::{MapSamples, Reading};
pub use redundancy::Function;
pub use rul::{QUANTILE_LEVELS, RulDistribution};
pub use schedule::{Schedule, UtilisationSource};
pub use scoreboard::Scoreboard;
pub use sensor_configuration::SensorConfiguration;
pub use set_aside::{SetAside, SetAsideReason};
pub use settings::Settings;
pub use state::State;
pub use time::Timestamp;
pub use token::{Secret, SecretHash, Token, TokenId};
pub use upload::{AirData, Strain, Upload};
pub use upload_state::UploadStateKind;
pub use urgency::{Known, Urgency};
pub use warning::{Warning, WarningKind};

/// Raised only when the numbers served for the same input may change.
pub const NUMERICS_VERSION: u32 = 6;

/// The sentence that goes with every served number.
pub const ADVISORY: &str =
    "Advisory only: no maintenance credit. Airworthiness limitations and the maintenance programme take precedence.";
