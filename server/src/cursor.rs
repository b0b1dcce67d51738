//! Cursors as text: opaque to the caller, safe in a URL.

use domain::Timestamp;
use store::LifeCursor;

/// A place in the order of a life.
pub fn encode(cursor: &LifeCursor) -> String {
    format!("{}_{}_{}", cursor.flight_hours, cursor.recorded_at.micros(), cursor.upload_id)
}

/// The place that a text names, if it is a cursor.
pub fn decode(text: &str) -> Option<LifeCursor> {
    let mut parts = text.splitn(3, '_');
    let flight_hours: f64 = parts.next()?.parse().ok().filter(|hours: &f64| hours.is_finite())?;
    let recorded_at = Timestamp::from_micros(parts.next()?.parse().ok()?);
    let upload_id = parts.next()?.parse().ok()?;
    Some(LifeCursor { flight_hours, recorded_at, upload_id })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_comes_back_as_it_was() {
        let cursor = LifeCursor {
            flight_hours: 0.1 + 0.2,
            recorded_at: Timestamp::from_micros(1_700_000_000_123_456),
            upload_id: "a_b:c.d-e".parse().unwrap(),
        };
        assert_eq!(decode(&encode(&cursor)), Some(cursor));
        for bad in ["", "1", "1_2", "NaN_2_u", "1_2_ü", "inf_1_u"] {
            assert_eq!(decode(bad), None, "{bad}");
        }
    }
}
