//! What is stored is a function of the sets of uploads, voids and configurations, in any order.

use domain::{OperatorId, TailNumber, Timestamp, Upload};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{Receipt, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, INCREDIBLE_FH, LEASE, by_hand, configuration, day, drain, serve, tail, upload,
};

/// What reaches the store.
#[derive(Debug, Clone)]
enum Act {
    Upload(Upload),
    Void(Upload),
    Configure { tail: TailNumber, from: Timestamp, gain_noise: f64 },
}

/// Unit, tail, hours and day of an upload, from few of each so that they collide; whether it is sent
/// twice, and whether it is voided.
type Sketch = ((u8, u8, u8, u8), bool, bool);

fn acts() -> impl Strategy<Value = Vec<Act>> {
    let one = (0..2_u8, 0..2_u8, 0..9_u8, 0..12_u8);
    let uploads = prop::collection::vec((one, prop::bool::weighted(0.3), prop::bool::weighted(0.2)), 1..20);
    let configurations = prop::collection::btree_set((0..2_u8, 0..12_u8), 0..5);
    (uploads, configurations).prop_map(|(uploads, configurations)| {
        let configure = |(tail_index, time): (u8, u8)| Act::Configure {
            tail: tail(&format!("T{tail_index}")),
            from: day(f64::from(time)),
            gain_noise: 0.01 * f64::from(time) + 0.2 * f64::from(tail_index),
        };
        let mut acts: Vec<Act> = configurations.into_iter().map(configure).collect();
        acts.extend(uploads.into_iter().enumerate().flat_map(|(i, sketch)| of_upload(i, sketch)));
        acts
    })
}

fn of_upload(i: usize, ((unit, tail_index, hours, time), twice, voided): Sketch) -> Vec<Act> {
    let upload = Upload {
        tail: tail(&format!("T{tail_index}")),
        flight_hours: if hours == 8 { INCREDIBLE_FH } else { 10.0 * f64::from(hours) },
        recorded_at: day(f64::from(time)),
        ..upload(&format!("u{i:02}"), &unit.to_string())
    };
    let mut acts = vec![Act::Upload(upload.clone())];
    acts.extend(twice.then(|| Act::Upload(upload.clone())));
    acts.extend(voided.then_some(Act::Void(upload)));
    acts
}

/// What a worker does after an act.
#[derive(Debug, Clone, Copy)]
enum Worker {
    Sleeps,
    ServesOne,
    ServesAll,
}

fn worker() -> impl Strategy<Value = Worker> {
    prop_oneof![Just(Worker::Sleeps), Just(Worker::ServesOne), Just(Worker::ServesAll)]
}

/// Acts in some order, each with what the worker does after it.
fn ways() -> impl Strategy<Value = [Vec<(Act, Worker)>; 2]> {
    acts().prop_flat_map(|acts| {
        let way = || (Just(acts.clone()).prop_shuffle(), prop::collection::vec(worker(), acts.len()));
        (way(), way())
            .prop_map(|(one, other)| [one, other].map(|(acts, workers)| acts.into_iter().zip(workers).collect()))
    })
}

async fn play(store: &Store, operator: &OperatorId, way: &[(Act, Worker)]) {
    let mut early = Vec::new();
    for (act, worker) in way {
        match act {
            Act::Upload(upload) => {
                let received = store.accept(operator, upload.clone(), day(0.0)).await.unwrap();
                assert_ne!(received, Receipt::Conflict);
            }
            // Only what is there can be voided: what is not, is voided in the end.
            Act::Void(upload) => {
                if store.void_upload(operator, &upload.upload_id, by_hand(0.0)).await.unwrap().is_none() {
                    early.push(upload.upload_id.clone());
                }
            }
            Act::Configure { tail, from, gain_noise } => {
                let configuration = configuration(*gain_noise);
                store.add_sensor_configuration(operator, tail, *from, &configuration, by_hand(0.0)).await.unwrap();
            }
        }
        match worker {
            Worker::Sleeps => {}
            Worker::ServesOne => {
                if let Some(lease) = store.lease(LEASE).await.unwrap() {
                    serve(store, &lease).await;
                }
            }
            Worker::ServesAll => drain(store).await,
        }
    }
    for id in early {
        store.void_upload(operator, &id, by_hand(0.0)).await.unwrap();
    }
}

/// Installations, lives, histories and what waits, as they are served.
async fn dump(store: &Store, operator: &OperatorId) -> String {
    let mut dump = String::new();
    for serial in ["0", "1"] {
        let component = upload("any", serial).component(operator);
        let record = store.component(&component).await.unwrap();
        let record = record.map(|record| (record.lives, record.installations));
        let estimates = store.estimates(&component, None, None, None, None, 1000).await.unwrap();
        let states = store.states(&component, None, None, None, None, 1000).await.unwrap();
        dump += &format!("{record:#?}\n{estimates:#?}\n{states:#?}\n");
    }
    use domain::UploadStateKind::{Pending, Processed, SetAside, Voided};
    for state in [Pending, Processed, SetAside, Voided] {
        let uploads = store.uploads(operator, state, None, 1000).await.unwrap();
        let uploads: Vec<_> = uploads.into_iter().map(|one| (one.upload, one.state, one.estimate)).collect();
        dump += &format!("{state:?}: {uploads:#?}\n");
    }
    dump
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn any_order_of_the_same_acts_leaves_the_same(backend: Backend) {
    any_order_leaves_the_same(backend, backend.cases(12));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn slow_any_order_of_many_more_acts_leaves_the_same(backend: Backend) {
    any_order_leaves_the_same(backend, backend.cases(80));
}

fn any_order_leaves_the_same(backend: Backend, cases: u32) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let mut runner = TestRunner::new(ProptestConfig { failure_persistence: None, cases, ..Default::default() });
    let databases = [Database::new(backend), Database::new(backend)];
    let [one, other] = [0, 1].map(|i| runtime.block_on(databases[i].ready()));
    let case = std::cell::Cell::new(0);
    let outcome = runner.run(&ways(), |ways| {
        case.set(case.get() + 1);
        let operator: OperatorId = format!("case-{}", case.get()).parse().unwrap();
        runtime.block_on(async {
            for (store, way) in [&one, &other].into_iter().zip(&ways) {
                play(store, &operator, way).await;
                drain(store).await;
            }
            prop_assert_eq!(dump(&one, &operator).await, dump(&other, &operator).await);
            prop_assert_eq!(one.digest().await.unwrap(), other.digest().await.unwrap());
            Ok(())
        })
    });
    outcome.unwrap();
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_digest_tells_what_differs(backend: Backend) {
    let databases = [Database::new(backend), Database::new(backend), Database::new(backend)];
    let mut digests = Vec::new();
    for (i, database) in databases.iter().enumerate() {
        let store = database.ready().await;
        for n in 0..5 {
            let hours = 10.0 * f64::from(n) + if n == 4 && i == 2 { 1e-9 } else { 0.0 };
            let upload = Upload { flight_hours: hours, ..upload(&format!("u{n}"), "0001") };
            store.accept(&"one".parse().unwrap(), upload, day(f64::from(n) + i as f64)).await.unwrap();
        }
        assert_eq!(store.digest().await.unwrap().estimates, 0);
        drain(&store).await;
        digests.push(store.digest().await.unwrap());
    }
    assert_eq!((digests[0].estimates, digests[0].states, digests[0].lives), (5, 2, 1));
    assert_eq!(digests[0], digests[1], "when uploads were received makes no difference");
    assert_ne!(digests[0].digest, digests[2].digest);
}
