use domain::{Action, Actor, Settings};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, day, operator, settings,
};

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_newest_settings_of_an_operator_are_in_force(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let of = async |name: &str| store.settings(&name.parse().unwrap()).await.unwrap();
    let name = operator().to_string();
    assert_eq!(of(&name).await, None);
    let first = store.set_settings(&operator(), &settings(0.05), by_hand(50.0)).await.unwrap();
    let told = (first.version, first.set_at, first.set_by, &first.settings);
    assert_eq!(told, (1, day(50.0), Actor::Cli, &settings(0.05)));
    let act = Actor::Service.at(day(51.0));
    assert_eq!(store.set_settings(&operator(), &settings(0.05), act).await.unwrap(), first, "the same again");
    let second = store.set_settings(&operator(), &Settings::default(), act).await.unwrap();
    assert_eq!((second.version, second.set_by, &second.settings), (2, Actor::Service, &Settings::default()));
    assert_eq!(of(&name).await, Some(second));
    assert_eq!(of("other").await, None);
    let audit = store.audit(Some(&operator()), 0, 10).await.unwrap();
    let acts: Vec<_> = audit.iter().map(|record| (record.action, record.subject.as_str(), record.actor)).collect();
    let act = |actor| (Action::SettingsSet, name.as_str(), actor);
    assert_eq!(acts, [act(Actor::Cli), act(Actor::Service)]);
    assert_eq!(store.verify().await.unwrap().damaged, []);
}
