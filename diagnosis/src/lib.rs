//! State Detection and Health Assessment: from samples of a back-EMF map to the fault vector, its
//! uncertainty, and whether the samples can be believed.
//!
//! Online: [`Diagnoser::diagnose`], plain loops in a fixed order with libm, the same bits anywhere.
//! Offline: [`train`] makes a [`Diagnoser`] from maps of known faults; [`validate`] measures one.
//!
//! ```
//! use diagnosis::{
//!     LoadInput, MapKind, TrainingMap, TrainingSet, TrainingSettings, ValidationSettings, train, validate,
//! };
//! use domain::{Coordinate, FaultModel, FaultVector, Mask};
//! use numerics::Stream;
//! use reduction::ModeCount;
//!
//! // Maps on which each fault has a shape of its own.
//! let map = |stream: &mut Stream| {
//!     let k: Vec<f64> = [0.0, 0.0, 0.0, 0.5, 0.5].iter().map(|nominal| nominal + 0.1 * stream.uniform()).collect();
//!     let shape = |bin: usize, fault: usize| (0.02 * (bin * (fault + 1)) as f64).cos();
//!     let y = (0..360).map(|bin| 1.0 - (0..5).map(|fault| k[fault] * shape(bin, fault)).sum::<f64>()).collect();
//!     TrainingMap { y, r: vec![0.2; 360], mean_r: 0.2, faults: FaultVector(k) }
//! };
//! let mut stream = Stream::new(1, &["front page"]);
//! let maps: Vec<_> = (0..100).map(|_| map(&mut stream)).collect();
//! let mask = Mask::new(Coordinate::ElectricalAngleRad, 360, (0..360).step_by(15).collect())?;
//! let set = TrainingSet { fault_model: &FaultModel::electrical(), mask: &mask, maps: &maps, calibration: &[] };
//! let recommended = TrainingSettings::new(MapKind::LoadInvariant);
//! let settings =
//!     TrainingSettings { modes: ModeCount::Fixed(5), restarts: 1, realisations: 2, steps: 20, ..recommended };
//! let diagnoser = train(&set, &settings, &stream)?;
//! let settings = ValidationSettings { load: LoadInput::PerSample, noise: 0.01, repeats: 1 };
//! assert!(validate(&diagnoser, &mask, &maps, &settings, &stream)?.median < 0.03);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
