use proptest::prelude::*;

use super::*;
use crate::{UtilisationSource, time::DAY_US};

const HORIZON_DAYS: i64 = 4000;

fn day(days: f64) -> Timestamp {
    "2026-01-01T00:00:00Z".parse::<Timestamp>().unwrap().plus_hours(24.0 * days)
}

fn from(days: f64) -> PlannedStretch {
    let from = day(days);
    PlannedStretch { from, until: None, utilisation_fh_per_day: None, load: None, temperature_c: None, mission: None }
}

fn flown(days: f64, fh_per_day: f64) -> PlannedStretch {
    PlannedStretch { utilisation_fh_per_day: Some(fh_per_day), ..from(days) }
}

fn plan(stretches: Vec<PlannedStretch>) -> Plan {
    Plan::new(stretches, day(-1e4)).unwrap()
}

fn pointers(stretches: Vec<PlannedStretch>, now: f64) -> Vec<String> {
    let refused = Plan::new(stretches, day(now)).unwrap_err();
    refused.violations.into_iter().map(|violation| violation.pointer).collect()
}

#[test]
fn a_day_or_a_time_is_a_moment() {
    assert_eq!(moment("2026-01-02"), Ok(day(1.0)));
    assert_eq!(moment("2026-01-01T13:00:00+01:00"), Ok(day(0.5)));
    for bad in ["2026-02-30", "2026-1-2", "tomorrow..", "", "2026-01-02T00:00:00", "1700-01-01"] {
        let refused = moment(bad).unwrap_err();
        assert!(refused.contains(&format!("{bad:?}")) && refused.contains("2026-03-01"), "{refused}");
    }
}

#[test]
fn what_is_wrong_is_named_by_its_place() {
    assert_eq!(pointers(vec![flown(1.0, 0.0), flown(2.0, 24.5)], 0.0).len(), 2);
    for bad in [0.0, -1.0, 24.001, f64::NAN, f64::INFINITY] {
        assert_eq!(pointers(vec![from(1.0), flown(2.0, bad)], 0.0), ["#/stretches/1/utilisation_fh_per_day"]);
    }
    for bad in [-0.1, 20.1, f64::NAN] {
        assert_eq!(pointers(vec![PlannedStretch { load: Some(bad), ..from(1.0) }], 0.0), ["#/stretches/0/load"]);
        let warm = PlannedStretch { temperature_c: Some(bad * 2e3), ..from(1.0) };
        assert_eq!(pointers(vec![warm], 0.0), ["#/stretches/0/temperature_c"]);
    }
    for bad in ["".to_owned(), "a\nb".to_owned(), "x".repeat(65)] {
        assert_eq!(pointers(vec![PlannedStretch { mission: Some(bad), ..from(1.0) }], 0.0), ["#/stretches/0/mission"]);
    }
    assert_eq!(pointers(vec![from(1.0); 101], 0.0), ["#/stretches"]);
}

#[test]
fn stretches_stand_in_their_order_and_not_over_one_another() {
    assert_eq!(pointers(vec![from(2.0), from(1.0)], 0.0), ["#/stretches/1/from"]);
    assert_eq!(pointers(vec![from(2.0), from(2.0)], 0.0), ["#/stretches/1/from"]);
    let until = |begin: f64, end: f64| PlannedStretch { until: Some(day(end)), ..from(begin) };
    assert_eq!(pointers(vec![until(1.0, 3.0), from(2.0)], 0.0), ["#/stretches/1/from"]);
    assert_eq!(pointers(vec![until(3.0, 3.0)], 0.0), ["#/stretches/0/until"]);
    assert!(Plan::new(vec![until(1.0, 2.0), from(2.0)], day(0.0)).is_ok());
}

#[test]
fn what_is_past_is_refused_and_what_has_begun_is_not() {
    let until = PlannedStretch { until: Some(day(2.0)), ..from(1.0) };
    assert_eq!(pointers(vec![until.clone()], 2.0), ["#/stretches/0/until"]);
    assert!(Plan::new(vec![until], day(1.5)).is_ok());
    assert_eq!(pointers(vec![from(1.0), from(2.0)], 2.5), ["#/stretches/0/from"]);
    assert!(Plan::new(vec![from(1.0)], day(1000.0)).is_ok());
}

#[test]
fn load_and_temperature_begin_after_the_hours_flown_until_then() {
    let hard = PlannedStretch { load: Some(1.5), until: Some(day(20.0)), ..flown(10.0, 4.0) };
    let warm = PlannedStretch { temperature_c: Some(40.0), ..from(30.0) };
    let plan = plan(vec![hard, warm]);
    let told = |stretch: &Stretch| (stretch.from_fh, stretch.load, stretch.temperature);
    let ahead = plan.ahead(&plan.schedule(day(0.0), Some(2.0)));
    let (load, warm) = (Some(LoadAhead::Ratio(1.5)), Some(TemperatureAhead::Celsius(40.0)));
    assert_eq!(
        ahead.stretches.iter().map(told).collect::<Vec<_>>(),
        [(20.0, load, None), (60.0, None, None), (80.0, None, warm)]
    );
    let begun = plan.ahead(&plan.schedule(day(15.0), None));
    assert_eq!(begun.stretches.iter().map(told).collect::<Vec<_>>(), [(0.0, load, None), (20.0, None, None)]);
    assert!(
        plan.ahead(&plan.schedule(day(0.0), None)).is_silent(),
        "nobody knows how many hours are flown until it begins"
    );
    assert_eq!(plan.ahead(&plan.schedule(day(50.0), None)).stretches.len(), 1);
}

#[test]
fn a_plan_says_whose_utilisation_it_is() {
    let source = |plan: Plan, at: f64| plan.schedule(day(at), Some(3.0)).source();
    assert_eq!(source(plan(vec![]), 0.0), UtilisationSource::Learned);
    assert_eq!(source(plan(vec![from(1.0)]), 0.0), UtilisationSource::Learned);
    assert_eq!(source(plan(vec![flown(1.0, 2.0)]), 0.0), UtilisationSource::Plan);
    let over = PlannedStretch { until: Some(day(2.0)), ..flown(1.0, 2.0) };
    assert_eq!(source(plan(vec![over]), 2.0), UtilisationSource::Learned);
}

#[test]
fn nothing_is_known_behind_what_nobody_knows() {
    let late = plan(vec![flown(10.0, 5.0)]).schedule(day(0.0), None);
    assert_eq!(late.hours_until(day(11.0)), None);
    assert_eq!(late.time_after(1.0), None);
    assert_eq!(late.time_after(0.0), Some(day(0.0)));
    let over = PlannedStretch { until: Some(day(2.0)), ..flown(0.0, 5.0) };
    let early = plan(vec![over]).schedule(day(0.0), None);
    assert_eq!((early.hours_until(day(2.0)), early.hours_until(day(2.1))), (Some(10.0), None));
    assert_eq!((early.time_after(10.0), early.time_after(10.1)), (Some(day(2.0)), None));
    let grounded = plan(vec![flown(10.0, 5.0)]).schedule(day(0.0), Some(0.0));
    assert_eq!(grounded.time_after(5.0), Some(day(11.0)));
    assert_eq!(plan(vec![]).schedule(day(0.0), Some(0.0)).time_after(5.0), None);
}

prop_compose! {
    /// A plan of up to eight stretches, some with an end, some that tell no utilisation.
    fn plans()(
        gaps in prop::collection::vec((1i64..200, prop::option::of(1i64..50), prop::option::of(0.01..24.0f64)), 0..8),
    ) -> Plan {
        let mut begin = -100;
        let stretches = gaps.into_iter().map(|(length, end, fh_per_day)| {
            let stretch = PlannedStretch {
                until: end.map(|end| day((begin + end.min(length)) as f64)),
                utilisation_fh_per_day: fh_per_day,
                ..from(begin as f64)
            };
            begin += length;
            stretch
        });
        plan(stretches.collect())
    }
}

proptest! {
    #[test]
    fn the_date_after_the_hours_until_a_date_is_that_date(
        plan in plans(), learned in 0.01..20.0f64, until in 0..HORIZON_DAYS,
    ) {
        let schedule = plan.schedule(day(0.0), Some(learned));
        let hours = schedule.hours_until(day(until as f64)).unwrap();
        let again = schedule.time_after(hours).unwrap();
        prop_assert!((again.micros() - day(until as f64).micros()).abs() < DAY_US / 1_000_000, "{again}");
    }

    #[test]
    fn later_dates_are_more_hours_and_more_hours_are_later(
        plan in plans(), learned in prop::option::of(0.0..20.0f64), a in 0.0..4000.0f64, b in 0.0..4000.0f64,
    ) {
        let schedule = plan.schedule(day(0.0), learned);
        let (a, b) = (a.min(b), a.max(b));
        if let (Some(early), Some(late)) = (schedule.hours_until(day(a)), schedule.hours_until(day(b))) {
            prop_assert!(0.0 <= early && early <= late && late <= 24.0 * b + 1e-6);
        }
        if let (Some(early), Some(late)) = (schedule.time_after(a), schedule.time_after(b)) {
            prop_assert!(day(0.0) <= early && early <= late);
        }
        // Who knows the later one knows the earlier one.
        prop_assert!(schedule.time_after(a).is_some() || schedule.time_after(b).is_none());
    }

    #[test]
    fn what_is_ahead_is_in_order(plan in plans(), learned in prop::option::of(0.0..20.0f64), at in -200..1000i64) {
        let ahead = plan.ahead(&plan.schedule(day(at as f64), learned));
        prop_assert!(ahead.stretches.iter().all(|stretch| stretch.from_fh >= 0.0));
        prop_assert!(ahead.stretches.windows(2).all(|pair| pair[0].from_fh < pair[1].from_fh));
    }

    #[test]
    fn a_plan_is_read_back_as_it_was_written(plan in plans()) {
        let text = serde_json::to_string(&plan).unwrap();
        prop_assert_eq!(serde_json::from_str::<Plan>(&text).unwrap(), plan);
    }
}
