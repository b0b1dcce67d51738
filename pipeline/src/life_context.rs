//! What the results of a life rest on beside its estimates.

use domain::Life;

use crate::Prior;

/// The life that estimates belong to, and what they are judged by.
#[derive(Debug, Clone, Copy)]
pub struct LifeContext<'a> {
    /// The life.
    pub life: &'a Life,
    /// Number of its generation.
    pub generation: u32,
    /// The prior that the life is pinned to.
    pub prior: &'a Prior,
    /// The component's hours since new at which the life began, as good as new: 0, or those of an overhaul.
    pub began_fh: f64,
}
