use std::cell::Cell;

use domain::{Component, Finding, Life, MaintenanceEvent, OperatorId, Prognosis, prognosis::InsufficientHistory};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{IssuedLife, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, bundle_body, by_hand, component, day, drain, fail, finding, later_upload, lease, life_inputs,
    operator, results, set_aside, upload,
};

fn life(operator: &OperatorId, serial: &str) -> Life {
    Life { component: Component { operator: operator.clone(), ..component(serial) }, overhaul_index: 0 }
}

/// Sends an upload of the component 0001 and has it processed; what was issued, with or without a forecast.
async fn issue(store: &Store, operator: &OperatorId, id: &str, flight_hours: f64, forecast: bool) -> Prognosis {
    let upload = later_upload(id, "0001", flight_hours - 100.0);
    store.accept(operator, upload, day(0.0)).await.unwrap();
    let lease = lease(store).await;
    let mut results = results(&life_inputs(store, &lease).await);
    let prognosis = results.prognosis.as_mut().unwrap();
    if !forecast {
        prognosis.forecast = Err(InsufficientHistory { missing: "a closed block".to_owned() });
    }
    let issued = prognosis.clone();
    store.complete(&lease, vec![results]).await.unwrap();
    issued
}

/// The definition: of each stretch, the first that was issued with a forecast before the failure.
fn by_definition(issued: &[Prognosis], every_fh: f64, failure_fh: f64) -> Vec<Prognosis> {
    let stretch = |prognosis: &Prognosis| (prognosis.as_of.flight_hours / every_fh).floor();
    let eligible = |one: &&Prognosis| one.forecast.is_ok() && one.as_of.flight_hours < failure_fh;
    let mut firsts: Vec<Prognosis> = Vec::new();
    for prognosis in issued.iter().filter(eligible) {
        if firsts.iter().all(|first| stretch(first) != stretch(prognosis)) {
            firsts.push(prognosis.clone());
        }
    }
    firsts.sort_by(|a, b| a.as_of.flight_hours.total_cmp(&b.as_of.flight_hours));
    firsts
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn a_finished_life_is_told_by_the_first_forecast_issued_in_each_stretch(backend: Backend) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let database = Database::new(backend);
    let store = runtime.block_on(database.ready());
    let cases = Cell::new(0);
    let uploads = prop::collection::vec((0..40_u32, prop::bool::weighted(0.7)), 1..12);
    let lives = (uploads, prop::sample::select(vec![20.0, 70.0, 1000.0]), 100..450_u32);
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, cases: backend.cases(24), ..Default::default() });
    let outcome = runner.run(&lives, |(uploads, every_fh, failure)| {
        cases.set(cases.get() + 1);
        let operator: OperatorId = format!("case-{}", cases.get()).parse().unwrap();
        runtime.block_on(async {
            let mut issued = Vec::new();
            for (i, (tenths, forecast)) in uploads.into_iter().enumerate() {
                issued.push(issue(&store, &operator, &format!("u{i}"), f64::from(tenths) * 10.0, forecast).await);
            }
            prop_assert_eq!(&store.issued_on_finished_lives(&operator, every_fh, 10).await.unwrap(), &[]);
            let failure_fh = f64::from(failure);
            fail(&store, &operator, "0001", failure_fh).await;
            let prognoses = by_definition(&issued, every_fh, failure_fh);
            let expected = IssuedLife { life: life(&operator, "0001"), failure_fh, prognoses };
            prop_assert_eq!(store.issued_on_finished_lives(&operator, every_fh, 10).await.unwrap(), [expected]);
            Ok(())
        })
    });
    outcome.unwrap();
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_failure_at_impossible_hours_is_served_but_neither_judges_nor_teaches(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    issue(&store, &operator(), "u1", 130.0, true).await;
    issue(&store, &operator(), "u2", 500.0, true).await;
    let known = async || {
        let part_number = upload("any", "0001").part_number;
        let judged = store.issued_on_finished_lives(&operator(), 100.0, 10).await.unwrap().len();
        let teaching = store.finished_lives(&operator(), &part_number, &bundle("one").hash).await.unwrap().len();
        let record = store.component(&component("0001")).await.unwrap().unwrap();
        (judged, teaching, record.lives[0].found_failed_fh)
    };
    for (id, failure_fh, counts) in [("lost-a-digit", 54.0, 0), ("one-too-many", 5400.0, 0), ("right", 540.0, 1)] {
        let failure = MaintenanceEvent { occurred_at: day(45.0), ..finding(id, "0001", Finding::Failed, failure_fh) };
        store.record_event(&operator(), &failure, day(0.0)).await.unwrap();
        assert_eq!(known().await, (counts, counts, Some(failure_fh)), "{id}");
        store.void_event(&operator(), &failure.event_id, by_hand(1.0)).await.unwrap();
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_was_issued_stays_whatever_arrives_or_is_voided_later(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let first = issue(&store, &operator(), "u1", 130.0, true).await;
    fail(&store, &operator(), "0001", 300.0).await;
    issue(&store, &operator(), "late", 110.0, true).await;
    store.void_upload(&operator(), &"u1".parse().unwrap(), by_hand(1.0)).await.unwrap();
    drain(&store).await;
    let lives = store.issued_on_finished_lives(&operator(), 100.0, 1).await.unwrap();
    assert_eq!(lives[0].prognoses, [first]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_newest_failures_come_first_and_a_voided_one_not_at_all(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for (serial, failure_fh) in [("a", 300.0), ("b", 500.0), ("c", 400.0), ("alive", 0.0)] {
        store.accept(&operator(), upload(&format!("u-{serial}"), serial), day(0.0)).await.unwrap();
        if failure_fh > 0.0 {
            fail(&store, &operator(), serial, failure_fh).await;
        }
    }
    let finished = async |limit| {
        let lives = store.issued_on_finished_lives(&operator(), 200.0, limit).await.unwrap();
        lives.into_iter().map(|one| one.life.component.serial_number.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(finished(10).await, ["b", "c", "a"]);
    assert_eq!(finished(2).await, ["b", "c"]);
    store.void_event(&operator(), &"end-of-c".parse().unwrap(), by_hand(9.0)).await.unwrap();
    assert_eq!(finished(10).await, ["b", "a"]);
    let elsewhere = "elsewhere".parse().unwrap();
    assert_eq!(store.issued_on_finished_lives(&elsewhere, 200.0, 10).await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn finished_lives_hold_what_counts_up_to_the_failure(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let part = component("any").part_number;
    let model = bundle("one").hash;
    for serial in ["b", "a", "alive"] {
        for (i, hours) in [30.0, 0.0, 10.0, 20.0, 40.0].into_iter().enumerate() {
            store.accept(&operator(), later_upload(&format!("{serial}{i}"), serial, hours), day(0.0)).await.unwrap();
        }
    }
    store.register_bundle(&bundle("two"), &bundle_body("two"), by_hand(1.0)).await.unwrap();
    store.activate_bundle(&bundle("two").hash, by_hand(1.0)).await.unwrap();
    store.accept(&operator(), upload("c0", "c"), day(1.0)).await.unwrap();
    store.void_upload(&operator(), &"a1".parse().unwrap(), by_hand(2.0)).await.unwrap();
    while let Some(lease) = store.lease(crate::fixture::LEASE).await.unwrap() {
        let mut results = results(&life_inputs(&store, &lease).await);
        if lease.component == component("a") {
            results.excluded.push(set_aside("a2", domain::SetAsideReason::ImplausibleHours));
        }
        store.complete(&lease, vec![results]).await.unwrap();
    }
    assert_eq!(store.finished_lives(&operator(), &part, &model).await.unwrap(), []);
    for (serial, failure_fh) in [("b", 125.0), ("a", 130.0), ("c", 200.0)] {
        fail(&store, &operator(), serial, failure_fh).await;
    }
    let told = async |model| {
        let lives = store.finished_lives(&operator(), &part, &model).await.unwrap();
        let ids = |life: &store::FinishedLife| life.estimates.iter().map(|e| e.upload_id.to_string()).collect();
        lives.iter().map(|one| (one.life.clone(), one.failure_fh, ids(one))).collect::<Vec<(_, _, Vec<String>)>>()
    };
    let expected = [
        (life(&operator(), "a"), 130.0, vec!["a3".to_owned(), "a0".to_owned()]),
        (life(&operator(), "b"), 125.0, vec!["b1".to_owned(), "b2".to_owned(), "b3".to_owned()]),
    ];
    assert_eq!(told(model).await, expected);
    assert_eq!(told(bundle("two").hash).await, [(life(&operator(), "c"), 200.0, vec!["c0".to_owned()])]);
}
