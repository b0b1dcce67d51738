//! Limits of controller, drive and shaft.

/// `value` limited to plus and minus `bound`.
#[inline]
pub(crate) fn clip(value: f64, bound: f64) -> f64 {
    if value > bound {
        bound
    } else if value < -bound {
        -bound
    } else {
        value
    }
}
