use std::cell::Cell;

use domain::{Component, EventId, Finding, MaintenanceEvent, OperatorId, Upload};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{EventReceipt, EventRecord, Store, StoreError, Voiding};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, component, day, drain, finding, operator, tail, upload,
};

async fn enrol(store: &Store, operator: &OperatorId, serial: &str) {
    store.accept(operator, upload(&format!("first-of-{serial}"), serial), day(0.0)).await.unwrap();
}

async fn record(store: &Store, event: &MaintenanceEvent) -> EventReceipt {
    store.record_event(&operator(), event, day(1.0)).await.unwrap()
}

async fn void(store: &Store, id: &str) -> Option<Voiding> {
    store.void_event(&operator(), &id.parse().unwrap(), by_hand(2.0)).await.unwrap()
}

/// At how many hours the component 0001 was found failed: as a component, and as installed.
async fn found_failed(store: &Store) -> Option<f64> {
    let record = store.component(&component("0001")).await.unwrap().unwrap();
    let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    let fleet = store.installed_fleet(&operator(), None, 10).await.unwrap();
    assert_eq!(installed, fleet[0].installed);
    assert_eq!(installed[0].found_failed_fh, record.lives[0].found_failed_fh);
    installed[0].found_failed_fh
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_event_is_recorded_once_and_its_name_is_taken_for_ever(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    enrol(&store, &operator(), "0001").await;
    let event = MaintenanceEvent {
        note: Some("jammed at −20 °C".to_owned()),
        ..finding("e1", "0001", Finding::Serviceable, 0.1 + 0.2)
    };
    let other = MaintenanceEvent { note: None, ..event.clone() };
    assert_eq!(record(&store, &event).await, EventReceipt::Recorded);
    let expected = EventRecord { event: event.clone(), received_at: day(1.0), voided_at: None };
    assert_eq!(store.event(&operator(), &event.event_id).await.unwrap(), Some(expected.clone()));
    for voided_at in [None, Some(day(2.0))] {
        assert_eq!(record(&store, &event).await, EventReceipt::Duplicate);
        assert_eq!(record(&store, &other).await, EventReceipt::Conflict);
        let expected = EventRecord { voided_at, ..expected.clone() };
        assert_eq!(store.events(&component("0001")).await.unwrap(), [expected]);
        void(&store, "e1").await;
    }
    assert_eq!(void(&store, "e1").await, Some(Voiding::AlreadyVoided));
    assert_eq!(void(&store, "unknown").await, None);
    assert_eq!(store.event(&operator(), &"unknown".parse().unwrap()).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_event_enrols_an_unknown_component(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let event = finding("e1", "0001", Finding::Failed, 200.0);
    let elsewhere: OperatorId = "elsewhere".parse().unwrap();
    enrol(&store, &elsewhere, "0001").await;
    assert!(!store.knows_component(&component("0001")).await.unwrap(), "operators are a wall");
    assert_eq!(record(&store, &event).await, EventReceipt::Enrolled);
    assert_eq!(record(&store, &event).await, EventReceipt::Duplicate);
    assert!(store.knows_component(&component("0001")).await.unwrap());
    let second = finding("e2", "0001", Finding::Serviceable, 100.0);
    assert_eq!(record(&store, &second).await, EventReceipt::Recorded);
    let known = store.component(&component("0001")).await.unwrap().unwrap();
    assert_eq!((known.enrolled_at, known.lives.len(), known.installations.len()), (day(1.0), 1, 0));
    let place = upload("any", "0001");
    assert!(!store.knows_place(&operator(), &place.tail, &place.position).await.unwrap(), "a finding moves nothing");
    enrol(&store, &operator(), "0001").await;
    drain(&store).await;
    assert!(store.knows_place(&operator(), &place.tail, &place.position).await.unwrap());
    assert_eq!(store.component(&component("0001")).await.unwrap().unwrap().enrolled_at, day(1.0));
    assert_eq!(found_failed(&store).await, Some(200.0));
    assert_eq!(store.void_event(&elsewhere, &event.event_id, by_hand(2.0)).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_event_that_would_not_read_back_is_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    enrol(&store, &operator(), "0001").await;
    let event = finding("e1", "0001", Finding::Failed, f64::NAN);
    let refused = store.record_event(&operator(), &event, day(1.0)).await;
    assert!(matches!(refused, Err(StoreError::Unrepresentable { .. })), "{refused:?}");
    assert_eq!(found_failed(&store).await, None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_first_finding_failed_ends_a_life_and_voiding_it_opens_it_again(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    enrol(&store, &operator(), "0001").await;
    let elsewhere = Upload { tail: tail("T2"), ..upload("elsewhere", "0002") };
    store.accept(&operator(), elsewhere, day(0.0)).await.unwrap();
    drain(&store).await;
    assert_eq!(found_failed(&store).await, None);
    for event in [
        finding("healthy", "0001", Finding::Serviceable, 150.0),
        finding("late", "0001", Finding::Failed, 300.0),
        finding("early", "0001", Finding::Failed, 200.0),
        finding("other", "0002", Finding::Failed, 50.0),
    ] {
        record(&store, &event).await;
    }
    for (voided, then) in [("healthy", Some(200.0)), ("early", Some(300.0)), ("late", None)] {
        assert_eq!(void(&store, voided).await, Some(Voiding::Voided));
        assert_eq!(found_failed(&store).await, then, "without {voided}");
    }
}

/// Hours and day of a finding, whether it says failed, and whether it is voided.
type Sketch = (u8, u8, bool, bool);

fn sketched((i, (hours, time, failed, _)): (usize, Sketch)) -> MaintenanceEvent {
    let outcome = if failed { Finding::Failed } else { Finding::Serviceable };
    let event = finding(&format!("e{i}"), "0001", outcome, 100.0 * f64::from(hours));
    MaintenanceEvent { occurred_at: day(f64::from(time)), ..event }
}

/// What counts, by definition: all events in their order, and the first of those that say failed.
fn by_definition(events: &[(MaintenanceEvent, bool)]) -> (Vec<(EventId, bool)>, Option<f64>) {
    let mut ordered: Vec<_> = events.iter().collect();
    ordered.sort_by(|(a, _), (b, _)| {
        let key = |event: &MaintenanceEvent| (event.occurred_at, event.event_id.clone());
        a.flight_hours.total_cmp(&b.flight_hours).then_with(|| key(a).cmp(&key(b)))
    });
    let failed = domain::EventKind::Finding(Finding::Failed);
    let end = ordered.iter().find(|(event, voided)| event.kind == failed && !voided);
    let names = ordered.iter().map(|(event, voided)| (event.event_id.clone(), *voided)).collect();
    (names, end.map(|(event, _)| event.flight_hours))
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn what_events_lead_to_does_not_depend_on_the_order_in_which_they_arrive(backend: Backend) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let database = Database::new(backend);
    let store = runtime.block_on(database.ready());
    let cases = Cell::new(0);
    let sketches = prop::collection::vec((0..4_u8, 0..3_u8, any::<bool>(), prop::bool::weighted(0.3)), 1..8);
    let events = sketches.prop_map(|all| {
        let voided: Vec<bool> = all.iter().map(|sketch| sketch.3).collect();
        all.into_iter().enumerate().map(sketched).zip(voided).collect::<Vec<_>>()
    });
    let arrivals = events.prop_flat_map(|events| {
        let delays = prop::collection::vec(0..4_usize, events.len());
        (Just(events).prop_shuffle(), delays)
    });
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, cases: backend.cases(64), ..Default::default() });
    let outcome = runner.run(&arrivals, |(events, delays)| {
        cases.set(cases.get() + 1);
        let operator: OperatorId = format!("case-{}", cases.get()).parse().unwrap();
        runtime.block_on(async {
            enrol(&store, &operator, "0001").await;
            for step in 0..events.len() + 4 {
                if let Some((event, _)) = events.get(step) {
                    store.record_event(&operator, event, day(1.0)).await.unwrap();
                }
                let due = |(i, delay): (usize, &usize)| (i + delay == step && events[i].1).then(|| &events[i].0);
                for event in delays.iter().enumerate().filter_map(due) {
                    store.void_event(&operator, &event.event_id, by_hand(2.0)).await.unwrap();
                }
            }
            let unit = Component { operator: operator.clone(), ..component("0001") };
            let stored = store.events(&unit).await.unwrap();
            let names = stored.into_iter().map(|one| (one.event.event_id, one.voided_at.is_some())).collect();
            let life = store.component(&unit).await.unwrap().unwrap().lives.remove(0);
            prop_assert_eq!((names, life.found_failed_fh), by_definition(&events));
            Ok(())
        })
    });
    outcome.unwrap();
}
