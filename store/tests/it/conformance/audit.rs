use domain::{Act, Action, Actor, AuditRecord, Finding, OperatorId, SetAsideReason, Token};
use serde_json::{Value, json};
use store::{AuditChain, LifeResults, Retrial, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, bundle_body, by_hand, configuration, day, drain, fail, lease, life_inputs, operator, results,
    set_aside, tail, token, upload,
};

fn elsewhere() -> OperatorId {
    "elsewhere".parse().unwrap()
}

/// Someone other than the fixture's hand.
fn planner(on: f64) -> Act {
    Actor::Token(Token::issue([200; 32]).id).at(day(on))
}

async fn log(store: &Store, operator: Option<&OperatorId>) -> Vec<AuditRecord> {
    store.audit(operator, 0, 1000).await.unwrap()
}

fn acts(records: &[AuditRecord]) -> Vec<(Action, &str, Act)> {
    records.iter().map(|one| (one.action, one.subject.as_str(), one.actor.at(one.at))).collect()
}

/// Leaves an upload set aside.
async fn set_one_aside(store: &Store, id: &str) {
    store.accept(&operator(), upload(id, "0001"), day(0.0)).await.unwrap();
    let lease = lease(store).await;
    let inputs = life_inputs(store, &lease).await;
    let aside = vec![set_aside(id, SetAsideReason::NotEstimable)];
    let found = LifeResults { estimates: Vec::new(), set_aside: aside, ..results(&inputs) };
    let found = LifeResults { states: Vec::new(), prognosis: None, ..found };
    store.complete(&lease, vec![found]).await.unwrap();
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn every_administrative_act_leaves_one_record_and_only_what_changed_something(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let (one, two) = (bundle("one").hash.to_string(), bundle("two").hash.to_string());
    set_one_aside(&store, "u1").await;
    fail(&store, &operator(), "0001", 200.0).await;
    let (tail, configuration) = (tail("EC-MXA"), configuration(0.25));
    for _ in 0..2 {
        store.register_bundle(&bundle("two"), &bundle_body("two"), by_hand(1.0)).await.unwrap();
        let retried = store.retry_upload(&operator(), &"u1".parse().unwrap(), planner(2.0)).await.unwrap();
        assert!(matches!(retried, Some(Retrial::Retried | Retrial::NotSetAside { .. })));
        store.void_upload(&operator(), &"u1".parse().unwrap(), planner(3.0)).await.unwrap();
        store.void_event(&operator(), &"end-of-0001".parse().unwrap(), planner(4.0)).await.unwrap();
        store.add_sensor_configuration(&operator(), &tail, day(9.0), &configuration, planner(5.0)).await.unwrap();
    }
    store.activate_bundle(&bundle("two").hash, by_hand(6.0)).await.unwrap();
    assert_eq!(store.void_upload(&operator(), &"none".parse().unwrap(), planner(7.0)).await.unwrap(), None);
    assert!(store.activate_bundle(&domain::ContentHash::of(b"none"), by_hand(7.0)).await.is_err());

    let installation = log(&store, None).await;
    let expected = [
        (Action::ModelAdded, one.as_str(), by_hand(0.0)),
        (Action::ModelActivated, one.as_str(), by_hand(0.0)),
        (Action::ModelAdded, two.as_str(), by_hand(1.0)),
        (Action::ModelActivated, two.as_str(), by_hand(6.0)),
    ];
    assert_eq!(acts(&installation), expected);
    let own = log(&store, Some(&operator())).await;
    let expected = [
        (Action::UploadRetried, "u1", planner(2.0)),
        (Action::UploadVoided, "u1", planner(3.0)),
        (Action::EventVoided, "end-of-0001", planner(4.0)),
        (Action::SensorConfigurationAdded, "EC-MXA", planner(5.0)),
    ];
    assert_eq!(acts(&own), expected);
    assert_eq!(own[3].detail, json!({ "effective_from": day(9.0), "hash": configuration.id() }));
    assert_eq!(own[0].detail, Value::Null);
    assert_eq!(log(&store, Some(&elsewhere())).await, []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn chains_of_operators_and_of_the_installation_are_apart_and_whole(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for number in 0..5 {
        store.create_token(&token(&operator(), number).1, Actor::Cli).await.unwrap();
        store.create_token(&token(&elsewhere(), 100 + number).1, Actor::Cli).await.unwrap();
    }
    let mut chains = store.verify_audit().await.unwrap();
    chains.sort_by_key(|chain| chain.operator.clone());
    let mut expected = Vec::new();
    for operator in [None, Some(operator()), Some(elsewhere())] {
        let records = log(&store, operator.as_ref()).await;
        let mut previous = AuditRecord::origin(operator.as_ref());
        for (record, place) in records.iter().zip(1..) {
            assert_eq!((record.sequence, record.previous, &record.operator), (place, previous, &operator));
            previous = record.hash();
        }
        expected.push(AuditChain { operator, records: records.len() as u64, newest: previous, damage: None });
    }
    assert_eq!(chains, expected);
    assert_eq!(expected.iter().map(|chain| chain.records).collect::<Vec<_>>(), [2, 5, 5]);
    let page = store.audit(Some(&operator()), 2, 2).await.unwrap();
    assert_eq!(page, log(&store, Some(&operator())).await[2..4]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn acts_at_the_same_time_are_recorded_one_after_the_other(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let acts = (0..40).map(|number| {
        let store = store.clone();
        tokio::spawn(async move { store.create_token(&token(&operator(), number).1, Actor::Cli).await.unwrap() })
    });
    for act in acts.collect::<Vec<_>>() {
        act.await.unwrap();
    }
    let chains = store.verify_audit().await.unwrap();
    let own = chains.iter().find(|chain| chain.operator == Some(operator())).unwrap();
    assert_eq!((own.records, &own.damage), (40, &None));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_and_uploads_leave_no_record(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    drain(&store).await;
    let event = crate::fixture::finding("e1", "0001", Finding::Serviceable, 200.0);
    store.record_event(&operator(), &event, day(0.0)).await.unwrap();
    assert_eq!(log(&store, Some(&operator())).await, []);
}
