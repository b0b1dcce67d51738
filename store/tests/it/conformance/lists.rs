use domain::{InstallationSource, OperatorId, SetAsideReason, Upload, UploadId, UploadStateKind};
use store::{Installation, InstalledTail, LifeCursor, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, INCREDIBLE_FH, bundle, by_hand, component, day, drain, estimate, later_upload, lease, life_inputs,
    operator, results, set_aside, tail, upload,
};

/// All of a state, in pages of a size.
async fn paged(store: &Store, operator: &OperatorId, state: UploadStateKind, limit: u32) -> Vec<String> {
    let (mut names, mut after) = (Vec::new(), None::<UploadId>);
    loop {
        let page = store.uploads(operator, state, after.as_ref(), limit).await.unwrap();
        assert!(page.len() <= limit as usize);
        assert!(page.iter().all(|record| record.state.kind() == state));
        let Some(last) = page.last() else { return names };
        after = Some(last.upload.upload_id.clone());
        names.extend(page.iter().map(|record| record.upload.upload_id.to_string()));
    }
}

fn name(state: &str, serial: &str, i: i32) -> String {
    format!("{state}-{serial}-{i}")
}

async fn accept(store: &Store, state: &str, serial: &str, i: i32) {
    let upload = later_upload(&name(state, serial, i), serial, f64::from(i));
    let flight_hours = if state == "excluded" { INCREDIBLE_FH } else { upload.flight_hours };
    store.accept(&operator(), Upload { flight_hours, ..upload }, day(0.0)).await.unwrap();
}

/// Two units with three uploads in each state, and one of each excluded.
async fn with_every_state(store: &Store) {
    for serial in ["0001", "0002"] {
        for i in [2, 0, 1] {
            for state in ["processed", "voided", "aside"] {
                accept(store, state, serial, i).await;
            }
        }
        accept(store, "excluded", serial, 9).await;
        let lease = lease(store).await;
        let mut results = results(&life_inputs(store, &lease).await);
        results.estimates.retain(|estimate| !estimate.upload_id.as_str().starts_with("aside"));
        let aside = (0..3).map(|i| set_aside(&name("aside", serial, i), SetAsideReason::NotFinite));
        results.set_aside = aside.collect();
        store.complete(&lease, vec![results]).await.unwrap();
        for i in 0..3 {
            let voided = name("voided", serial, i).parse().unwrap();
            store.void_upload(&operator(), &voided, by_hand(0.0)).await.unwrap();
        }
        drain(store).await;
    }
    for (serial, i) in [("0002", 1), ("0001", 0), ("0001", 2), ("0002", 2), ("0001", 1), ("0002", 0)] {
        accept(store, "pending", serial, i).await;
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn uploads_of_each_state_are_paged_by_component_and_time(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    with_every_state(&store).await;
    let of = |states: &[(&str, i32)]| {
        let serials = ["0001", "0002"].into_iter();
        serials.flat_map(|serial| states.iter().map(move |(state, i)| name(state, serial, *i))).collect()
    };
    let three = |state| of(&[(state, 0), (state, 1), (state, 2)]);
    let expected: [(UploadStateKind, Vec<String>); 4] = [
        (UploadStateKind::Pending, three("pending")),
        (UploadStateKind::Processed, three("processed")),
        (UploadStateKind::Voided, three("voided")),
        (UploadStateKind::SetAside, of(&[("aside", 0), ("aside", 1), ("aside", 2), ("excluded", 9)])),
    ];
    for (state, names) in expected {
        for limit in [1, 2, 3, 100] {
            assert_eq!(paged(&store, &operator(), state, limit).await, names, "{state:?} in pages of {limit}");
        }
        assert!(paged(&store, &"other".parse().unwrap(), state, 10).await.is_empty());
        let unknown = store.uploads(&operator(), state, Some(&"unknown".parse().unwrap()), 10).await.unwrap();
        assert_eq!(unknown, []);
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_list_says_of_an_upload_what_is_said_of_it_alone(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    with_every_state(&store).await;
    use UploadStateKind::{Pending, Processed, SetAside, Voided};
    for state in [Pending, Processed, SetAside, Voided] {
        for record in store.uploads(&operator(), state, None, 100).await.unwrap() {
            assert_eq!(store.upload(&operator(), &record.upload.upload_id).await.unwrap(), Some(record));
        }
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_component_tells_its_lives_and_where_it_was(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    assert_eq!(store.component(&component("0001")).await.unwrap(), None);
    let elsewhere = Upload { tail: tail("EC-MXB"), ..later_upload("u3", "0001", 30.0) };
    let odd = Upload { flight_hours: INCREDIBLE_FH, ..later_upload("odd", "0001", 31.0) };
    let uploads = [later_upload("u2", "0001", 20.0), elsewhere, later_upload("u1", "0001", 10.0), odd];
    for (i, upload) in uploads.iter().enumerate() {
        store.accept(&operator(), upload.clone(), day(i as f64)).await.unwrap();
    }
    let fresh = store.component(&component("0001")).await.unwrap().unwrap();
    assert_eq!((&fresh.lives[0].first, &fresh.lives[0].last), (&None, &None));
    drain(&store).await;
    let record = store.component(&component("0001")).await.unwrap().unwrap();
    assert_eq!((record.enrolled_at, record.lives.len()), (day(0.0), 1));
    let life = &record.lives[0];
    assert_eq!((life.overhaul_index, life.generation.number, life.generation.model), (0, 1, bundle("one").hash));
    let place = |upload: &Upload| Some(LifeCursor::from(&estimate(upload, bundle("one").hash)));
    assert_eq!((&life.first, &life.last), (&place(&uploads[2]), &place(&uploads[1])), "the odd one does not count");
    assert_eq!(record.installations, store.installations(&component("0001")).await.unwrap());
    let position = upload("any", "0001").position;
    let first = Installation {
        tail: tail("EC-MXA"),
        position,
        from: day(1.0),
        to: Some(day(3.0)),
        source: InstallationSource::Uploads,
    };
    assert_eq!(record.installations[0], first);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_fleet_is_all_its_tails_asked_for_at_once(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for (i, name) in ["EC-C", "EC-A", "EC-D", "EC-B"].into_iter().enumerate() {
        for (n, position) in ["FLAP-L", "AIL-R", "AIL-L"].into_iter().enumerate() {
            for flight in 0..=(4 * i) {
                let seen = Upload {
                    tail: tail(name),
                    position: position.parse().unwrap(),
                    ..later_upload(&format!("u{i}-{n}-{flight}"), &format!("{i}{n}"), 50.0 * flight as f64)
                };
                store.accept(&operator(), seen, day(0.0)).await.unwrap();
            }
        }
    }
    // A tail whose only unit has moved on.
    for (tail_name, at) in [("EC-BB", 1.0), ("EC-A", 2.0)] {
        let position = "RUD".parse().unwrap();
        let seen = Upload { tail: tail(tail_name), position, recorded_at: day(at), ..upload(tail_name, "moving") };
        store.accept(&operator(), seen, day(0.0)).await.unwrap();
    }
    drain(&store).await;
    store.accept(&operator(), Upload { tail: tail("EC-C"), ..upload("waits", "00") }, day(0.0)).await.unwrap();
    let mut expected = Vec::new();
    for name in ["EC-A", "EC-B", "EC-BB", "EC-C", "EC-D"] {
        let installed = store.installed(&operator(), &tail(name)).await.unwrap();
        expected.push(InstalledTail { tail: tail(name), installed });
    }
    assert!(expected[1].installed[0].utilisation_fh_per_day.is_some());
    assert!(expected[2].installed.is_empty());
    assert_eq!(store.installed_fleet(&operator(), None, 100).await.unwrap(), expected);
    assert_eq!(store.installed_fleet(&operator(), None, 2).await.unwrap(), expected[..2]);
    assert_eq!(store.installed_fleet(&operator(), Some(&tail("EC-B")), 2).await.unwrap(), expected[2..4]);
    assert_eq!(store.installed_fleet(&operator(), Some(&tail("EC-D")), 2).await.unwrap(), []);
    assert_eq!(store.installed_fleet(&"other".parse().unwrap(), None, 2).await.unwrap(), []);
}
