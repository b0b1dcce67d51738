//! Lives that are over, as material to judge forecasts by and to learn from.

use domain::{Estimate, Life, Prognosis};

/// A finished life with what was forecast of it at the time.
#[derive(Debug, Clone, PartialEq)]
pub struct IssuedLife {
    /// The life.
    pub life: Life,
    /// The component's hours since new at which it was found failed.
    pub failure_fh: f64,
    /// The first prognosis with a forecast that was issued in each stretch of hours, in the order of hours.
    pub prognoses: Vec<Prognosis>,
}

/// A finished life with its history.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedLife {
    /// The life.
    pub life: Life,
    /// The component's hours since new at which the life began.
    pub began_fh: f64,
    /// The component's hours since new at which it was found failed.
    pub failure_fh: f64,
    /// The estimates that count up to the failure, in the order of the life; there may be none.
    pub estimates: Vec<Estimate>,
}

/// A life that was over before it failed, with its history: its component was overhauled in time, or taken out and not
/// put back.
#[derive(Debug, Clone, PartialEq)]
pub struct RemovedLife {
    /// The life.
    pub life: Life,
    /// The component's hours since new at which the life began.
    pub began_fh: f64,
    /// The estimates that count, in the order of the life; there may be none.
    pub estimates: Vec<Estimate>,
}
