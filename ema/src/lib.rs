//! Physics of the electromechanical actuator: models, faults, back-EMF map, assessment, wear.
//!
//! Nothing here does I/O, asks the time or holds randomness of its own. Transcendental functions come
//! from `libm`, so that a simulation gives the same bits on any x86-64.
//!
//! ```
//! use domain::FaultVector;
//! use ema::{assessment::assess, lf2::Parameters};
//!
//! // A new actuator passes the assessment; one whose first phase is shorted to nine tenths does not.
//! let margin = |k: [f64; 5]| {
//!     assess(&Parameters::assessment(), &FaultVector(k.into())).expect("five faults in [0, 1]").min_margin()
//! };
//! assert!(margin([0.0, 0.0, 0.0, 0.5, 0.5]) > 0.0);
//! assert!(margin([0.9, 0.0, 0.0, 0.5, 0.5]) < 0.0);
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod assessment;
pub mod back_emf;
mod clip;
pub mod closed_form;
pub mod commutation;
pub mod controller;
mod drive;
pub mod failure_watch;
pub mod faults;
pub mod high_fidelity;
pub mod lf1;
pub mod lf2;
pub mod life;
pub mod manoeuvre;
pub mod mechanical_faults;
pub mod motor;
pub mod observer;
pub mod response;
pub mod scenario;
pub mod shaft;
pub mod simulation;
pub mod transmission;
pub mod wear;
pub mod wear_law;
