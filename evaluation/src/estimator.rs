//! Estimators that only judge: baselines, the thesis's own, and the bound.

mod extrapolation;
mod linear;
mod oracle;
mod recent;
mod ridge;
mod thesis;

pub use linear::Linear;
pub use oracle::{Law, Oracle};
pub use ridge::Ridge;
pub use thesis::Thesis;
