use domain::{EventKind, Finding, MaintenanceEvent, Upload};
use numerics::Stream;
use store::{ComponentRecord, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, component, configuration, day, drain, finding, later_upload, operator, tail, upload,
};

const SERIALS: [&str; 3] = ["0001", "0002", "0003"];

/// What was done to a component at a place: removals and installs that agree with uploads and that do not, some of them
/// on one day.
fn movement(number: usize) -> MaintenanceEvent {
    let (unit, place) = (number % 3, (number / 2) % 4);
    MaintenanceEvent {
        kind: [EventKind::Install, EventKind::Remove][number / 3 % 2],
        tail: tail(["EC-MXA", "EC-MXB"][place % 2]),
        position: ["AIL-L", "AIL-R"][place / 2].parse().unwrap(),
        occurred_at: day((number / 2) as f64),
        ..finding(&format!("moved-{number:02}"), SERIALS[unit], Finding::Serviceable, 0.0)
    }
}

/// Uploads of three components that change places, in random order, with one that is voided, one that claims
/// hours that nobody can believe, installs and removals, a sensor configuration and a life that has ended. From time to
/// time somebody looks at it.
pub async fn fleet(database: &Database, look: impl AsyncFn(&Store)) -> Store {
    let store = database.ready().await;
    let mut stream = Stream::new(11, &["rebuild"]);
    let mut uploads = Vec::new();
    for (number, serial) in SERIALS.into_iter().enumerate() {
        for i in 0..30_usize {
            let id = format!("{serial}.{i}");
            let hours = 9.0 * i as f64 + number as f64;
            let place = (i / 7 + number) % 4;
            uploads.push(Upload {
                tail: tail(["EC-MXA", "EC-MXB"][place % 2]),
                position: ["AIL-L", "AIL-R"][place / 2].parse().unwrap(),
                ..later_upload(&id, serial, hours)
            });
        }
    }
    uploads.push(Upload { flight_hours: 6000.0, ..later_upload("odd", "0002", 33.0) });
    stream.shuffle(&mut uploads);
    let mut movements: Vec<MaintenanceEvent> = (0..40).map(movement).collect();
    stream.shuffle(&mut movements);
    for (i, upload) in uploads.into_iter().enumerate() {
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
        if let Some(event) = movements.get(i / 2).filter(|_| i % 2 == 0) {
            store.record_event(&operator(), event, day(40.0)).await.unwrap();
        }
        if i % 10 == 9 {
            look(&store).await;
            drain(&store).await;
            look(&store).await;
        }
    }
    store.void_upload(&operator(), &"0001.14".parse().unwrap(), by_hand(40.0)).await.unwrap();
    look(&store).await;
    store
        .add_sensor_configuration(&operator(), &tail("EC-MXB"), day(9.0), &configuration(0.5), by_hand(40.0))
        .await
        .unwrap();
    for number in [3, 12, 20, 33] {
        store.void_event(&operator(), &movement(number).event_id, by_hand(40.0)).await.unwrap();
    }
    store.record_event(&operator(), &finding("end", "0003", Finding::Failed, 500.0), day(40.0)).await.unwrap();
    look(&store).await;
    drain(&store).await;
    look(&store).await;
    store
}

/// What is known of the components, but not the states of generations.
async fn components(store: &Store) -> Vec<ComponentRecord> {
    let mut records = Vec::new();
    for serial in SERIALS {
        records.push(store.component(&component(serial)).await.unwrap().unwrap());
    }
    records
}

async fn forget_all(store: &Store) -> usize {
    let (mut last, mut batches) = (None, 0);
    loop {
        last = store.forget_derived(last.as_ref(), day(50.0)).await.unwrap();
        match &last {
            None => return batches,
            Some(_) => batches += 1,
        }
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_was_thrown_away_is_made_anew_as_it_was(backend: Backend) {
    let database = Database::new(backend);
    let store = fleet(&database, async |_| {}).await;
    let (digest, known) = (store.digest().await.unwrap(), components(&store).await);
    let served = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    assert!(known.iter().all(|record| record.installations.len() > 4), "{known:?}");
    assert_eq!(forget_all(&store).await, 1);
    assert_eq!(store.digest().await.unwrap().estimates, 0);
    assert_eq!(store.pending().await.unwrap(), 90, "all uploads but the voided one");
    let installations = |known: &[ComponentRecord]| -> Vec<_> {
        known.iter().map(|record| (record.installations.clone(), record.lives[0].found_failed_fh)).collect()
    };
    assert_eq!(installations(&components(&store).await), installations(&known), "these are there at once");
    let meanwhile = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    assert_eq!(meanwhile[0].prognosis, served[0].prognosis, "what was issued is served until there is more");
    drain(&store).await;
    assert_eq!(store.digest().await.unwrap(), digest);
    assert_eq!(components(&store).await, known);
    let aside = store.upload(&operator(), &"odd".parse().unwrap()).await.unwrap().unwrap();
    assert!(matches!(aside.state, store::UploadState::SetAside { .. }), "{:?}", aside.state);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_rebuild_goes_on_behind_the_component_where_it_was_interrupted(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for i in 0..120 {
        store.accept(&operator(), upload(&format!("u{i}"), &format!("{i:04}")), day(0.0)).await.unwrap();
    }
    store.accept(&"elsewhere".parse().unwrap(), upload("u1", "0001"), day(0.0)).await.unwrap();
    drain(&store).await;
    let digest = store.digest().await.unwrap();
    let first = store.forget_derived(None, day(1.0)).await.unwrap().unwrap();
    assert_eq!(first, component("0049"));
    assert_eq!(store.pending().await.unwrap(), 50);
    let second = store.forget_derived(Some(&first), day(1.0)).await.unwrap().unwrap();
    assert_eq!((second, store.pending().await.unwrap()), (component("0099"), 100));
    let third = store.forget_derived(Some(&component("0099")), day(1.0)).await.unwrap().unwrap();
    let fourth = store.forget_derived(Some(&third), day(1.0)).await.unwrap().unwrap();
    assert_eq!(fourth.operator.as_str(), "elsewhere");
    assert_eq!(store.forget_derived(Some(&fourth), day(1.0)).await.unwrap(), None);
    assert_eq!(store.pending().await.unwrap(), 121);
    drain(&store).await;
    assert_eq!(store.digest().await.unwrap(), digest);
}
