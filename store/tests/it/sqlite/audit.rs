//! The audit log, and the tokens that it tells of.

use domain::Actor;
use sqlx::{Connection, SqliteConnection, sqlite::SqliteConnectOptions};

use super::execute;
use crate::fixture::{Backend, Database, operator, token};

/// A database whose operator `default` has a chain of five records.
async fn with_audit() -> Database {
    let database = Database::new(Backend::Sqlite);
    let store = database.open().await;
    for number in 0..5 {
        store.create_token(&token(&operator(), number).1, Actor::Cli).await.unwrap();
    }
    store.close().await;
    database
}

#[tokio::test]
async fn a_record_that_was_changed_removed_or_inserted_is_found_where_it_is() {
    let whole = with_audit().await.open().await.verify_audit().await.unwrap().remove(0);
    assert_eq!((whole.records, &whole.damage), (5, &None));
    for (damage, place) in [
        ("update audit set body = replace(body, 'cli', 'CLI') where sequence = 3", 3),
        ("update audit set hash = zeroblob(32) where sequence = 4", 4),
        (
            "update audit set body = (select body from audit where sequence = 2),
            hash = (select hash from audit where sequence = 2) where sequence = 3",
            3,
        ),
        ("delete from audit where sequence = 1", 1),
        ("delete from audit where sequence = 3", 3),
        ("update audit set sequence = 9 where sequence = 5", 5),
        ("insert into audit select operator, 0, body, hash from audit where sequence = 1", 1),
        ("insert into audit select operator, 6, body, hash from audit where sequence = 5", 6),
        ("update audit set operator = 'elsewhere'", 1),
    ] {
        let database = with_audit().await;
        assert!(execute(&database.path(), damage).await > 0, "{damage}");
        let chains = database.open().await.verify_audit().await.unwrap();
        let found = chains[0].damage.as_ref().unwrap_or_else(|| panic!("{damage}: {chains:?}"));
        assert_eq!((found.sequence, chains[0].records), (place, place - 1), "{damage}: {found:?}");
    }
}

#[tokio::test]
async fn a_record_written_anew_with_its_hash_breaks_the_chain_behind_it() {
    let database = with_audit().await;
    let store = database.open().await;
    let mut record = store.audit(Some(&operator()), 2, 1).await.unwrap().remove(0);
    store.close().await;
    record.subject = "another".to_owned();
    let options = SqliteConnectOptions::new().filename(database.path());
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    sqlx::query("update audit set body = $1, hash = $2 where sequence = 3")
        .bind(serde_json::to_string(&record).unwrap())
        .bind(&record.hash().bytes()[..])
        .execute(&mut connection)
        .await
        .unwrap();
    connection.close().await.unwrap();
    let chain = database.open().await.verify_audit().await.unwrap().remove(0);
    assert_eq!((chain.records, chain.damage.map(|damage| damage.sequence)), (3, Some(4)));
}

#[tokio::test]
async fn a_log_whose_end_was_cut_off_or_that_was_emptied_is_told_by_its_anchor() {
    for (cut, left) in [("delete from audit where sequence > 3", 3), ("delete from audit", 0)] {
        let database = with_audit().await;
        execute(&database.path(), cut).await;
        let store = database.open().await;
        let chain = store.verify_audit().await.unwrap().remove(0);
        assert_eq!((chain.records, chain.damage.unwrap().sequence), (left, left + 1), "{cut}");
        store.create_token(&token(&operator(), 5).1, Actor::Cli).await.unwrap();
        let chain = store.verify_audit().await.unwrap().remove(0);
        assert_eq!(chain.damage.unwrap().sequence, left + 1, "{cut}: what is appended hides nothing");
    }
}

#[tokio::test]
async fn an_emptied_table_of_tokens_opens_nothing_and_is_told() {
    let database = with_audit().await;
    execute(&database.path(), "delete from tokens").await;
    let store = database.open().await;
    assert!(store.has_tokens().await.unwrap(), "callers must still show one");
    let missing = store.verify().await.unwrap().damaged;
    assert_eq!(missing.iter().filter(|row| row.table == "tokens").count(), 5, "{missing:?}");
}
