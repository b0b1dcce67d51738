//! Installs, removals and overhauls: what follows from them is a function of the sets of uploads, events and
//! voids, and the one that a literal reading of the definitions gives.

use std::cell::Cell;

use domain::{
    Component, EventKind, Finding, InstallationSource, MaintenanceEvent, OperatorId, Timestamp, Upload, WarningKind,
};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{LifeRecord, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, by_hand, component, day, drain, finding, later_upload, operator, serve, tail, upload,
};

fn event(id: &str, serial: &str, kind: EventKind, flight_hours: f64) -> MaintenanceEvent {
    MaintenanceEvent { kind, ..finding(id, serial, Finding::Failed, flight_hours) }
}

async fn record(store: &Store, event: &MaintenanceEvent) {
    store.record_event(&operator(), event, day(50.0)).await.unwrap();
}

async fn lives(store: &Store) -> Vec<LifeRecord> {
    store.component(&component("0001")).await.unwrap().unwrap().lives
}

/// Hours of the estimates of a life.
async fn hours(store: &Store, life: u32) -> Vec<f64> {
    let estimates = store.estimates(&component("0001"), Some(life), None, None, None, 1000).await.unwrap();
    estimates.into_iter().map(|estimate| estimate.flight_hours).collect()
}

/// Ten uploads, from 100 to 190 flight hours.
async fn flown(store: &Store) {
    for i in 0..10 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
        drain(store).await;
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_overhaul_begins_a_life_without_history_and_leaves_the_old_one_as_it_was(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    flown(&store).await;
    let old = store.states(&component("0001"), None, None, None, None, 100).await.unwrap();
    record(&store, &finding("failed", "0001", Finding::Failed, 190.0)).await;
    let issued = store.issued_on_finished_lives(&operator(), 20.0, 10).await.unwrap();
    record(&store, &event("overhaul", "0001", EventKind::Overhaul, 190.0)).await;
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap().remove(0);
    assert_eq!((installed.overhaul_index, &installed.prognosis, installed.found_failed_fh), (1, &None, None));
    assert_eq!(store.pending().await.unwrap(), 0, "nothing is estimated again");
    drain(&store).await;
    assert_eq!(store.states(&component("0001"), Some(0), None, None, None, 100).await.unwrap(), old);
    assert_eq!(store.issued_on_finished_lives(&operator(), 20.0, 10).await.unwrap(), issued);
    let known = lives(&store).await;
    assert_eq!(known.iter().map(|life| life.found_failed_fh).collect::<Vec<_>>(), [Some(190.0), None]);
    assert_eq!(known[1].began.as_ref().unwrap().flight_hours, 190.0);
    store.accept(&operator(), later_upload("next", "0001", 95.0), day(0.0)).await.unwrap();
    drain(&store).await;
    assert_eq!((hours(&store, 0).await.len(), hours(&store, 1).await), (10, vec![195.0]));
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap().remove(0);
    assert_eq!(installed.prognosis.unwrap().as_of.flight_hours, 195.0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_overhaul_that_is_told_late_parts_what_came_since_and_withdraws_what_rested_on_it(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    flown(&store).await;
    let before = store.digest().await.unwrap();
    record(&store, &finding("failed", "0001", Finding::Failed, 200.0)).await;
    let forecasts = async || -> Vec<f64> {
        let lives = store.issued_on_finished_lives(&operator(), 10.0, 10).await.unwrap();
        lives.iter().flat_map(|life| &life.prognoses).map(|one| one.as_of.flight_hours).collect()
    };
    assert_eq!(forecasts().await.len(), 10);
    record(&store, &event("overhaul", "0001", EventKind::Overhaul, 145.0)).await;
    assert_eq!(store.pending().await.unwrap(), 5);
    assert_eq!(forecasts().await, [0.0; 0], "the finding is of the new life, of which nothing was forecast");
    drain(&store).await;
    assert_eq!(hours(&store, 0).await, [100.0, 110.0, 120.0, 130.0, 140.0]);
    assert_eq!(hours(&store, 1).await, [150.0, 160.0, 170.0, 180.0, 190.0]);
    let found: Vec<_> = lives(&store).await.iter().map(|life| life.found_failed_fh).collect();
    assert_eq!(found, [None, Some(200.0)]);
    store.void_event(&operator(), &"overhaul".parse().unwrap(), by_hand(60.0)).await.unwrap();
    drain(&store).await;
    assert_eq!(store.digest().await.unwrap(), before);
    let left = forecasts().await;
    assert_eq!(left[..5], [100.0, 110.0, 120.0, 130.0, 140.0], "they rested on nothing else");
    assert_eq!(left[5..], [190.0], "those of the other life are withdrawn for good");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_of_a_lease_from_before_an_overhaul_are_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    flown(&store).await;
    store.accept(&operator(), later_upload("next", "0001", 95.0), day(0.0)).await.unwrap();
    let lease = store.lease(crate::fixture::LEASE).await.unwrap().unwrap();
    record(&store, &event("overhaul", "0001", EventKind::Overhaul, 145.0)).await;
    assert_eq!(serve(&store, &lease).await, store::Completion::Fenced);
    drain(&store).await;
    assert_eq!(hours(&store, 1).await.last(), Some(&195.0));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn lives_that_were_over_before_they_failed_are_told_apart_from_those_that_go_on(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    flown(&store).await;
    let part = component("0001").part_number;
    let removed = async || -> Vec<(u32, usize)> {
        let lives = store.removed_lives(&operator(), &part, &bundle("one").hash).await.unwrap();
        assert!(lives.iter().all(|one| one.estimates.iter().all(|seen| seen.flight_hours >= one.began_fh)));
        lives.iter().map(|one| (one.life.overhaul_index, one.estimates.len())).collect()
    };
    let flown = hours(&store, 0).await.len();
    assert_eq!(removed().await, [], "it goes on");
    record(&store, &event("overhaul", "0001", EventKind::Overhaul, 145.0)).await;
    drain(&store).await;
    let before = removed().await;
    assert!(matches!(before[..], [(0, seen)] if seen > 0 && seen < flown), "{before:?} of {flown}");
    record(&store, &event("out", "0001", EventKind::Remove, 195.0)).await;
    let taken_out = removed().await;
    assert_eq!((taken_out[0], taken_out[1].0), (before[0], 1));
    assert_eq!(taken_out[0].1 + taken_out[1].1, flown);
    record(&store, &finding("failed", "0001", Finding::Failed, 196.0)).await;
    assert_eq!(removed().await, before, "the second life failed");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_swap_empties_a_position_and_fills_it(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    flown(&store).await;
    let installed = async || -> Vec<String> {
        let all = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
        all.into_iter().map(|one| one.serial_number.to_string()).collect()
    };
    record(&store, &event("out", "0001", EventKind::Remove, 195.0)).await;
    assert_eq!(installed().await, [""; 0]);
    let place = upload("any", "0001");
    assert!(store.knows_place(&operator(), &place.tail, &place.position).await.unwrap());
    record(&store, &event("in", "0002", EventKind::Install, 196.0)).await;
    assert_eq!(installed().await, ["0002"]);
    let told = store.installations(&component("0002")).await.unwrap();
    assert_eq!((told.len(), told[0].source, told[0].to), (1, InstallationSource::Event, None));
    let late = later_upload("late", "0001", 99.0);
    store.accept(&operator(), late.clone(), day(0.0)).await.unwrap();
    assert_eq!(installed().await, ["0002"], "an install holds whatever uploads say");
    let contradictions = store.component(&component("0001")).await.unwrap().unwrap().contradictions;
    let told = contradictions.iter().find(|one| one.warning.kind == WarningKind::InstallContradicted).unwrap();
    assert_eq!((&told.upload_id, &told.event_id), (&Some(late.upload_id.clone()), &Some("in".parse().unwrap())));
    assert!(told.warning.detail.contains("0002"), "{told:?}");
    store.void_event(&operator(), &"in".parse().unwrap(), by_hand(60.0)).await.unwrap();
    assert_eq!(installed().await, ["0001"], "seen there again after its removal");
    store.void_upload(&operator(), &late.upload_id, by_hand(60.0)).await.unwrap();
    assert_eq!(installed().await, [""; 0]);
}

/// Uploads and events, each with whether it is voided.
#[derive(Debug, Clone)]
struct Sets {
    uploads: Vec<(Upload, bool)>,
    events: Vec<(MaintenanceEvent, bool)>,
}

const UNITS: [&str; 3] = ["0", "1", "2"];
const KINDS: [EventKind; 5] = [
    EventKind::Install,
    EventKind::Remove,
    EventKind::Overhaul,
    EventKind::Finding(Finding::Failed),
    EventKind::Finding(Finding::Serviceable),
];

/// Unit, tail, hours (few, so that they collide), and whether it is voided. Each upload has a time of its own, events
/// share some.
type Sketch = (usize, u8, u8, bool);

fn sets() -> impl Strategy<Value = Sets> {
    let sketch = || (0..3_usize, 0..2_u8, 0..6_u8, prop::bool::weighted(0.2));
    let uploads = prop::collection::vec(sketch(), 0..14);
    let events = prop::collection::vec((sketch(), 0..5_usize), 0..10);
    let times = Just((0..24_u8).collect::<Vec<_>>()).prop_shuffle();
    (uploads, events, times).prop_map(|(uploads, events, times)| {
        let placed = |i: usize, (unit, tail_index, hours, _): Sketch| Upload {
            tail: tail(&format!("T{tail_index}")),
            flight_hours: 10.0 * f64::from(hours),
            recorded_at: day(f64::from(times[i])),
            ..upload(&format!("u{i:02}"), UNITS[unit])
        };
        let told = |i: usize, (sketch, kind): (Sketch, usize)| {
            let Upload { tail, position, flight_hours, recorded_at, serial_number, .. } = placed(14 + i / 2, sketch);
            let named = event(&format!("e{i:02}"), serial_number.as_str(), KINDS[kind], flight_hours);
            (MaintenanceEvent { tail, position, occurred_at: recorded_at, ..named }, sketch.3)
        };
        Sets {
            uploads: uploads.into_iter().enumerate().map(|(i, sketch)| (placed(i, sketch), sketch.3)).collect(),
            events: events.into_iter().enumerate().map(|(i, sketch)| told(i, sketch)).collect(),
        }
    })
}

/// What reaches the store, by index.
#[derive(Debug, Clone, Copy)]
enum Input {
    Upload(usize),
    Event(usize),
    VoidUpload(usize),
    VoidEvent(usize),
}

fn inputs(sets: &Sets) -> Vec<Input> {
    let mut inputs = Vec::new();
    for (i, (_, voided)) in sets.uploads.iter().enumerate() {
        inputs.extend([Input::Upload(i), Input::Upload(i)]);
        inputs.extend(voided.then_some(Input::VoidUpload(i)));
    }
    for (i, (_, voided)) in sets.events.iter().enumerate() {
        inputs.extend([Input::Event(i), Input::Event(i)]);
        inputs.extend(voided.then_some(Input::VoidEvent(i)));
    }
    inputs
}

/// The inputs in some order, each with whether the worker runs after it.
fn way(sets: &Sets) -> impl Strategy<Value = Vec<(Input, bool)>> + use<> {
    let inputs = inputs(sets);
    let runs = prop::collection::vec(any::<bool>(), inputs.len());
    (Just(inputs).prop_shuffle(), runs).prop_map(|(inputs, runs)| inputs.into_iter().zip(runs).collect())
}

async fn play(store: &Store, operator: &OperatorId, sets: &Sets, way: &[(Input, bool)]) {
    let mut early = Vec::new();
    for &(input, runs) in way {
        if !feed(store, operator, sets, input).await {
            early.push(input);
        }
        if runs {
            drain(store).await;
        }
    }
    for input in early {
        assert!(feed(store, operator, sets, input).await);
    }
    drain(store).await;
}

/// Whether it could be done: only what is there can be voided.
async fn feed(store: &Store, operator: &OperatorId, sets: &Sets, input: Input) -> bool {
    match input {
        Input::Upload(i) => drop(store.accept(operator, sets.uploads[i].0.clone(), day(0.0)).await.unwrap()),
        Input::Event(i) => drop(store.record_event(operator, &sets.events[i].0, day(0.0)).await.unwrap()),
        Input::VoidUpload(i) => {
            let id = &sets.uploads[i].0.upload_id;
            return store.void_upload(operator, id, by_hand(0.0)).await.unwrap().is_some();
        }
        Input::VoidEvent(i) => {
            let id = &sets.events[i].0.event_id;
            return store.void_event(operator, id, by_hand(0.0)).await.unwrap().is_some();
        }
    }
    true
}

/// A life: the overhaul that began it, its uploads in their order, and the hours at which it was found failed.
type Life = (Option<String>, Vec<String>, Option<f64>);

async fn stored_lives(store: &Store, unit: &Component) -> Vec<Life> {
    let Some(record) = store.component(unit).await.unwrap() else { return Vec::new() };
    let mut lives = Vec::new();
    for life in record.lives {
        let of_life = Some(life.overhaul_index);
        let estimates = store.estimates(unit, of_life, None, None, None, 1000).await.unwrap();
        let states = store.states(unit, of_life, None, None, None, 1000).await.unwrap();
        assert_eq!(states, crate::fixture::states(&estimates), "states of a life rest on its estimates");
        let uploads = estimates.into_iter().map(|estimate| estimate.upload_id.into()).collect();
        lives.push((life.began.map(|began| began.event_id.into()), uploads, life.found_failed_fh));
    }
    lives
}

/// The lives of a component by the definition, from the sets.
fn defined_lives(sets: &Sets, unit: &Component) -> Vec<Life> {
    let serial = &unit.serial_number;
    let known = sets.uploads.iter().any(|(upload, _)| upload.serial_number == *serial)
        || sets.events.iter().any(|(event, _)| event.serial_number == *serial);
    if !known {
        return Vec::new();
    }
    let events = || sets.events.iter().filter(|(event, voided)| event.serial_number == *serial && !voided);
    let key = |event: &MaintenanceEvent| (event.flight_hours, event.occurred_at);
    let mut overhauls: Vec<_> =
        events().map(|(event, _)| event).filter(|event| event.kind == EventKind::Overhaul).collect();
    overhauls.sort_by(|a, b| (key(a), &a.event_id).partial_cmp(&(key(b), &b.event_id)).unwrap());
    let life_at = |hours: f64, at: Timestamp| overhauls.iter().filter(|one| key(one) < (hours, at)).count();
    (0..=overhauls.len())
        .map(|life| {
            let mut uploads: Vec<_> = sets
                .uploads
                .iter()
                .filter(|(upload, voided)| {
                    !voided
                        && upload.serial_number == *serial
                        && life_at(upload.flight_hours, upload.recorded_at) == life
                })
                .map(|(upload, _)| (upload.flight_hours, upload.recorded_at, upload.upload_id.to_string()))
                .collect();
            uploads.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let failed = events().map(|(event, _)| event).filter(|event| {
                event.kind == EventKind::Finding(Finding::Failed)
                    && life_at(event.flight_hours, event.occurred_at) == life
            });
            let failed = failed.map(|event| event.flight_hours).min_by(f64::total_cmp);
            let began = life.checked_sub(1).map(|before| overhauls[before].event_id.to_string());
            (began, uploads.into_iter().map(|(_, _, id)| id).collect(), failed)
        })
        .collect()
}

/// The order of events that move something: at one time removals come first.
type Key = (Timestamp, bool, String);

/// After all that is of a time.
fn end_of(at: Timestamp) -> Key {
    (at, true, "~".to_owned())
}

/// What moves something, in no order.
fn moves(sets: &Sets) -> impl Iterator<Item = (Key, &MaintenanceEvent)> {
    let moving = |(event, voided): &&(MaintenanceEvent, bool)| {
        !voided && matches!(event.kind, EventKind::Install | EventKind::Remove)
    };
    let key =
        |event: &MaintenanceEvent| (event.occurred_at, event.kind == EventKind::Install, event.event_id.to_string());
    sets.events.iter().filter(moving).map(move |(event, _)| (key(event), event))
}

/// Where a component is told to be after a moment: by an install that nothing has ended.
fn told_at(sets: &Sets, serial: &str, until: &Key) -> Option<String> {
    let ends = |install: &MaintenanceEvent, event: &MaintenanceEvent| {
        let (own, here) = (event.serial_number == install.serial_number, event.tail == install.tail);
        if event.kind == EventKind::Install { own != here } else { own && here }
    };
    let stands = |(at, install): &(Key, &MaintenanceEvent)| {
        install.kind == EventKind::Install
            && install.serial_number.as_str() == serial
            && at <= until
            && !moves(sets).any(|(then, event)| then > *at && then <= *until && ends(install, event))
    };
    moves(sets).find(stands).map(|(_, install)| install.tail.to_string())
}

/// Where a component is at a time, by the definition: where it is told to be; else where its newest upload
/// saw it, unless since then another one was seen or told there, or something was told of it.
fn defined_place(sets: &Sets, serial: &str, at: Timestamp) -> Option<String> {
    if let Some(told) = told_at(sets, serial, &end_of(at)) {
        return Some(told);
    }
    let seen = || sets.uploads.iter().filter(|(one, voided)| !voided && one.recorded_at <= at).map(|(one, _)| one);
    let last = seen().filter(|one| one.serial_number.as_str() == serial).max_by_key(|one| one.recorded_at)?;
    let displaced = seen().any(|one| {
        one.tail == last.tail && one.serial_number != last.serial_number && one.recorded_at > last.recorded_at
    });
    let place = last.tail.to_string();
    let mut since = moves(sets).filter(|((time, ..), _)| *time > last.recorded_at && *time <= at);
    let removed = since.any(|(_, event)| {
        event.kind == EventKind::Remove && event.serial_number.as_str() == serial && event.tail == last.tail
    });
    let since = moves(sets).map(|(key, _)| key).filter(|(time, ..)| *time > last.recorded_at && *time <= at);
    let told = since.chain([end_of(last.recorded_at)]).any(|moment| {
        told_at(sets, serial, &moment).is_some()
            || UNITS.iter().any(|other| told_at(sets, other, &moment).as_ref() == Some(&place))
    });
    (!displaced && !told && !removed).then_some(place)
}

async fn check(store: &Store, operator: &OperatorId, sets: &Sets) -> Result<(), TestCaseError> {
    for serial in UNITS {
        let unit = upload("any", serial).component(operator);
        prop_assert_eq!(stored_lives(store, &unit).await, defined_lives(sets, &unit), "lives of {}", serial);
        let installations = store.installations(&unit).await.unwrap();
        for time in 0..24_u8 {
            let at = day(f64::from(time));
            let here = installations.iter().filter(|one| one.from <= at && one.to.is_none_or(|to| to > at));
            let here: Vec<String> = here.map(|one| one.tail.to_string()).collect();
            let expected: Vec<String> = defined_place(sets, serial, at).into_iter().collect();
            prop_assert_eq!(here, expected, "{} at time {}", serial, time);
        }
    }
    Ok(())
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn lives_and_installations_are_those_of_the_definitions_in_any_order(backend: Backend) {
    in_any_order(backend, backend.cases(12));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn slow_lives_and_installations_are_those_of_the_definitions_in_many_more_orders(backend: Backend) {
    in_any_order(backend, backend.cases(96));
}

fn in_any_order(backend: Backend, cases: u32) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let mut runner = TestRunner::new(ProptestConfig { failure_persistence: None, cases, ..Default::default() });
    let databases = [Database::new(backend), Database::new(backend)];
    let [one, other] = [0, 1].map(|i| runtime.block_on(databases[i].ready()));
    let case = Cell::new(0);
    let ways = sets().prop_flat_map(|sets| {
        let ways = (way(&sets), way(&sets));
        (Just(sets), ways)
    });
    let outcome = runner.run(&ways, |(sets, (first, second))| {
        case.set(case.get() + 1);
        let operator: OperatorId = format!("case-{}", case.get()).parse().unwrap();
        runtime.block_on(async {
            play(&one, &operator, &sets, &first).await;
            check(&one, &operator, &sets).await?;
            play(&other, &operator, &sets, &second).await;
            check(&other, &operator, &sets).await?;
            prop_assert_eq!(one.digest().await.unwrap(), other.digest().await.unwrap());
            Ok(())
        })
    });
    outcome.unwrap();
}
