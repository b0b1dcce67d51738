use std::collections::BTreeMap;

use domain::{InstallationSource, OperatorId, Upload};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{Installation, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, component, day, drain, later_upload, operator, tail, upload,
};

async fn accept(store: &Store, id: &str, serial: &str, place: (&str, &str), at: f64) {
    let seen =
        Upload { tail: tail(place.0), position: place.1.parse().unwrap(), recorded_at: day(at), ..upload(id, serial) };
    store.accept(&operator(), seen, day(at)).await.unwrap();
}

/// (position, serial number, days since day 0) of what is installed on a tail.
async fn installed(store: &Store, tail_name: &str) -> Vec<(String, String, f64)> {
    let installed = store.installed(&operator(), &tail(tail_name)).await.unwrap();
    let plain = installed
        .into_iter()
        .map(|i| (i.position.to_string(), i.serial_number.to_string(), i.since.hours_since(day(0.0)) / 24.0));
    plain.collect()
}

fn at(position: &str, serial: &str, since: f64) -> (String, String, f64) {
    (position.to_owned(), serial.to_owned(), since)
}

const LEFT: (&str, &str) = ("EC-MXA", "AIL-L");
const RIGHT: (&str, &str) = ("EC-MXA", "AIL-R");

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_component_seen_last_is_installed(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "old", LEFT, 1.0).await;
    accept(&store, "u2", "new", LEFT, 5.0).await;
    assert_eq!(installed(&store, "EC-MXA").await, [at("AIL-L", "new", 5.0)]);
    let history = store.installations(&component("old")).await.unwrap();
    let left = upload("any", "old").position;
    assert_eq!(
        history,
        [Installation {
            tail: tail("EC-MXA"),
            position: left,
            from: day(1.0),
            to: Some(day(5.0)),
            source: InstallationSource::Uploads
        }]
    );
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_late_upload_of_the_old_unit_does_not_reinstall_it(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "new", LEFT, 5.0).await;
    accept(&store, "u2", "old", LEFT, 1.0).await;
    accept(&store, "u3", "old", LEFT, 4.0).await;
    assert_eq!(installed(&store, "EC-MXA").await, [at("AIL-L", "new", 5.0)]);
    let history = store.installations(&component("old")).await.unwrap();
    assert_eq!(history.iter().map(|i| (i.from, i.to)).collect::<Vec<_>>(), [(day(1.0), Some(day(5.0)))]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_component_seen_elsewhere_has_left_its_place(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001", LEFT, 1.0).await;
    accept(&store, "u2", "0001", RIGHT, 3.0).await;
    assert_eq!(installed(&store, "EC-MXA").await, [at("AIL-R", "0001", 3.0)]);
    accept(&store, "u3", "0001", ("EC-MXB", "AIL-L"), 4.0).await;
    assert_eq!(installed(&store, "EC-MXA").await, []);
    assert_eq!(installed(&store, "EC-MXB").await, [at("AIL-L", "0001", 4.0)]);
    assert_eq!(store.tails(&operator(), None, 10).await.unwrap(), [tail("EC-MXA"), tail("EC-MXB")]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn one_position_is_the_same_as_among_all(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    accept(&store, "u1", "0001", LEFT, 1.0).await;
    accept(&store, "u2", "0002", RIGHT, 1.0).await;
    let all = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    for one in &all {
        let found = store.installed_at(&operator(), &one.tail, &one.position).await.unwrap();
        assert_eq!(found.as_ref(), Some(one));
    }
    let nothing = store.installed_at(&operator(), &tail("EC-MXA"), &"RUD".parse().unwrap()).await.unwrap();
    assert_eq!(nothing, None);
    assert_eq!(all.iter().map(|one| one.pending_uploads).collect::<Vec<_>>(), [1, 1]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn tails_are_paged_in_order(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for (i, name) in ["EC-C", "EC-A", "EC-D", "EC-B"].iter().enumerate() {
        accept(&store, &format!("u{i}"), &i.to_string(), (name, "AIL-L"), 1.0).await;
    }
    let first = store.tails(&operator(), None, 3).await.unwrap();
    assert_eq!(first, ["EC-A", "EC-B", "EC-C"].map(tail));
    assert_eq!(store.tails(&operator(), first.last(), 3).await.unwrap(), [tail("EC-D")]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn utilisation_is_hours_per_day_of_the_last_ninety_days(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let utilisation = async || {
        drain(&store).await;
        let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
        installed[0].utilisation_fh_per_day
    };
    // Ten hours a day; the clock of a hundred days ago says otherwise and is out of the window.
    let odd = Upload { flight_hours: 0.0, recorded_at: day(-150.0), ..upload("odd", "0001") };
    store.accept(&operator(), odd, day(0.0)).await.unwrap();
    store.accept(&operator(), later_upload("u0", "0001", 0.0), day(0.0)).await.unwrap();
    assert_eq!(utilisation().await, None);
    store.accept(&operator(), later_upload("u1", "0001", 120.0), day(0.0)).await.unwrap();
    assert_eq!(utilisation().await, None, "12 days say nothing");
    store.accept(&operator(), later_upload("u2", "0001", 140.0), day(0.0)).await.unwrap();
    assert!((utilisation().await.unwrap() - 10.0).abs() < 1e-9);
    // What the day has brought so far does not count yet.
    let fast = Upload { flight_hours: 160.0, ..later_upload("fast", "0001", 140.5) };
    store.accept(&operator(), fast, day(0.0)).await.unwrap();
    assert!((utilisation().await.unwrap() - 10.0).abs() < 1e-9);
    store.void_upload(&operator(), &"fast".parse().unwrap(), by_hand(0.0)).await.unwrap();
    // A swap: the new unit has other hours since new, the tail flies on at the same rate.
    for (id, hours) in [("u3", 141.0), ("u4", 341.0)] {
        let flown = later_upload(id, "0002", hours);
        let swapped = Upload { flight_hours: flown.flight_hours + 7000.0, ..flown };
        store.accept(&operator(), swapped, day(0.0)).await.unwrap();
    }
    assert!((utilisation().await.unwrap() - 10.0).abs() < 1e-9);
}

/// Unit, tail, position and time of a sighting, from few of each so that they collide.
pub type Sighting = (u8, u8, u8, u8);

pub fn sighted((i, (unit, tail_index, position, time)): (usize, Sighting)) -> Upload {
    Upload {
        tail: tail(&format!("T{tail_index}")),
        position: format!("P{position}").parse().unwrap(),
        recorded_at: day(f64::from(time)),
        ..upload(&format!("u{i:02}"), &unit.to_string())
    }
}

/// The definition, followed literally: go through all sightings in the order of time; each ends
/// what it contradicts.
pub fn by_definition(uploads: &[Upload]) -> BTreeMap<String, Vec<Installation>> {
    let mut ordered: Vec<_> = uploads.iter().collect();
    ordered.sort_by_key(|upload| (upload.recorded_at, upload.upload_id.clone()));
    let mut periods: Vec<(String, Installation)> = Vec::new();
    for upload in ordered {
        let serial = upload.serial_number.to_string();
        let here =
            |(_, period): &(String, Installation)| period.tail == upload.tail && period.position == upload.position;
        let open = |entry: &&mut (String, Installation)| entry.1.to.is_none();
        if periods.iter().any(|entry| entry.1.to.is_none() && here(entry) && entry.0 == serial) {
            continue;
        }
        for entry in periods.iter_mut().filter(open) {
            if here(entry) || entry.0 == serial {
                entry.1.to = Some(upload.recorded_at);
            }
        }
        let (tail, position) = (upload.tail.clone(), upload.position.clone());
        periods.push((
            serial,
            Installation { tail, position, from: upload.recorded_at, to: None, source: InstallationSource::Uploads },
        ));
    }
    let mut by_unit = BTreeMap::<String, Vec<Installation>>::new();
    for (serial, period) in periods {
        by_unit.entry(serial).or_default().push(period);
    }
    by_unit
}

pub async fn as_stored(
    store: &Store,
    operator: &OperatorId,
    uploads: &[Upload],
) -> BTreeMap<String, Vec<Installation>> {
    let mut by_unit = BTreeMap::new();
    for upload in uploads {
        let periods = store.installations(&upload.component(operator)).await.unwrap();
        by_unit.insert(upload.serial_number.to_string(), periods);
    }
    by_unit
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn installations_are_those_of_the_definition_in_any_order_of_arrival(backend: Backend) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let database = Database::new(backend);
    let store = runtime.block_on(database.ready());
    let cases = std::cell::Cell::new(0);
    let sightings = prop::collection::vec((0..3_u8, 0..2_u8, 0..2_u8, 0..10_u8), 1..16);
    let uploads = sightings.prop_map(|all| all.into_iter().enumerate().map(sighted).collect::<Vec<_>>());
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, cases: backend.cases(96), ..Default::default() });
    let outcome = runner.run(&uploads.prop_shuffle(), |uploads| {
        cases.set(cases.get() + 1);
        let operator: OperatorId = format!("case-{}", cases.get()).parse().unwrap();
        runtime.block_on(async {
            for upload in &uploads {
                store.accept(&operator, upload.clone(), day(0.0)).await.unwrap();
            }
            prop_assert_eq!(as_stored(&store, &operator, &uploads).await, by_definition(&uploads));
            Ok(())
        })
    });
    outcome.unwrap();
}
