//! The time for which what was read of a caller is known.

use domain::Timestamp;

/// The time for which something that was read counts as known, microseconds.
const FRESH_US: i64 = 500_000;

/// Tells whether something that was read then is good now; a clock that was set back makes it stale.
pub fn is_fresh(read_at: Timestamp, now: Timestamp) -> bool {
    (0..FRESH_US).contains(&(now.micros() - read_at.micros()))
}
