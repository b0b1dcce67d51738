use domain::{Action, Actor, Plan, Upload};
use store::{Completion, Planned, Store, TailPlan};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, LEASE, by_hand, component, day, drain, finding, later_upload, lease, life_inputs, operator, plan,
    results, tail,
};
use domain::{EventKind, Finding, MaintenanceEvent};

/// Sets a plan on day 50.
async fn set(store: &Store, tail_name: &str, plan: &Plan) -> TailPlan {
    store.set_plan(&operator(), &tail(tail_name), plan, by_hand(50.0)).await.unwrap()
}

/// Components 0001 on EC-MXA and 0002 on EC-MXB, with 20 days of data and nothing that waits.
async fn two_tails(store: &Store) {
    for i in 0..20 {
        let hours = 10.0 * f64::from(i);
        store.accept(&operator(), later_upload(&format!("a{i}"), "0001", hours), day(0.0)).await.unwrap();
        let other = Upload { tail: tail("EC-MXB"), ..later_upload(&format!("b{i}"), "0002", hours) };
        store.accept(&operator(), other, day(0.0)).await.unwrap();
    }
    drain(store).await;
}

/// What the component that waits alone is computed from, as it is planned.
async fn planned(store: &Store, serial: &str) -> Option<Planned> {
    let lease = lease(store).await;
    assert_eq!(lease.component, component(serial));
    let inputs = life_inputs(store, &lease).await;
    assert_eq!(inputs.unestimated, [], "no upload is estimated again");
    assert_eq!(store.complete(&lease, vec![results(&inputs)]).await.unwrap(), Completion::Done);
    assert_eq!(store.lease(LEASE).await.unwrap(), None, "nothing else waits");
    inputs.planned
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_newest_version_is_in_force_and_all_are_kept(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let of = async |operator: &str| store.plan(&operator.parse().unwrap(), &tail("EC-MXA")).await.unwrap();
    let name = operator().to_string();
    assert_eq!(of(&name).await, None);
    let first = set(&store, "EC-MXA", &plan(4.0)).await;
    assert_eq!((first.version, first.set_at, first.set_by, &first.plan), (1, day(50.0), Actor::Cli, &plan(4.0)));
    let second = store.set_plan(&operator(), &tail("EC-MXA"), &plan(5.0), Actor::Service.at(day(51.0))).await.unwrap();
    assert_eq!((second.version, second.set_by), (2, Actor::Service));
    assert_eq!(set(&store, "EC-MXA", &plan(5.0)).await, second, "the same again changes nothing");
    let withdrawn = set(&store, "EC-MXA", &Plan::default()).await;
    assert_eq!((of(&name).await.as_ref(), withdrawn.version), (Some(&withdrawn), 3));
    assert_eq!(store.plans(&operator(), &tail("EC-MXA")).await.unwrap(), [first, second, withdrawn]);
    assert_eq!(of("other").await, None);
    assert_eq!(store.plan(&operator(), &tail("EC-MXB")).await.unwrap(), None);
    let audit = store.audit(Some(&operator()), 0, 10).await.unwrap();
    let acts: Vec<_> = audit.iter().map(|record| (record.action, record.subject.as_str(), record.actor)).collect();
    let act = |actor| (Action::PlanSet, "EC-MXA", actor);
    assert_eq!(acts, [act(Actor::Cli), act(Actor::Service), act(Actor::Cli)]);
    assert!(store.verify().await.unwrap().damaged.is_empty());
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_is_on_the_tail_waits_for_a_forecast_by_its_plan(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    two_tails(&store).await;
    let digest = store.digest().await.unwrap();
    set(&store, "EC-MXA", &plan(4.0)).await;
    assert_eq!(store.pending().await.unwrap(), 0);
    // Ten hours a day are flown.
    let expected = Planned { plan: plan(4.0), utilisation_fh_per_day: Some(10.0) };
    assert_eq!(planned(&store, "0001").await, Some(expected));
    set(&store, "EC-MXA", &plan(4.0)).await;
    assert_eq!(store.lease(LEASE).await.unwrap(), None, "the same again changes nothing");
    let on_tail = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
    assert_eq!((&on_tail[0].plan, on_tail[0].utilisation_fh_per_day), (&plan(4.0), Some(10.0)));
    let fleet = store.installed_fleet(&operator(), None, 10).await.unwrap();
    assert_eq!(fleet.iter().map(|tail| &tail.installed[0].plan).collect::<Vec<_>>(), [&plan(4.0), &Plan::default()]);
    set(&store, "EC-MXA", &Plan::default()).await;
    assert_eq!(planned(&store, "0001").await, None);
    assert_eq!(store.digest().await.unwrap(), digest, "no estimate and no state rests on a plan");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_computed_without_the_plan_are_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    two_tails(&store).await;
    store.accept(&operator(), later_upload("late", "0001", 200.0), day(0.0)).await.unwrap();
    let early = lease(&store).await;
    let inputs = life_inputs(&store, &early).await;
    set(&store, "EC-MXA", &plan(4.0)).await;
    assert_eq!(store.complete(&early, vec![results(&inputs)]).await.unwrap(), Completion::Fenced);
    let again = lease(&store).await;
    assert_eq!(life_inputs(&store, &again).await.planned.map(|planned| planned.plan), Some(plan(4.0)));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_component_that_moves_is_judged_by_the_plan_of_the_other_tail(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    two_tails(&store).await;
    set(&store, "EC-MXB", &plan(4.0)).await;
    assert_eq!(planned(&store, "0002").await.map(|planned| planned.plan), Some(plan(4.0)));
    let install = MaintenanceEvent {
        kind: EventKind::Install,
        tail: tail("EC-MXB"),
        position: "AIL-R".parse().unwrap(),
        ..finding("moved", "0001", Finding::Failed, 300.0)
    };
    store.record_event(&operator(), &install, day(0.0)).await.unwrap();
    assert_eq!(planned(&store, "0001").await.map(|planned| planned.plan), Some(plan(4.0)));
    store.void_event(&operator(), &install.event_id, by_hand(60.0)).await.unwrap();
    assert_eq!(planned(&store, "0001").await, None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_earlier_life_has_no_flights_ahead(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    two_tails(&store).await;
    let overhaul = MaintenanceEvent { kind: EventKind::Overhaul, ..finding("new", "0001", Finding::Failed, 250.0) };
    store.record_event(&operator(), &overhaul, day(0.0)).await.unwrap();
    store.accept(&operator(), later_upload("young", "0001", 200.0), day(0.0)).await.unwrap();
    drain(&store).await;
    set(&store, "EC-MXA", &plan(4.0)).await;
    let lives = store.life_inputs(&lease(&store).await).await.unwrap();
    assert_eq!(lives.iter().map(|life| life.planned.is_some()).collect::<Vec<_>>(), [false, true]);
}
