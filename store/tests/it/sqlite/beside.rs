//! What others do beside the owner of a file.

use domain::Actor;
use std::fs;
use store::{Completion, Receipt, Store, StoreError};
use tokio::task::JoinSet;

use super::{migration::of_first_schema, refusal, served, with_history};
use crate::fixture::{self, Backend, Database, by_hand, day, drain, lease, operator, serve, token, upload};

/// Tables of uploads that are not processed.
const WAITING: [&str; 3] = ["inbox", "set_aside", "exclusions"];

#[tokio::test]
async fn a_database_that_is_only_read_answers_and_refuses_writes() {
    let database = with_history().await;
    let store = database.open().await;
    let expected = served(&store).await.unwrap();
    let beside = Store::open_read_only(&database.url()).await.unwrap();
    assert_eq!(served(&beside).await.unwrap(), expected);
    store.accept(&operator(), upload("later", "0002"), day(9.0)).await.unwrap();
    assert_eq!(beside.pending().await.unwrap(), 1, "what its owner writes is seen");
    drain(&store).await;
    let (digest, expected) = (store.digest().await.unwrap(), served(&store).await.unwrap());
    beside.close().await;
    store.close().await;
    let before = fs::read(database.path()).unwrap();
    let reader = Store::open_read_only(&database.url()).await.unwrap();
    assert_eq!(reader.digest().await.unwrap(), digest);
    assert_eq!(served(&reader).await.unwrap(), expected);
    let verified = reader.verify().await.unwrap();
    assert_eq!(verified.damaged, []);
    let empty = verified.tables.iter().filter(|(_, rows)| *rows == 0).map(|(table, _)| *table);
    let (empty, known): (Vec<_>, _) =
        (empty.collect(), ["checkpoints", "movements", "retried", "voided", "voided_events"]);
    assert!(empty.iter().all(|table| known.contains(table) || WAITING.contains(table)), "{verified:?}");
    let refused = reader.accept(&operator(), upload("late", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::ReadOnly)), "{refused:?}");
    assert!(matches!(reader.lease(fixture::LEASE).await, Err(StoreError::ReadOnly)));
    reader.close().await;
    assert_eq!(fs::read(database.path()).unwrap(), before);
    database.open().await.close().await;
}

#[tokio::test]
async fn administrative_acts_are_done_beside_the_owner_who_sees_them_at_once() {
    let database = Database::new(Backend::Sqlite);
    let owner = database.ready().await;
    owner.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let leased = lease(&owner).await;
    let mut accepted = JoinSet::new();
    for i in 0..200 {
        let owner = owner.clone();
        let upload = upload(&format!("b{i}"), "0002");
        accepted.spawn(async move { owner.accept(&operator(), upload, day(0.0)).await.unwrap() });
    }
    let beside = Store::open_beside(&database.url()).await.unwrap();
    for number in 0..20 {
        let (created, record) = token(&operator(), number);
        beside.create_token(&record, Actor::Cli).await.unwrap();
        assert_eq!(owner.token(&created.id).await.unwrap(), Some(record));
    }
    beside.revoke_token(&operator(), &token(&operator(), 3).0.id, by_hand(1.0)).await.unwrap();
    beside.close().await;
    assert!(owner.token(&token(&operator(), 3).0.id).await.unwrap().unwrap().revoked_at.is_some());
    while let Some(receipt) = accepted.join_next().await {
        assert_eq!(receipt.unwrap(), Receipt::Accepted);
    }
    assert_eq!(serve(&owner, &leased).await, Completion::Done, "leases go on");
    assert!(matches!(refusal(&database).await, StoreError::Locked { .. }), "the owner is still the owner");
    let damage: Vec<_> = owner.verify_audit().await.unwrap().into_iter().filter_map(|chain| chain.damage).collect();
    assert_eq!(damage, []);
}

#[tokio::test]
async fn nothing_is_created_or_migrated_beside_an_owner() {
    let database = Database::new(Backend::Sqlite);
    let refused = Store::open_beside(&database.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
    assert!(!database.path().exists());
    let old = of_first_schema(&with_history().await).await;
    let refused = Store::open_beside(&old.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::OlderSchema { version: 1, .. }), "{refused:?}");
}
