use domain::{Actor, ContentHash};
use store::StoreError;
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, bundle_body, by_hand, component, day, drain, lease, life_inputs, mask, operator, upload,
};

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_registered_bundle_reads_back_and_registering_it_again_changes_nothing(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    for time in [day(0.0), day(1.0)] {
        store.register_bundle(&bundle("one"), &bundle_body("one"), Actor::Cli.at(time)).await.unwrap();
    }
    let records = store.bundles().await.unwrap();
    assert_eq!(records.len(), 1);
    assert_eq!((&records[0].summary, records[0].active, records[0].added_at), (&bundle("one"), false, day(0.0)));
    assert_eq!(store.bundle_body(&bundle("one").hash).await.unwrap(), Some(bundle_body("one")));
    assert_eq!(store.bundle_body(&ContentHash::of(b"other")).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_mask_stays_published_by_the_bundle_that_came_first(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    for name in ["one", "two"] {
        store.register_bundle(&bundle(name), &bundle_body(name), by_hand(0.0)).await.unwrap();
    }
    let published = store.mask(&mask().id()).await.unwrap().unwrap();
    assert_eq!((published.mask, published.model, published.k_nom), (mask(), bundle("one").hash, 0.0752));
    assert_eq!(store.mask(&ContentHash::of(b"other")).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn bytes_that_are_not_the_bundle_named_are_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let refused = store.register_bundle(&bundle("one"), b"other", by_hand(0.0)).await;
    assert!(matches!(refused, Err(StoreError::WrongHash { .. })), "{refused:?}");
    assert_eq!(store.bundles().await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn one_bundle_is_active_and_an_unknown_one_cannot_be(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.register_bundle(&bundle("two"), &bundle_body("two"), by_hand(1.0)).await.unwrap();
    store.activate_bundle(&bundle("two").hash, by_hand(1.0)).await.unwrap();
    let unknown = store.activate_bundle(&ContentHash::of(b"other"), by_hand(1.0)).await;
    assert!(matches!(unknown, Err(StoreError::UnknownBundle(_))), "{unknown:?}");
    let active: Vec<_> = store.bundles().await.unwrap().iter().map(|record| record.active).collect();
    assert_eq!(active, [false, true]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_life_is_judged_by_the_bundle_that_was_active_at_its_first_upload(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "old"), day(0.0)).await.unwrap();
    drain(&store).await;
    store.register_bundle(&bundle("two"), &bundle_body("two"), by_hand(1.0)).await.unwrap();
    store.activate_bundle(&bundle("two").hash, by_hand(1.0)).await.unwrap();
    for (id, serial, judge) in [("u2", "old", "one"), ("u3", "new", "two")] {
        store.accept(&operator(), upload(id, serial), day(1.0)).await.unwrap();
        let lease = lease(&store).await;
        let inputs = life_inputs(&store, &lease).await;
        assert_eq!(inputs.life.component, component(serial));
        assert_eq!((inputs.generation.number, inputs.generation.model), (1, bundle(judge).hash));
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn without_an_active_bundle_nothing_is_enrolled(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let refused = store.accept(&operator(), upload("u1", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::NoActiveBundle)), "{refused:?}");
    assert_eq!(store.pending().await.unwrap(), 0);
    assert_eq!(store.upload(&operator(), &"u1".parse().unwrap()).await.unwrap(), None);
}
