//! State Detection and Health Assessment: from samples of a back-EMF map to the fault vector, its
//! uncertainty, and whether the samples can be believed.
//!
//! Online: [`Diagnoser::diagnose`], plain loops in a fixed order with libm, the same bits anywhere.
//! Offline: [`train`] makes a [`Diagnoser`] from maps of known faults; [`validate`] measures one.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod diagnoser;
pub mod error_law;
pub mod levenberg_marquardt;
pub mod load_variation;
pub mod map_reader;
pub mod mlp;
mod mlp_fit;
mod simulated_upload;
pub mod training;
pub mod training_map;
pub mod validation;

pub use diagnoser::Diagnoser;
pub use error_law::ErrorLaw;
pub use load_variation::LoadVariation;
pub use map_reader::{MapKind, MapReader, Measurement, Reading};
pub use mlp::Mlp;
pub use simulated_upload::LoadInput;
pub use training::{TrainingError, TrainingSet, TrainingSettings, train};
pub use training_map::TrainingMap;
pub use validation::{Validation, ValidationSettings, validate};
