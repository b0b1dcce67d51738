use std::collections::BTreeMap;

use domain::{SetAsideReason, Upload, UploadStateKind};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{Completion, Receipt, Retrial, Store, UploadState, Voiding};
use test_case::test_case;

use crate::{
    conformance::installations::{as_stored, by_definition, sighted},
    fixture::{
        Backend::{self, *},
        Database, by_hand, component, day, drain, later_upload, lease, life_inputs, operator, results, serve,
        set_aside, tail, upload,
    },
};

async fn accept(store: &Store, upload: &Upload) {
    assert_eq!(store.accept(&operator(), upload.clone(), day(0.0)).await.unwrap(), Receipt::Accepted);
}

async fn void(store: &Store, id: &str) -> Option<Voiding> {
    store.void_upload(&operator(), &id.parse().unwrap(), by_hand(9.0)).await.unwrap()
}

async fn state(store: &Store, id: &str) -> UploadState {
    store.upload(&operator(), &id.parse().unwrap()).await.unwrap().unwrap().state
}

/// Everything that a fleet's answers about the component 0001 are made of.
async fn answers(store: &Store) -> String {
    let estimates = store.estimates(&component("0001"), None, None, None, None, 100).await.unwrap();
    let states = store.states(&component("0001"), None, None, None, None, 100).await.unwrap();
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    format!("{estimates:#?}\n{states:#?}\n{installed:#?}")
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_voided_upload_leaves_no_trace_in_the_answers(backend: Backend) {
    let (with, without) = (Database::new(backend), Database::new(backend));
    let (with, without) = (with.ready().await, without.ready().await);
    for i in 0..8 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        accept(&with, &upload).await;
        if i != 3 && i != 7 {
            accept(&without, &upload).await;
        }
    }
    drain(&with).await;
    for id in ["u3", "u7"] {
        assert_eq!(void(&with, id).await, Some(Voiding::Voided));
        assert_eq!(void(&with, id).await, Some(Voiding::AlreadyVoided));
        assert_eq!(state(&with, id).await, UploadState::Voided { at: day(9.0) });
    }
    drain(&with).await;
    drain(&without).await;
    assert_eq!(answers(&with).await, answers(&without).await);
    assert_eq!(with.digest().await.unwrap(), without.digest().await.unwrap());
    assert_eq!(void(&with, "unknown").await, None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_voided_upload_is_kept_and_its_name_stays_taken(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let upload = upload("u1", "0001");
    accept(&store, &upload).await;
    drain(&store).await;
    void(&store, "u1").await;
    drain(&store).await;
    assert_eq!(store.accept(&operator(), upload.clone(), day(1.0)).await.unwrap(), Receipt::Duplicate);
    let other = Upload { flight_hours: 1.0, ..upload.clone() };
    assert_eq!(store.accept(&operator(), other, day(1.0)).await.unwrap(), Receipt::Conflict);
    let record = store.upload(&operator(), &upload.upload_id).await.unwrap().unwrap();
    assert_eq!((record.upload, record.received_at, record.estimate), (upload, day(0.0), None));
    assert_eq!(record.state, UploadState::Voided { at: day(9.0) });
    assert_eq!(store.pending().await.unwrap(), 0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_life_whose_uploads_are_all_voided_answers_like_one_without_history(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for i in 0..6 {
        accept(&store, &later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i))).await;
    }
    drain(&store).await;
    assert!(!store.states(&component("0001"), None, None, None, None, 10).await.unwrap().is_empty());
    for i in 0..6 {
        void(&store, &format!("u{i}")).await;
    }
    // At once, and after a worker has looked at it.
    for _ in 0..2 {
        assert_eq!(store.estimates(&component("0001"), None, None, None, None, 10).await.unwrap(), []);
        assert_eq!(store.states(&component("0001"), None, None, None, None, 10).await.unwrap(), []);
        assert_eq!(store.installed(&operator(), &tail("EC-MXA")).await.unwrap(), []);
        drain(&store).await;
    }
    accept(&store, &later_upload("anew", "0001", 100.0)).await;
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    assert_eq!((installed.len(), &installed[0].prognosis), (1, &None), "what was served rests on voided uploads");
    drain(&store).await;
    assert!(store.installed(&operator(), &tail("EC-MXA")).await.unwrap()[0].prognosis.is_some());
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_computed_from_an_upload_that_was_voided_meanwhile_are_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, &later_upload("u1", "0001", 0.0)).await;
    accept(&store, &later_upload("u2", "0001", 10.0)).await;
    let early = lease(&store).await;
    let inputs = life_inputs(&store, &early).await;
    void(&store, "u1").await;
    assert_eq!(store.complete(&early, vec![results(&inputs)]).await.unwrap(), Completion::Fenced);
    let late = lease(&store).await;
    assert_eq!(late.attempts, 0, "a lease that was revoked is no failed attempt");
    assert_eq!(serve(&store, &late).await, Completion::Done);
    let history = store.estimates(&component("0001"), None, None, None, None, 10).await.unwrap();
    assert_eq!(history.iter().map(|estimate| estimate.upload_id.as_str()).collect::<Vec<_>>(), ["u2"]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_is_set_aside_waits_again_once_it_is_retried(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let retry = async |id: &str| store.retry_upload(&operator(), &id.parse().unwrap(), by_hand(5.0)).await.unwrap();
    accept(&store, &upload("u1", "0001")).await;
    assert_eq!(retry("u1").await, Some(Retrial::NotSetAside { state: UploadState::Pending }));
    let lease = lease(&store).await;
    let mut results = results(&life_inputs(&store, &lease).await);
    results.estimates.clear();
    results.prognosis = None;
    results.set_aside.push(set_aside("u1", SetAsideReason::NotEstimable));
    store.complete(&lease, vec![results]).await.unwrap();
    assert_eq!(store.work_figures().await.unwrap().set_aside, 1);
    assert_eq!(retry("u1").await, Some(Retrial::Retried));
    assert_eq!(state(&store, "u1").await, UploadState::Pending);
    let figures = store.work_figures().await.unwrap();
    assert_eq!((figures.pending, figures.oldest_pending_since, figures.set_aside), (1, Some(day(5.0)), 0));
    drain(&store).await;
    assert_eq!(retry("u1").await, Some(Retrial::NotSetAside { state: UploadState::Processed }));
    void(&store, "u1").await;
    let voided = UploadState::Voided { at: day(9.0) };
    assert_eq!(retry("u1").await, Some(Retrial::NotSetAside { state: voided }));
    assert_eq!(retry("unknown").await, None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_upload_counts_as_received_when_it_was_last_retried(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, &upload("u1", "0001")).await;
    for (received, retried) in [(0.0, 5.0), (5.0, 8.0), (8.0, 9.0)] {
        let lease = lease(&store).await;
        let inputs = life_inputs(&store, &lease).await;
        assert_eq!(inputs.unestimated[0].received_at, day(received));
        let mut results = results(&inputs);
        results.estimates.clear();
        results.prognosis = None;
        results.set_aside.push(set_aside("u1", SetAsideReason::ImplausibleHours));
        store.complete(&lease, vec![results]).await.unwrap();
        store.retry_upload(&operator(), &"u1".parse().unwrap(), by_hand(retried)).await.unwrap();
    }
    let record = store.upload(&operator(), &"u1".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!(record.received_at, day(0.0), "what is told of its receipt stays");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_excluded_upload_keeps_its_estimate_and_counts_nowhere_until_it_is_vindicated(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let history = async || {
        let history = store.estimates(&component("0001"), None, None, None, None, 100).await.unwrap();
        history.into_iter().map(|estimate| estimate.upload_id.to_string()).collect::<Vec<_>>()
    };
    let utilisation =
        async || store.installed(&operator(), &tail("EC-MXA")).await.unwrap()[0].utilisation_fh_per_day.unwrap();
    for (id, hours) in [("u0", 0.0), ("u1", 100.0), ("u2", 200.0)] {
        accept(&store, &later_upload(id, "0001", hours)).await;
    }
    drain(&store).await;
    assert!((utilisation().await - 10.0).abs() < 1e-9);
    accept(&store, &Upload { flight_hours: 9000.0, ..later_upload("odd", "0001", 210.0) }).await;
    drain(&store).await;
    let record = store.upload(&operator(), &"odd".parse().unwrap()).await.unwrap().unwrap();
    let excluded = set_aside("odd", SetAsideReason::ImplausibleHours);
    assert_eq!(record.state, UploadState::SetAside { reason: excluded.reason, detail: excluded.detail });
    assert_eq!(record.estimate.map(|estimate| estimate.flight_hours), Some(9000.0));
    assert_eq!(history().await, ["u0", "u1", "u2"]);
    assert!((utilisation().await - 10.0).abs() < 1e-9);
    assert_eq!(store.work_figures().await.unwrap().set_aside, 1);
    // Another one says the same, so both are believed.
    accept(&store, &Upload { flight_hours: 9001.0, ..later_upload("even", "0001", 220.0) }).await;
    drain(&store).await;
    assert_eq!(state(&store, "odd").await, UploadState::Processed);
    assert_eq!(history().await, ["u0", "u1", "u2", "odd", "even"]);
    assert_eq!(store.work_figures().await.unwrap().set_aside, 0);
    // The witness is taken back.
    void(&store, "even").await;
    drain(&store).await;
    assert_eq!(state(&store, "odd").await.kind(), UploadStateKind::SetAside);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_life_whose_estimates_are_all_excluded_serves_nothing(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, &Upload { flight_hours: 100.0, ..upload("u1", "0001") }).await;
    drain(&store).await;
    accept(&store, &Upload { flight_hours: 9000.0, ..later_upload("odd", "0001", 10.0) }).await;
    drain(&store).await;
    void(&store, "u1").await;
    drain(&store).await;
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    assert_eq!((installed.len(), &installed[0].prognosis), (1, &None));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn installations_are_those_of_the_uploads_that_are_not_voided(backend: Backend) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let database = Database::new(backend);
    let store = runtime.block_on(database.ready());
    let cases = std::cell::Cell::new(0);
    let sightings = prop::collection::vec((0..3_u8, 0..2_u8, 0..2_u8, 0..10_u8), 1..16);
    let uploads = sightings.prop_map(|all| all.into_iter().enumerate().map(sighted).collect::<Vec<_>>());
    let acts = uploads.prop_flat_map(|uploads| {
        // When each upload is voided: so many arrivals after its own, or never.
        let delays = prop::collection::vec(prop::option::of(0..6_usize), uploads.len());
        (Just(uploads).prop_shuffle(), delays)
    });
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, cases: backend.cases(128), ..Default::default() });
    let outcome = runner.run(&acts, |(uploads, delays)| {
        cases.set(cases.get() + 1);
        let operator = format!("case-{}", cases.get()).parse().unwrap();
        let due: Vec<usize> =
            delays.iter().enumerate().map(|(i, delay)| delay.map_or(usize::MAX, |delay| i + delay)).collect();
        runtime.block_on(async {
            for step in 0..uploads.len() + 6 {
                if let Some(upload) = uploads.get(step) {
                    store.accept(&operator, upload.clone(), day(0.0)).await.unwrap();
                }
                for (upload, _) in uploads.iter().zip(&due).filter(|(_, due)| **due == step) {
                    store.void_upload(&operator, &upload.upload_id, by_hand(0.0)).await.unwrap();
                }
            }
            let kept = uploads.iter().zip(&due).filter(|(_, due)| **due == usize::MAX);
            let kept: Vec<_> = kept.map(|(upload, _)| upload.clone()).collect();
            let mut expected: BTreeMap<_, _> =
                uploads.iter().map(|upload| (upload.serial_number.to_string(), Vec::new())).collect();
            expected.extend(by_definition(&kept));
            prop_assert_eq!(as_stored(&store, &operator, &uploads).await, expected);
            Ok(())
        })
    });
    outcome.unwrap();
}
