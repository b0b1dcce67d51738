//! Estimators that only judge: baselines, mixed-effects models, the thesis's own, and the bound.

mod extrapolation;
mod linear;
mod mixed;
mod oracle;
mod recent;
mod ridge;
mod thesis;

pub use linear::Linear;
pub use mixed::{MixedBrownian, MixedEffects};
pub use oracle::{Law, Oracle};
pub use ridge::Ridge;
pub use thesis::Thesis;
