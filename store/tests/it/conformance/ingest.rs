use domain::{EventKind, Finding, MaintenanceEvent, OperatorId, SetAsideReason, Upload};
use futures_util::future::join_all;
use numerics::Stream;
use store::{Options, Receipt, StoreError, UploadState};
use test_case::test_case;
use tokio::task::JoinSet;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, component, day, drain, estimate, finding, later_upload, lease, life_inputs, operator, results,
    samples, set_aside, tail, upload,
};

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_name_is_taken_for_ever_and_its_content_decides(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let first = upload("u1", "0001");
    let other = Upload { reading: samples(vec![Some(0.0713), None, Some(0.3)]), ..first.clone() };
    let elsewhere = upload("u1", "0002");
    assert_eq!(store.accept(&operator(), first.clone(), day(0.0)).await.unwrap(), Receipt::Accepted);
    assert_eq!(store.accept(&operator(), first.clone(), day(1.0)).await.unwrap(), Receipt::Duplicate);
    drain(&store).await;
    assert_eq!(store.accept(&operator(), first.clone(), day(2.0)).await.unwrap(), Receipt::Duplicate);
    for conflict in [other, elsewhere] {
        assert_eq!(store.accept(&operator(), conflict, day(2.0)).await.unwrap(), Receipt::Conflict);
    }
    let record = store.upload(&operator(), &first.upload_id).await.unwrap().unwrap();
    assert_eq!((record.upload, record.received_at), (first, day(0.0)));
    assert_eq!(store.pending().await.unwrap(), 0, "neither a duplicate nor a conflict waits");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn operators_do_not_see_each_other(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let other: OperatorId = "other".parse().unwrap();
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    assert_eq!(store.upload(&other, &"u1".parse().unwrap()).await.unwrap(), None);
    assert_eq!(store.tails(&other, None, 10).await.unwrap(), []);
    assert_eq!(store.installed(&other, &upload("u1", "0001").tail).await.unwrap(), []);
    let theirs = Upload { flight_hours: 7.0, ..upload("u1", "0001") };
    assert_eq!(store.accept(&other, theirs, day(0.0)).await.unwrap(), Receipt::Accepted);
    drain(&store).await;
    let history = store.estimates(&upload("u1", "0001").component(&other), None, None, None, None, 10).await.unwrap();
    assert_eq!(history.iter().map(|e| e.flight_hours).collect::<Vec<_>>(), [7.0]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_upload_waits_then_has_its_estimate(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let upload = upload("u1", "0001");
    store.accept(&operator(), upload.clone(), day(0.0)).await.unwrap();
    let record = store.upload(&operator(), &upload.upload_id).await.unwrap().unwrap();
    assert_eq!((record.state, record.estimate), (UploadState::Pending, None));
    drain(&store).await;
    let record = store.upload(&operator(), &upload.upload_id).await.unwrap().unwrap();
    assert_eq!(record.state, UploadState::Processed);
    assert_eq!(record.estimate, Some(estimate(&upload, bundle("one").hash)));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_upload_that_is_set_aside_says_why_and_waits_no_longer(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let lease = lease(&store).await;
    let mut results = results(&life_inputs(&store, &lease).await);
    results.estimates.clear();
    results.set_aside.push(set_aside("u1", SetAsideReason::NotFinite));
    store.complete(&lease, vec![results]).await.unwrap();
    let record = store.upload(&operator(), &"u1".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!(
        record.state,
        UploadState::SetAside { reason: SetAsideReason::NotFinite, detail: "u1 as the test wants it".to_owned() }
    );
    assert_eq!(record.estimate, None);
    assert_eq!(store.pending().await.unwrap(), 0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_is_acknowledged_survives_a_reopening(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for i in 0..20 {
        store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
    }
    store.close().await;
    let store = database.open().await;
    assert_eq!(store.pending().await.unwrap(), 20);
    assert_eq!(store.accept(&operator(), upload("u7", "0001"), day(0.0)).await.unwrap(), Receipt::Duplicate);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_closed_store_writes_what_waited_and_refuses_the_rest(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let mut callers = JoinSet::new();
    for i in 0..50 {
        let store = store.clone();
        callers.spawn(async move { store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await });
    }
    tokio::task::yield_now().await;
    store.close().await;
    let accepted = callers.join_all().await.iter().filter(|answer| answer.is_ok()).count() as u64;
    let refused = store.accept(&operator(), upload("late", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::Closed)), "{refused:?}");
    assert!(matches!(store.ping().await, Err(StoreError::Closed)));
    store.work_available().await;
    let store = database.open().await;
    store.ping().await.unwrap();
    assert_eq!(store.pending().await.unwrap(), accepted);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_full_queue_refuses_and_loses_nothing(backend: Backend) {
    let database = Database::with(backend, Options { queue_capacity: 2, ..Options::default() });
    let store = database.ready().await;
    let mut callers = JoinSet::new();
    for i in 0..10 {
        let store = store.clone();
        callers.spawn(async move { store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await });
    }
    let answers = callers.join_all().await;
    let accepted = answers.iter().filter(|answer| matches!(answer, Ok(Receipt::Accepted))).count();
    let overloaded = answers.iter().filter(|answer| matches!(answer, Err(StoreError::Overloaded { capacity: 2 })));
    assert!((2..10).contains(&accepted), "{answers:?}");
    assert_eq!(accepted + overloaded.count(), 10);
    assert_eq!(store.pending().await.unwrap(), accepted as u64);
    assert_eq!(store.accept(&operator(), upload("again", "0001"), day(0.0)).await.unwrap(), Receipt::Accepted);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_would_not_read_back_equal_is_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let not_a_number = Upload { reading: samples(vec![Some(f64::NAN), None, None]), ..upload("u1", "0001") };
    let refused = store.accept(&operator(), not_a_number, day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::Unrepresentable { .. })), "{refused:?}");
    assert_eq!(store.pending().await.unwrap(), 0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn many_callers_at_once_are_all_stored(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let mut callers = JoinSet::new();
    for i in 0..800 {
        let store = store.clone();
        let upload = upload(&format!("u{}", i % 600), &format!("{:04}", i % 600 % 40));
        callers.spawn(async move { store.accept(&operator(), upload, day(0.0)).await.unwrap() });
    }
    let answers = callers.join_all().await;
    assert_eq!(answers.iter().filter(|answer| **answer == Receipt::Accepted).count(), 600);
    assert_eq!(answers.iter().filter(|answer| **answer == Receipt::Duplicate).count(), 200);
    assert_eq!(store.pending().await.unwrap(), 600);
}

/// Uploads of three units that mostly stay where they are, sometimes change places, repeat a name with the same content or
/// with another; an overhaul parts the life of one.
fn mixed(stream: &mut Stream) -> Vec<Upload> {
    let mut uploads: Vec<Upload> = Vec::new();
    for i in 0..120_usize {
        let unit = stream.below(4);
        let place = if stream.uniform() < 0.1 { stream.below(4) } else { unit };
        let upload = Upload {
            tail: tail(["EC-MXA", "EC-MXB"][place % 2]),
            position: ["AIL-L", "AIL-R"][place / 2].parse().unwrap(),
            ..later_upload(&format!("u{i:03}"), &format!("000{unit}"), 3.0 * i as f64)
        };
        let again = uploads.get(stream.below(i + 1)).cloned().filter(|_| stream.uniform() < 0.15);
        let other = |again: Upload| Upload { flight_hours: again.flight_hours + 1.0, ..again };
        uploads.extend(again.map(|again| if stream.uniform() < 0.3 { other(again) } else { again }));
        uploads.push(upload);
    }
    uploads
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn uploads_that_come_at_once_leave_what_they_leave_one_by_one(backend: Backend) {
    let mut stream = Stream::new(15, &["at once"]);
    let uploads = mixed(&mut stream);
    let (mut kept, mut all_told) = (Vec::new(), Vec::new());
    for at_once in [1, uploads.len()] {
        let database = Database::new(backend);
        let store = database.ready().await;
        let overhaul = MaintenanceEvent { kind: EventKind::Overhaul, ..finding("o", "0001", Finding::Failed, 100.0) };
        let operator = operator();
        store.accept(&operator, later_upload("first", "0001", 0.0), day(0.0)).await.unwrap();
        store.record_event(&operator, &overhaul, day(0.0)).await.unwrap();
        let mut told = Vec::new();
        for some in uploads.chunks(at_once) {
            let accept = some.iter().map(|upload| store.accept(&operator, upload.clone(), day(1.0)));
            told.extend(join_all(accept).await.into_iter().map(Result::unwrap));
        }
        assert_eq!(store.verify().await.unwrap().damaged, []);
        let mut known = Vec::new();
        for serial in ["0000", "0001", "0002", "0003"] {
            known.push(store.component(&component(serial)).await.unwrap().unwrap());
        }
        let pending = store.pending().await.unwrap();
        drain(&store).await;
        assert_eq!(store.verify().await.unwrap().damaged, []);
        kept.push((known, pending, store.digest().await.unwrap()));
        all_told.push(told);
    }
    assert_eq!(all_told[0], all_told[1]);
    assert!(kept[0] == kept[1], "{kept:#?}");
    let count = |receipt: &Receipt| all_told[0].iter().filter(|told| *told == receipt).count();
    let counts = [Receipt::Accepted, Receipt::Duplicate, Receipt::Conflict].map(|receipt| count(&receipt));
    assert!(counts.iter().all(|count| *count > 2), "{counts:?}");
}
