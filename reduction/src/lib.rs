//! Data Manipulation: from maps and their samples to a handful of coefficients.
//!
//! Importance sampling of fault vectors, the load-invariant map, the POD basis, masks and Gappy POD.
//!
//! Online code ([`gappy`], [`load_invariant`]) uses plain loops in a fixed order, so
//! its results are the same bits on any machine. Training a [`PodBasis`] is offline and uses faer.
//!
//! ```
//! use domain::{Coordinate, Mask};
//! use reduction::{GappyPod, ModeCount, PodBasis, Prior, Sample};
//!
//! // Maps of 36 values that differ in two shapes; six samples tell a whole map.
//! let at = |bin: usize| (bin as f64 + 0.5) * std::f64::consts::TAU / 36.0;
//! let map = |a: f64, b: f64| (0..36).map(|bin| 1.0 + a * at(bin).cos() + b * at(bin).sin()).collect::<Vec<_>>();
//! let maps: Vec<_> = (0..50).map(|i| map(0.1 * f64::from(i % 7 - 3), 0.05 * f64::from(i % 5 - 2))).collect();
//! let basis = PodBasis::train(&maps, ModeCount::Fixed(2))?;
//! let mask = Mask::new(Coordinate::ElectricalAngleRad, 36, vec![1, 5, 12, 20, 29, 33])?;
//! let truth = map(0.12, -0.07);
//! let samples: Vec<_> = mask.bins().iter().map(|&bin| Some(Sample { value: truth[bin], sd: 1e-6 })).collect();
//! let fit = GappyPod::new(&basis, &mask)?.fit(&samples, Prior::Pod);
//! let found = basis.reconstruct(&fit.coefficients);
//! assert!(found.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-6));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
