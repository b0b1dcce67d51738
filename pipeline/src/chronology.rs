//! State Detection: uploads whose hours and times contradict the rest of their life.
//!
//! What: sets aside an upload that implies more than 24 flight hours a day against both of its
//! neighbours in time; the first and the last upload are judged against the two nearest. One
//! contradicted neighbour is not enough: the other upload may be the wrong one.
//! Requires: three uploads; of two that contradict each other nobody can tell which is wrong.
//! Pure in the set of the life's estimates, so an upload comes back when later ones vindicate it.
//!
//! Also sets aside an upload that was received more than a day before it was recorded.

use domain::{Estimate, SetAside, SetAsideReason, Timestamp, Upload};

/// Flight hours are booked in tenths: two rounded figures may differ by so much more than the truth.
const BOOKING_RESOLUTION_FH: f64 = 0.1;

/// Clocks of aircraft may be ahead of ours by so much, hours.
const CLOCK_TOLERANCE_H: f64 = 24.0;

/// Refuses an upload that claims to come from the future of the moment when it was received.
pub fn recorded_in_the_past(upload: &Upload, received_at: Timestamp) -> Result<(), SetAside> {
    let ahead_h = upload.recorded_at.hours_since(received_at);
    if ahead_h <= CLOCK_TOLERANCE_H {
        return Ok(());
    }
    let detail = format!(
        "recorded at {}, {ahead_h:.1} hours after it was received at {received_at}; a clock may be {CLOCK_TOLERANCE_H} hours ahead",
        upload.recorded_at
    );
    Err(SetAside { upload_id: upload.upload_id.clone(), reason: SetAsideReason::ImplausibleHours, detail })
}

/// The uploads of a life that contradict both neighbours, in the order of time.
pub fn implausible_hours(estimates: &[Estimate]) -> Vec<SetAside> {
    let mut in_time: Vec<&Estimate> = estimates.iter().collect();
    in_time.sort_by(|a, b| a.recorded_at.cmp(&b.recorded_at).then_with(|| a.life_order(b)));
    let last = in_time.len().saturating_sub(1);
    if last < 2 {
        return Vec::new();
    }
    let neighbours = |i: usize| match i {
        0 => [1, 2],
        i if i == last => [last - 2, last - 1],
        i => [i - 1, i + 1],
    };
    (0..=last)
        .map(|i| (in_time[i], neighbours(i).map(|j| in_time[j])))
        .filter(|(estimate, neighbours)| neighbours.iter().all(|other| contradict(estimate, other)))
        .map(|(estimate, neighbours)| set_aside(estimate, neighbours))
        .collect()
}

/// Whether more flight hours than hours of time lie between two uploads of a life.
fn contradict(one: &Estimate, other: &Estimate) -> bool {
    let flown_fh = (one.flight_hours - other.flight_hours).abs();
    flown_fh > one.recorded_at.hours_since(other.recorded_at).abs() + BOOKING_RESOLUTION_FH
}

fn set_aside(estimate: &Estimate, neighbours: [&Estimate; 2]) -> SetAside {
    let against = neighbours.map(|other| format!("{} fh at {}", other.flight_hours, other.recorded_at));
    let detail = format!(
        "{} fh at {} is more than 24 flight hours a day against {} and against {}",
        estimate.flight_hours, estimate.recorded_at, against[0], against[1]
    );
    SetAside { upload_id: estimate.upload_id.clone(), reason: SetAsideReason::ImplausibleHours, detail }
}

#[cfg(test)]
mod tests {
    use domain::{ContentHash, NUMERICS_VERSION, Outcome, Timestamp};
    use proptest::prelude::*;

    use super::*;

    fn estimate(id: usize, flight_hours: f64, calendar_h: f64) -> Estimate {
        Estimate {
            upload_id: format!("u{id:03}").parse().unwrap(),
            flight_hours,
            recorded_at: "2026-01-01T00:00:00Z".parse::<Timestamp>().unwrap().plus_hours(calendar_h),
            mask_id: ContentHash::of(b"mask"),
            model: ContentHash::of(b"model"),
            numerics_version: NUMERICS_VERSION,
            outcome: Outcome::Undiagnosable { valid_samples: 0, needed: 11 },
            load: None,
            temperature: None,
        }
    }

    /// A life with eight flight hours a day.
    fn life(count: usize) -> Vec<Estimate> {
        (0..count).map(|i| estimate(i, 4.0 * i as f64, 12.0 * i as f64)).collect()
    }

    fn refused(estimates: &[Estimate]) -> Vec<String> {
        implausible_hours(estimates).into_iter().map(|set_aside| set_aside.upload_id.to_string()).collect()
    }

    #[test]
    fn of_two_that_contradict_each_other_nobody_is_blamed() {
        assert!(refused(&[estimate(0, 0.0, 0.0), estimate(1, 100.0, 1.0)]).is_empty());
    }

    #[test]
    fn hours_booked_in_tenths_are_believed() {
        let rounded = |i: usize| estimate(i, (i as f64 * 0.99).round() / 10.0, i as f64 * 0.099);
        assert!(refused(&(0..20).map(rounded).collect::<Vec<_>>()).is_empty());
    }

    proptest! {
        #[test]
        fn only_the_stranger_is_set_aside(count in 4_usize..40, place in 0.0..1.0_f64, jump in 500.0..1e5_f64) {
            let stranger = (place * count as f64) as usize;
            let mut estimates = life(count);
            estimates[stranger].flight_hours += jump;
            prop_assert_eq!(refused(&estimates), vec![format!("u{stranger:03}")]);
        }

        #[test]
        fn a_time_out_of_place_is_as_implausible_as_hours(from in 0_usize..20, to in 22_usize..40) {
            let mut estimates = life(42);
            // Between two of another month, hours of whose flights it cannot have.
            estimates[from].recorded_at = estimates[to].recorded_at.plus_hours(1.0);
            prop_assume!(4.0 * (to - from) as f64 > 12.0);
            prop_assert_eq!(refused(&estimates), vec![format!("u{from:03}")]);
        }
    }
}
