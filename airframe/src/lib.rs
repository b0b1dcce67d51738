//! Physics of the wing: from the flight condition to the loads on its control surfaces.

pub mod fbg;
pub mod lifting_line;
pub mod wing;

pub use lifting_line::{Basis, LiftingLine, Loading};
pub use wing::{ControlSurface, Planform, Wing};
