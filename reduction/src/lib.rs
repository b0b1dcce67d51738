//! Data Manipulation: from maps and their samples to a handful of coefficients.
//!
//! Importance sampling of fault vectors, the load-invariant map, the POD basis, masks and Gappy POD.
//!
//! Online code ([`gappy`], [`load_invariant`]) uses plain loops in a fixed order, so
//! its results are the same bits on any machine. Training a [`PodBasis`] is offline and uses faer.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod error;
pub mod gappy;
pub mod load_invariant;
pub mod mask_design;
pub mod pod;
pub mod sampling;
pub mod som;

pub use error::ReductionError;
pub use gappy::{GappyFit, GappyPod, Prior, Sample};
pub use mask_design::{MaskDesign, condition_number};
pub use pod::{ModeCount, PodBasis};
pub use sampling::ImportanceSampling;
pub use som::SelfOrganisingMap;
