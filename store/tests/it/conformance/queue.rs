use std::{
    collections::{BTreeSet, HashSet},
    sync::{Arc, Mutex},
    time::Duration,
};

use domain::{Component, OperatorId};
use store::{Completion, Options, Store};
use test_case::test_case;
use tokio::{task::JoinSet, time::timeout};

use crate::fixture::{
    self,
    Backend::{self, *},
    Database, HandClock, LEASE, component, day, drain, later_upload, lease, life_inputs, operator, results, serve,
    upload,
};

/// Longer than anything here takes: only a hang runs into it.
const HANG: Duration = Duration::from_secs(30);

async fn accept(store: &Store, id: &str, serial: &str) {
    store.accept(&operator(), upload(id, serial), day(0.0)).await.unwrap();
}

async fn void(store: &Store, id: &str) {
    store.void_upload(&operator(), &id.parse().unwrap(), fixture::by_hand(0.0)).await.unwrap();
}

fn by_hand(backend: Backend) -> (HandClock, Database) {
    let clock = HandClock::new();
    let options = Options { clock: Some(clock.clock()), ..Options::default() };
    (clock, Database::with(backend, options))
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_leased_component_is_leased_to_nobody_else(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
    accept(&store, "u1", "0001").await;
    accept(&store, "u2", "0001").await;
    let lease = lease(&store).await;
    assert_eq!((&lease.component, lease.input_revision, lease.attempts), (&component("0001"), 2, 0));
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
    assert_eq!(serve(&store, &lease).await, Completion::Done);
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_upload_during_processing_leaves_its_component_waiting(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    let first = lease(&store).await;
    let inputs = life_inputs(&store, &first).await;
    assert!(!store.newer_input_waits(&first, 0).await.unwrap());
    accept(&store, "u2", "0001").await;
    assert!(store.newer_input_waits(&first, 0).await.unwrap());
    assert!(!store.newer_input_waits(&first, 1).await.unwrap(), "of another life");
    assert_eq!(store.complete(&first, vec![results(&inputs)]).await.unwrap(), Completion::Done);
    assert_eq!(store.pending().await.unwrap(), 1);
    let second = lease(&store).await;
    assert!(second.fence > first.fence);
    let inputs = life_inputs(&store, &second).await;
    assert_eq!(inputs.unestimated.iter().map(|one| &one.upload).collect::<Vec<_>>(), [&upload("u2", "0001")]);
    assert_eq!(inputs.estimates.len(), 1);
    assert_eq!(serve(&store, &second).await, Completion::Done);
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_expired_lease_writes_nothing(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    let slow = lease(&store).await;
    clock.advance(LEASE);
    assert_eq!(serve(&store, &slow).await, Completion::Fenced);
    assert_eq!(store.pending().await.unwrap(), 1);
    let next = lease(&store).await;
    assert_eq!((next.fence, next.attempts), (slow.fence + 1, 1));
    assert_eq!(serve(&store, &slow).await, Completion::Fenced);
    assert_eq!(serve(&store, &next).await, Completion::Done);
    assert_eq!(store.pending().await.unwrap(), 0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_lease_ends_with_its_first_result(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    let lease = lease(&store).await;
    assert_eq!(serve(&store, &lease).await, Completion::Done);
    assert_eq!(serve(&store, &lease).await, Completion::Fenced);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_abandoned_component_backs_off_and_remembers_its_attempts(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    for attempts in 0..3 {
        let lease = lease(&store).await;
        assert_eq!(lease.attempts, attempts);
        store.abandon(&lease, Duration::from_secs(5)).await.unwrap();
        accept(&store, &format!("more{attempts}"), "0001").await;
        assert_eq!(store.lease(LEASE).await.unwrap(), None, "input does not cut a back-off short");
        clock.advance(Duration::from_secs(5));
    }
    drain(&store).await;
    accept(&store, "u2", "0001").await;
    assert_eq!(lease(&store).await.attempts, 0, "a result forgets the attempts before it");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_analysis_that_outlasts_its_lease_ends_within_a_later_one_though_uploads_keep_coming(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    for attempts in 0..4 {
        let slow = lease(&store).await;
        assert_eq!(slow.attempts, attempts);
        let inputs = life_inputs(&store, &slow).await;
        for passed in 1..=5 {
            clock.advance(LEASE);
            accept(&store, &format!("u{attempts}.{passed}"), "0001").await;
        }
        let expected = if attempts == 3 { Completion::Done } else { Completion::Fenced };
        assert_eq!(store.complete(&slow, vec![results(&inputs)]).await.unwrap(), expected, "attempt {attempts}");
    }
    assert_eq!(store.pending().await.unwrap(), 5, "what came during the last attempt");
    let next = lease(&store).await;
    assert_eq!(next.attempts, 0);
    clock.advance(LEASE);
    assert_eq!(serve(&store, &next).await, Completion::Fenced, "after a result, a lease is as long as at first");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_correction_ends_an_attempt_that_does_not_count_and_lets_the_next_have_its_time(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    accept(&store, "u2", "0001").await;
    let slow = lease(&store).await;
    clock.advance(LEASE);
    void(&store, "u2").await;
    let corrected = lease(&store).await;
    assert_eq!(corrected.attempts, slow.attempts + 1, "the lease had ended before the correction came");
    clock.advance(LEASE);
    assert_eq!(store.lease(LEASE).await.unwrap(), None, "it lasts twice as long");
    void(&store, "u1").await;
    let next = lease(&store).await;
    assert_eq!(next.attempts, corrected.attempts);
    clock.advance(LEASE);
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
    assert_eq!(serve(&store, &next).await, Completion::Done);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn abandoning_a_superseded_lease_has_no_effect(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001").await;
    let old = lease(&store).await;
    clock.advance(LEASE);
    let new = lease(&store).await;
    store.abandon(&old, Duration::from_secs(5)).await.unwrap();
    assert_eq!(serve(&store, &new).await, Completion::Done);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_component_that_waits_longest_comes_first(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    for (i, serial) in ["0003", "0001", "0002", "0003"].iter().enumerate() {
        accept(&store, &format!("u{i}"), serial).await;
        clock.advance(Duration::from_secs(1));
    }
    for serial in ["0003", "0001", "0002"] {
        assert_eq!(lease(&store).await.component, component(serial));
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn nobody_waits_for_work_that_is_there(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    // Accepted between an empty lease and the wait.
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
    accept(&store, "u1", "0001").await;
    timeout(HANG, store.work_available()).await.unwrap();
    drain(&store).await;
    // Accepted during the wait.
    let waiting = {
        let store = store.clone();
        tokio::spawn(async move { store.work_available().await })
    };
    tokio::task::yield_now().await;
    assert!(!waiting.is_finished());
    accept(&store, "u2", "0001").await;
    timeout(HANG, waiting).await.unwrap().unwrap();
    // Coming back from its back-off.
    let lease = lease(&store).await;
    store.abandon(&lease, Duration::from_millis(20)).await.unwrap();
    timeout(HANG, store.work_available()).await.unwrap();
    assert!(store.lease(LEASE).await.unwrap().is_some());
}

/// Leases and completes until told that all input is in and nothing waits.
async fn leaser(store: Store, held: Arc<Mutex<HashSet<String>>>, estimated: Arc<Mutex<Vec<String>>>, expected: usize) {
    while estimated.lock().unwrap().len() < expected {
        let Some(lease) = store.lease(LEASE).await.unwrap() else {
            let _ = timeout(Duration::from_millis(20), store.work_available()).await;
            continue;
        };
        let serial = lease.component.serial_number.to_string();
        assert!(held.lock().unwrap().insert(serial.clone()), "{serial} is held twice");
        let inputs = life_inputs(&store, &lease).await;
        let results = results(&inputs);
        let ids: Vec<_> = results.estimates.iter().map(|e| e.upload_id.to_string()).collect();
        tokio::task::yield_now().await;
        assert!(held.lock().unwrap().remove(&serial));
        assert_eq!(store.complete(&lease, vec![results]).await.unwrap(), Completion::Done);
        estimated.lock().unwrap().extend(ids);
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn eight_leasers_process_every_upload_exactly_once(backend: Backend) {
    const UPLOADS: usize = 160;
    let database = Database::new(backend);
    let store = database.ready().await;
    let (held, estimated) = (Arc::default(), Arc::<Mutex<Vec<String>>>::default());
    let mut tasks = JoinSet::new();
    for _ in 0..8 {
        tasks.spawn(leaser(store.clone(), Arc::clone(&held), estimated.clone(), UPLOADS));
    }
    for i in 0..UPLOADS {
        let upload = later_upload(&format!("u{i}"), &format!("{:04}", i % 13), i as f64);
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    timeout(Duration::from_secs(120), tasks.join_all()).await.unwrap();
    let estimated = estimated.lock().unwrap().clone();
    assert_eq!(estimated.len(), UPLOADS, "no upload is estimated twice");
    assert_eq!(estimated.iter().collect::<BTreeSet<_>>().len(), UPLOADS);
    assert_eq!(store.pending().await.unwrap(), 0);
    assert_eq!(store.lease(LEASE).await.unwrap(), None);
}

/// Serves leases until nothing waits; the components in their order.
async fn served_in_order(store: &Store) -> Vec<Component> {
    let mut order = Vec::new();
    while let Some(lease) = store.lease(LEASE).await.unwrap() {
        assert_eq!(serve(store, &lease).await, Completion::Done);
        order.push(lease.component);
    }
    order
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn fresh_data_of_a_known_unit_waits_for_no_fleet_that_is_loaded_and_the_fleet_is_not_kept_waiting(
    backend: Backend,
) {
    const FLEET: usize = 20;
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    accept(&store, "first", "known").await;
    drain(&store).await;
    for i in 0..FLEET {
        accept(&store, &format!("load{i}"), &format!("new{i:02}")).await;
        clock.advance(Duration::from_secs(1));
    }
    let (mut later, mut left) = (0, FLEET);
    while left > 0 {
        accept(&store, &format!("fresh{later}"), "known").await;
        later += 1;
        clock.advance(Duration::from_secs(1));
        // Two leases go by at most before it is its turn.
        for turn in 0.. {
            let lease = lease(&store).await;
            assert_eq!(serve(&store, &lease).await, Completion::Done);
            if lease.component == component("known") {
                break;
            }
            left -= 1;
            assert!(turn < 2, "it waits for the fleet");
            if left == 0 {
                break;
            }
        }
    }
    assert!((FLEET..=4 * FLEET).contains(&later), "{FLEET} new ones were done beside {later} fresh ones");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn operators_take_turns_however_much_one_of_them_sends(backend: Backend) {
    let (clock, database) = by_hand(backend);
    let store = database.ready().await;
    let [large, small]: [OperatorId; 2] = ["large", "small"].map(|name| name.parse().unwrap());
    for i in 0..20 {
        store.accept(&large, upload(&format!("u{i}"), &format!("{i:04}")), day(0.0)).await.unwrap();
        clock.advance(Duration::from_secs(1));
    }
    for i in 0..5 {
        store.accept(&small, upload(&format!("u{i}"), &format!("{i:04}")), day(0.0)).await.unwrap();
    }
    let order = served_in_order(&store).await;
    let last = order.iter().rposition(|component| component.operator == small).unwrap();
    assert_eq!(order.len(), 25);
    // Of four leases one goes to the oldest, and of the others every second one.
    assert!(last < 16, "{last}: {order:?}");
}
