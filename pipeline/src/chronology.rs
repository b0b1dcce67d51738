//! State Detection: uploads whose hours and times contradict the rest of their life.
//!
//! - What: along a life, time passes at least as fast as flight hours, and neither runs backwards: of two uploads
//!   the one of more hours is the later one, by an hour of time for each flight hour or more. The uploads that
//!   agree are the longest chain of which this holds from one to the next; of equally long ones the one that was
//!   complete first, so that an established history stands against as many newcomers. An upload outside the
//!   chain is set aside when it contradicts both of its neighbours in time there; the first and the last are judged
//!   against the two nearest. One contradicted neighbour is not enough: the other may be the wrong one.
//! - Update rule: an upload continues the longest chain that ends at no more hours on the ground (time minus
//!   flight hours) than its own; a prefix maximum in a Fenwick tree finds it. O(n log n).
//! - Requires: three uploads, two of which agree; otherwise nobody can tell which are wrong, and of three or more
//!   none counts.
//! - Source: Fredman 1975 for longest increasing subsequences; Fenwick 1994.
//!
//! Pure in the set of the life's estimates, so an upload comes back when later ones vindicate it.
//!
//! Also sets aside an upload that was received more than a day before it was recorded.

use domain::{Estimate, SetAside, SetAsideReason, Timestamp, Upload};

/// Flight hours are booked in tenths: two rounded figures may differ by so much more than the truth.
const BOOKING_RESOLUTION_FH: f64 = 0.1;
/// Clocks of aircraft may be ahead of ours by so much, hours.
const CLOCK_TOLERANCE_H: f64 = 24.0;
/// The period of the week number of GPS: a recorder that does not know the present one is so much behind, hours.
const GPS_ROLLOVER_H: f64 = 1024.0 * 7.0 * 24.0;
/// Fewest uploads of which some can be wrong.
const MIN_UPLOADS: usize = 3;

/// Refuses an upload that claims to come from the future of the moment when it was received, or last tried again.
pub fn recorded_in_the_past(upload: &Upload, received_at: Timestamp) -> Result<(), SetAside> {
    let ahead_h = upload.recorded_at.hours_since(received_at);
    if ahead_h <= CLOCK_TOLERANCE_H {
        return Ok(());
    }
    let detail = format!(
        "recorded at {}, {ahead_h:.1} hours after it was received at {received_at}; a clock may be {CLOCK_TOLERANCE_H} \
         hours ahead. If it was the clock of the service that was wrong, retry the upload",
        upload.recorded_at
    );
    Err(SetAside { upload_id: upload.upload_id.clone(), reason: SetAsideReason::ImplausibleHours, detail })
}

/// The uploads of a life, given in its order, whose hours and times contradict the others, in the order of time.
pub fn implausible_hours(estimates: &[&Estimate]) -> Vec<SetAside> {
    let agree = |pair: &[&Estimate]| contradiction(pair[0], pair[1]).is_none();
    if estimates.len() < MIN_UPLOADS || estimates.windows(2).all(agree) {
        return Vec::new();
    }
    let mut agreeing = longest_chain(estimates);
    agreeing.sort_by(|a, b| in_time(a, b));
    let mut all = estimates.to_vec();
    all.sort_by(|a, b| in_time(a, b));
    match agreeing.len() {
        1 => all.into_iter().map(alone).collect(),
        _ => all.into_iter().filter_map(|estimate| judge(estimate, &agreeing)).collect(),
    }
}

fn in_time(one: &Estimate, other: &Estimate) -> std::cmp::Ordering {
    one.recorded_at.cmp(&other.recorded_at).then_with(|| one.life_order(other))
}

/// How two uploads of a life contradict each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Contradiction {
    /// More flight hours lie between them than hours of time.
    TooFast,
    /// The one of more hours is the earlier one.
    Backwards,
}

fn contradiction(one: &Estimate, other: &Estimate) -> Option<Contradiction> {
    let (fewer, more) = if one.life_order(other).is_le() { (one, other) } else { (other, one) };
    let passed_h = more.recorded_at.hours_since(fewer.recorded_at);
    let flown_fh = more.flight_hours - fewer.flight_hours;
    let kind = if passed_h < 0.0 { Contradiction::Backwards } else { Contradiction::TooFast };
    (flown_fh > passed_h + BOOKING_RESOLUTION_FH).then_some(kind)
}

/// The most estimates, in the order of the life, each of which agrees with the next; of equally many those
/// that were complete first.
fn longest_chain<'a>(estimates: &[&'a Estimate]) -> Vec<&'a Estimate> {
    let epoch = Timestamp::from_micros(0);
    let ground_h = |estimate: &Estimate| estimate.recorded_at.hours_since(epoch) - estimate.flight_hours;
    let mut grounds: Vec<f64> = estimates.iter().map(|estimate| ground_h(estimate)).collect();
    grounds.sort_unstable_by(f64::total_cmp);
    let mut ends = Chains { best: vec![None; grounds.len() + 1] };
    let mut before: Vec<Option<usize>> = Vec::with_capacity(estimates.len());
    let mut longest: Option<Chain> = None;
    for (index, estimate) in estimates.iter().enumerate() {
        let ground_h = ground_h(estimate);
        let up_to = grounds.partition_point(|other| *other <= ground_h + BOOKING_RESOLUTION_FH);
        let continued = ends.best_of(up_to);
        let end = Chain { length: continued.map_or(1, |end| end.length + 1), at: estimate.recorded_at, index };
        before.push(continued.map(|end| end.index));
        ends.add(grounds.partition_point(|other| *other < ground_h), end);
        longest = better(longest, Some(end));
    }
    let chain = std::iter::successors(longest.map(|end| end.index), |&index| before[index]);
    let mut chain: Vec<&Estimate> = chain.map(|index| estimates[index]).collect();
    chain.reverse();
    chain
}

/// The end of a chain.
#[derive(Debug, Clone, Copy)]
struct Chain {
    length: usize,
    at: Timestamp,
    index: usize,
}

/// The longer one; of equally long ones the one that ends first.
fn better(one: Option<Chain>, other: Option<Chain>) -> Option<Chain> {
    let rank = |end: &Chain| (end.length, std::cmp::Reverse((end.at, end.index)));
    one.into_iter().chain(other).max_by_key(rank)
}

/// Prefix maxima of ends by the rank of their hours on the ground (a Fenwick tree).
struct Chains {
    best: Vec<Option<Chain>>,
}

impl Chains {
    /// The best of those of the first `ranks` ranks.
    fn best_of(&self, ranks: usize) -> Option<Chain> {
        let nodes = std::iter::successors(Some(ranks), |node| (*node > 0).then(|| node & (node - 1)));
        nodes.fold(None, |best, node| better(best, self.best[node]))
    }

    fn add(&mut self, rank: usize, end: Chain) {
        let mut node = rank + 1;
        while node < self.best.len() {
            self.best[node] = better(self.best[node], Some(end));
            node += node & node.wrapping_neg();
        }
    }
}

/// Why an upload is set aside that contradicts both of its neighbours among those that agree.
fn judge(estimate: &Estimate, agreeing: &[&Estimate]) -> Option<SetAside> {
    let place = agreeing.partition_point(|other| in_time(other, estimate).is_lt());
    if agreeing.get(place).is_some_and(|other| other.upload_id == estimate.upload_id) {
        return None;
    }
    let neighbours = neighbours(place, agreeing);
    let contradictions = neighbours.map(|other| contradiction(estimate, other));
    let [Some(first), Some(second)] = contradictions else { return None };
    let reason = match (first, second) {
        (Contradiction::Backwards, Contradiction::Backwards) => SetAsideReason::HoursBackwards,
        _ => SetAsideReason::ImplausibleHours,
    };
    let against = [against(estimate, neighbours[0], first), against(estimate, neighbours[1], second)];
    let detail = format!(
        "{} fh at {} contradict the uploads of this life that agree with one another: {} and {}. {}",
        estimate.flight_hours,
        estimate.recorded_at,
        against[0],
        against[1],
        advice(estimate, agreeing)
    );
    Some(SetAside { upload_id: estimate.upload_id.clone(), reason, detail })
}

/// The two nearest of at least two, in time, to something before the one at `place`.
fn neighbours<'a>(place: usize, agreeing: &[&'a Estimate]) -> [&'a Estimate; 2] {
    let first = place.saturating_sub(1).min(agreeing.len() - 2);
    [agreeing[first], agreeing[first + 1]]
}

fn against(estimate: &Estimate, other: &Estimate, contradiction: Contradiction) -> String {
    let known = format!("{} fh at {}", other.flight_hours, other.recorded_at);
    match contradiction {
        Contradiction::TooFast => format!("more than 24 flight hours a day from {known}"),
        Contradiction::Backwards if other.recorded_at < estimate.recorded_at => format!("backwards from {known}"),
        Contradiction::Backwards => format!("backwards to {known}"),
    }
}

/// What would make an upload good that is set aside.
fn advice(estimate: &Estimate, agreeing: &[&Estimate]) -> String {
    let later = Estimate { recorded_at: estimate.recorded_at.plus_hours(GPS_ROLLOVER_H), ..estimate.clone() };
    let place = agreeing.partition_point(|other| in_time(other, &later).is_lt());
    if neighbours(place, agreeing).iter().all(|other| contradiction(&later, other).is_none()) {
        return format!("1024 weeks later, at {}, it would agree: correct the recorder's GPS week", later.recorded_at);
    }
    "Send it again with the hours since new and the right time; it counts by itself once more uploads agree with it"
        .to_owned()
}

fn alone(estimate: &Estimate) -> SetAside {
    let detail = format!(
        "{} fh at {} contradict all others, and no two uploads of this life agree: more than 24 flight hours a day or \
         hours that run backwards lie between any two. Are they hours since new?",
        estimate.flight_hours, estimate.recorded_at
    );
    SetAside { upload_id: estimate.upload_id.clone(), reason: SetAsideReason::ImplausibleHours, detail }
}

#[cfg(test)]
mod tests {
    use domain::SetAsideReason::{HoursBackwards, ImplausibleHours};
    use domain::{ContentHash, NUMERICS_VERSION, Outcome, Timestamp};
    use proptest::prelude::*;

    use super::*;

    fn estimate(id: usize, flight_hours: f64, calendar_h: f64) -> Estimate {
        Estimate {
            upload_id: format!("u{id:03}").parse().unwrap(),
            flight_hours,
            recorded_at: "2026-01-01T00:00:00Z".parse::<Timestamp>().unwrap().plus_hours(calendar_h),
            mask_id: Some(ContentHash::of(b"mask")),
            model: ContentHash::of(b"model"),
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome: Outcome::Undiagnosable { valid_samples: 0, needed: 11 },
            load: None,
            temperature: None,
            load_ratio: None,
            on_ground: false,
        }
    }

    /// A life with eight flight hours a day.
    fn life(count: usize) -> Vec<Estimate> {
        (0..count).map(|i| estimate(i, 4.0 * i as f64, 12.0 * i as f64)).collect()
    }

    fn refused(estimates: &[Estimate]) -> Vec<String> {
        judged(estimates).into_iter().map(|set_aside| set_aside.upload_id.to_string()).collect()
    }

    fn judged(estimates: &[Estimate]) -> Vec<SetAside> {
        let mut in_order: Vec<&Estimate> = estimates.iter().collect();
        in_order.sort_by(|a, b| a.life_order(b));
        implausible_hours(&in_order)
    }

    /// A life from 3,000 hours on, and another one of so many uploads that begins at zero some days behind its end.
    fn restarted(count: usize, new: usize) -> Vec<Estimate> {
        let old = |i: usize| estimate(i, 3000.0 + 4.0 * i as f64, 12.0 * i as f64);
        let restart = |i: usize| estimate(count + i, 4.0 * i as f64, 12.0 * (count + i) as f64 + 48.0);
        (0..count).map(old).chain((0..new).map(restart)).collect()
    }

    #[test]
    fn a_counter_that_restarts_contradicts_the_established_history() {
        for (count, new) in [(300, 100), (30, 1), (30, 30)] {
            let aside = judged(&restarted(count, new));
            let ids: Vec<_> = aside.iter().map(|one| one.upload_id.to_string()).collect();
            assert_eq!(ids, (count..count + new).map(|i| format!("u{i:03}")).collect::<Vec<_>>());
            assert!(aside.iter().all(|one| one.reason == HoursBackwards), "{:?}", aside[0]);
        }
    }

    #[test]
    fn the_longer_history_is_believed() {
        let hours_since_overhaul: Vec<_> = (0..10).map(|i| format!("u{i:03}")).collect();
        assert_eq!(refused(&restarted(10, 11)), hours_since_overhaul);
    }

    #[test]
    fn a_zero_after_a_pause_runs_backwards() {
        let mut estimates = life(4);
        estimates.push(estimate(4, 0.0, 5000.0));
        let aside = judged(&estimates);
        assert_eq!((aside.len(), aside[0].reason), (1, HoursBackwards));
        assert!(aside[0].detail.contains("backwards from 12 fh at 2026-01-02T12:00:00Z"), "{}", aside[0].detail);
    }

    #[test]
    fn a_recorder_that_is_1024_weeks_behind_is_told_so() {
        let mut estimates = life(30);
        estimates[20].recorded_at = estimates[20].recorded_at.plus_hours(-GPS_ROLLOVER_H);
        let aside = judged(&estimates);
        assert_eq!((aside.len(), aside[0].reason), (1, HoursBackwards));
        assert!(aside[0].detail.contains("1024 weeks later, at 2026-01-11T00:00:00Z"), "{}", aside[0].detail);
    }

    #[test]
    fn where_no_two_agree_none_counts() {
        let minutes: Vec<_> = (0..20).map(|i| estimate(i, 6e4 + 240.0 * i as f64, 12.0 * i as f64)).collect();
        let aside = judged(&minutes);
        assert!(aside.len() == 20 && aside.iter().all(|one| one.reason == ImplausibleHours), "{aside:?}");
    }

    #[test]
    fn times_of_which_only_the_day_is_known_are_believed() {
        let dated = |i: usize| estimate(i, 4.0 * i as f64, 24.0 * (i / 2) as f64);
        assert!(refused(&(0..20).map(dated).collect::<Vec<_>>()).is_empty());
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

    /// The longest chain, tried out.
    fn longest_by_force(estimates: &[Estimate]) -> usize {
        let mut lengths: Vec<usize> = Vec::new();
        for (j, estimate) in estimates.iter().enumerate() {
            let agrees = |i: &usize| contradiction(&estimates[*i], estimate).is_none();
            let longest = (0..j).filter(agrees).map(|i| lengths[i]).max();
            lengths.push(longest.map_or(1, |length| length + 1));
        }
        lengths.into_iter().max().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn those_that_agree_are_the_longest_chain(sketch in prop::collection::vec((0_u32..40, 0_u32..60), 1..60)) {
            let sketched = |(i, (hours, time)): (usize, (u32, u32))| estimate(i, f64::from(hours), f64::from(time));
            let mut estimates: Vec<_> = sketch.into_iter().enumerate().map(sketched).collect();
            estimates.sort_by(Estimate::life_order);
            let chain = longest_chain(&estimates.iter().collect::<Vec<_>>());
            prop_assert!(chain.windows(2).all(|pair| contradiction(pair[0], pair[1]).is_none()));
            prop_assert_eq!(chain.len(), longest_by_force(&estimates));
        }

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
