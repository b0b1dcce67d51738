use domain::{Action, Actor, Checks};
use store::{Store, TailChecks};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, checks, day, drain, operator, plan, tail, upload,
};

/// Sets checks of tails on day 50.
async fn set(store: &Store, of: &[(&str, Checks)]) -> Vec<TailChecks> {
    let of: Vec<_> = of.iter().map(|(name, checks)| (tail(name), checks.clone())).collect();
    store.set_checks(&operator(), &of, by_hand(50.0)).await.unwrap()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_newest_checks_of_a_tail_are_in_force(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let of = async |operator: &str, name: &str| store.checks(&operator.parse().unwrap(), &tail(name)).await.unwrap();
    let name = operator().to_string();
    assert_eq!(of(&name, "EC-MXA").await, None);
    let first = set(&store, &[("EC-MXA", checks(90.0)), ("EC-MXB", checks(95.0))]).await;
    let told = |version: &TailChecks| (version.version, version.set_at, version.set_by, version.checks.clone());
    assert_eq!(told(&first[0]), (1, day(50.0), Actor::Cli, checks(90.0)));
    assert_eq!(told(&first[1]), (1, day(50.0), Actor::Cli, checks(95.0)));
    let act = Actor::Service.at(day(51.0));
    let both = [(tail("EC-MXA"), checks(90.0)), (tail("EC-MXB"), checks(96.0))];
    let second = store.set_checks(&operator(), &both, act).await.unwrap();
    assert_eq!(second[0], first[0], "the same again is no version");
    assert_eq!((second[1].version, second[1].set_by), (2, Actor::Service));
    let withdrawn = set(&store, &[("EC-MXA", Checks::default())]).await.remove(0);
    assert_eq!((of(&name, "EC-MXA").await.as_ref(), withdrawn.version), (Some(&withdrawn), 2));
    assert_eq!(of("other", "EC-MXB").await, None);
    let audit = store.audit(Some(&operator()), 0, 10).await.unwrap();
    let acts: Vec<_> = audit.iter().map(|record| (record.action, record.subject.as_str(), record.actor)).collect();
    let act = |subject, actor| (Action::ChecksSet, subject, actor);
    let expected = [
        act("EC-MXA", Actor::Cli),
        act("EC-MXB", Actor::Cli),
        act("EC-MXB", Actor::Service),
        act("EC-MXA", Actor::Cli),
    ];
    assert_eq!(acts, expected);
    assert_eq!(store.verify().await.unwrap().damaged, []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn tails_with_checks_are_listed_page_by_page(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let names = ["EC-MXA", "EC-MXB", "EC-MXC", "EC-MXD"];
    set(&store, &names.map(|name| (name, checks(90.0)))).await;
    set(&store, &[("EC-MXB", Checks::default()), ("EC-MXC", checks(91.0))]).await;
    let listed = async |after: Option<&str>, limit| {
        let page = store.fleet_checks(&operator(), after.map(tail).as_ref(), limit).await.unwrap();
        page.into_iter().map(|(tail, of)| (tail.to_string(), of.checks)).collect::<Vec<_>>()
    };
    let one = |name: &str, on| (name.to_owned(), checks(on));
    assert_eq!(listed(None, 2).await, [one("EC-MXA", 90.0), one("EC-MXC", 91.0)]);
    assert_eq!(listed(Some("EC-MXC"), 2).await, [one("EC-MXD", 90.0)]);
    assert_eq!(store.fleet_checks(&"other".parse().unwrap(), None, 2).await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn checks_are_told_with_what_is_on_the_tail_and_nothing_waits_for_them(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u", "0001"), day(0.0)).await.unwrap();
    drain(&store).await;
    let listed = async || store.units(&operator(), store::UnitsAsked::default(), |_| false).await.unwrap().remove(0);
    let of_now = async || {
        let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap().remove(0).checks;
        assert_eq!(store.installed_fleet(&operator(), None, 10).await.unwrap()[0].installed[0].checks, installed);
        assert_eq!(listed().await.checks, installed);
        installed
    };
    assert_eq!(of_now().await, Checks::default());
    set(&store, &[("EC-MXA", checks(90.0)), ("EC-MXB", checks(95.0))]).await;
    assert_eq!(of_now().await, checks(90.0));
    assert_eq!(store.pending().await.unwrap(), 0);
    assert!(store.lease(crate::fixture::LEASE).await.unwrap().is_none(), "no forecast rests on a check");
    assert!(listed().await.plan.is_empty());
    store.set_plan(&operator(), &tail("EC-MXA"), &plan(4.0), by_hand(50.0)).await.unwrap();
    assert_eq!((of_now().await, listed().await.plan), (checks(90.0), plan(4.0)));
}
