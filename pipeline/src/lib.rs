//! The model bundle, and the pure functions around it.
//!
//! Offline: [`train`] makes a [`Bundle`] from a motor's parameters and a seed. Online: a [`Model`] (a
//! bundle made ready) turns an upload into an estimate ([`Model::estimate`]) and the estimates of a life
//! into states and a prognosis ([`Model::course`], [`Model::outlook`]). Nothing here does I/O or asks the
//! time; the online functions give the same bits on any x86-64.
//!
//! ```
//! use pipeline::Model;
//!
//! // The bundle that ships inside the binary, made ready.
//! let model = Model::from_bytes(include_bytes!("../../models/default.json"))?;
//! let summary = model.summary();
//! assert_eq!(summary.faults.len(), 5);
//! assert!(summary.masks.iter().all(|mask| mask.len() >= summary.min_samples));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod agreement;
mod bundle;
mod chain;
mod checkpoint;
mod chronology;
mod course;
mod dataset;
mod draws;
mod estimate;
mod learning;
mod life_context;
mod loads;
mod metrics;
mod model;
mod outlook;
mod paced;
mod prior;
mod rehearsal;
mod sense;
mod shift;
mod training;
mod units;
mod walk;

pub use bundle::{Assessment, Bundle, BundleError, MapChain, Provenance};
pub use chain::{ChainSettings, Lf1Form, MaskRule};
pub use checkpoint::Checkpoint;
pub use chronology::recorded_in_the_past;
pub use course::Course;
pub use dataset::{Dataset, DatasetError, Labels};
pub use diagnosis::{MapKind, Measurement};
pub use estimate::EstimateError;
pub use learning::{OtherFaults, PastLife};
pub use life_context::LifeContext;
pub use loads::{LoadModel, LoadReferences, LoadTeller, known_load, motor_ratio};
pub use metrics::{DiagnosisMetrics, Metrics, SurrogateMetrics, Validation};
pub use model::Model;
pub use outlook::Outlook;
pub use prior::Prior;
pub use reduction::{ImportanceSampling, Prior as GappyPrior};
pub use rehearsal::RehearsalError;
pub use training::{Progress, TrainError, TrainSettings, motor_calibration, train};
pub use walk::OutlookError;
