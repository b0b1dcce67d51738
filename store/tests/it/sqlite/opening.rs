//! What is opened, and what is refused untouched.

use std::fs;
use store::{Options, Store, StoreError};

use super::{execute, killed, migration::of_first_schema, refusal, with_history};
use crate::fixture::{Backend, Database, day, drain, operator, upload};

#[tokio::test]
async fn a_file_has_one_owner() {
    let database = Database::new(Backend::Sqlite);
    let store = database.open().await;
    let refused = refusal(&database).await;
    let StoreError::Locked { owner, .. } = &refused else { panic!("{refused:?}") };
    assert_eq!(*owner, std::process::id().to_string());
    store.close().await;
    database.open().await.close().await;
}

#[tokio::test]
async fn what_is_no_database_is_refused_untouched() {
    let database = Database::new(Backend::Sqlite);
    let text = "tail,position\nEC-MXA,AIL-L\n";
    fs::write(database.path(), text).unwrap();
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::NotADatabase { .. }), "{refused:?}");
    assert_eq!(fs::read_to_string(database.path()).unwrap(), text);
}

#[tokio::test]
async fn a_database_of_another_application_is_refused() {
    let database = Database::new(Backend::Sqlite);
    execute(&database.path(), "create table songs (title text)").await;
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::ForeignDatabase { .. }), "{refused:?}");
}

#[tokio::test]
async fn an_empty_file_becomes_a_database() {
    let database = Database::new(Backend::Sqlite);
    fs::write(database.path(), "").unwrap();
    database.open().await.ping().await.unwrap();
}

#[tokio::test]
async fn a_schema_that_excludes_this_build_is_refused_and_one_that_does_not_is_served() {
    let database = Database::new(Backend::Sqlite);
    database.open().await.close().await;
    execute(&database.path(), "insert into _sqlx_migrations values (99, 'later', current_timestamp, 1, x'00', 1)")
        .await;
    execute(&database.path(), "update schema_info set version = 99").await;
    database.open().await.close().await;
    execute(&database.path(), "update schema_info set min_binary = 98").await;
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::NewerSchema { version: 99, min_binary: 98, .. }), "{refused:?}");
}

#[tokio::test]
async fn a_migration_that_was_altered_is_refused() {
    let database = Database::new(Backend::Sqlite);
    database.open().await.close().await;
    execute(&database.path(), "update _sqlx_migrations set checksum = x'00' where version = 1").await;
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::Migration(_)), "{refused:?}");
}

#[tokio::test]
async fn urls_that_name_no_file_are_refused() {
    for url in ["mysql://localhost/actuary", "fleet.db", "sqlite:", "sqlite::memory:"] {
        let refused = Store::open(url, Options::default()).await.err().unwrap();
        assert!(matches!(refused, StoreError::UnsupportedUrl { .. }), "{url}: {refused:?}");
    }
    let refused = Store::open("sqlite:/nowhere/fleet.db", Options::default()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
}

#[tokio::test]
async fn what_a_killed_process_left_in_the_log_is_read() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    drain(&store).await;
    let left_behind = killed(&database);
    let reader = Store::open_read_only(&left_behind.url()).await.unwrap();
    assert_eq!(reader.digest().await.unwrap(), store.digest().await.unwrap());
    assert_eq!(reader.digest().await.unwrap().estimates, 1);
}

#[tokio::test]
async fn what_cannot_be_read_as_it_is_is_refused_untouched() {
    let database = Database::new(Backend::Sqlite);
    let refused = Store::open_read_only(&database.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
    assert!(!database.path().exists());
    let old = of_first_schema(&with_history().await).await;
    let refused = Store::open_read_only(&old.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::OlderSchema { version: 1, .. }), "{refused:?}");
    old.open().await.close().await;
    Store::open_read_only(&old.url()).await.unwrap();
}
