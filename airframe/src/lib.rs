//! Physics of the wing and of an elevator: from the flight condition to the loads on control surfaces.
//!
//! ```
//! use airframe::fbg;
//!
//! // A grating on aluminium sees strain and temperature; a free one beside it tells them apart.
//! let bonded_nm = fbg::wavelength_nm(1550.0, 300e-6, 10.0);
//! let free_nm = fbg::free_wavelength_nm(1560.0, 10.0);
//! let rise_k = fbg::temperature_rise_k(1560.0, free_nm);
//! assert!((rise_k - 10.0).abs() < 1e-6);
//! assert!((fbg::strain(1550.0, bonded_nm, rise_k) - 300e-6).abs() < 1e-12);
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod beam;
pub mod elevator;
pub mod fbg;
pub mod flight;
pub mod glue;
pub mod hinge;
pub mod lifting_line;
pub mod load_estimator;
pub mod load_parameters;
pub mod map_fit;
pub mod products;
pub mod reference;
pub mod section;
pub mod strain;
pub mod wing;

pub use beam::{Beam, SectionLoads};
pub use elevator::Doublet;
pub use flight::{Flight, FlightSettings, HingeTarget};
pub use hinge::{HingeModel, hinge_rows};
pub use lifting_line::{Basis, LiftingLine, Loading};
pub use load_estimator::{EstimatorSettings, FlightEnvelope, HingeMoment, LoadEstimate, LoadEstimator, LoadReading};
pub use load_parameters::LoadParameters;
pub use map_fit::{MapCase, MapFitError, fit_map};
pub use products::{Products, felt_by, flight_products};
pub use reference::{reference_beam, reference_configuration};
pub use section::{Section, SectionGeometry};
pub use strain::{Layout, strain_map, strains};
pub use wing::{Camber, ControlSurface, Planform, Wing};
