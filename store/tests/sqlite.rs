//! What only SQLite can get wrong: the file, its owner, its damage.

mod fixture;

use std::{fs, path::Path};

use fixture::{Database, bundle, component, day, drain, later_upload, operator, tail, upload};
use sqlx::{Connection, Executor, SqliteConnection, sqlite::SqliteConnectOptions};
use store::{Options, Receipt, Store, StoreError};
use tokio::task::JoinSet;

async fn execute(path: &Path, sql: &'static str) -> u64 {
    let options = SqliteConnectOptions::new().filename(path).create_if_missing(true);
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    let done = connection.execute(sql).await.unwrap();
    connection.close().await.unwrap();
    done.rows_affected()
}

async fn refusal(database: &Database) -> StoreError {
    Store::open(&database.url(), Options::default()).await.err().expect("the file is refused")
}

#[tokio::test]
async fn a_file_has_one_owner() {
    let database = Database::new();
    let store = database.open().await;
    let refused = refusal(&database).await;
    let StoreError::Locked { owner, .. } = &refused else { panic!("{refused:?}") };
    assert_eq!(*owner, std::process::id().to_string());
    store.close().await;
    database.open().await.close().await;
}

#[tokio::test]
async fn what_is_no_database_is_refused_untouched() {
    let database = Database::new();
    let text = "tail,position\nEC-MXA,AIL-L\n";
    fs::write(database.path(), text).unwrap();
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::NotADatabase { .. }), "{refused:?}");
    assert_eq!(fs::read_to_string(database.path()).unwrap(), text);
}

#[tokio::test]
async fn a_database_of_another_application_is_refused() {
    let database = Database::new();
    execute(&database.path(), "create table songs (title text)").await;
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::ForeignDatabase { .. }), "{refused:?}");
}

#[tokio::test]
async fn an_empty_file_becomes_a_database() {
    let database = Database::new();
    fs::write(database.path(), "").unwrap();
    database.open().await.ping().await.unwrap();
}

#[tokio::test]
async fn a_schema_that_excludes_this_build_is_refused_and_one_that_does_not_is_served() {
    let database = Database::new();
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
    let database = Database::new();
    database.open().await.close().await;
    execute(&database.path(), "update _sqlx_migrations set checksum = x'00' where version = 1").await;
    let refused = refusal(&database).await;
    assert!(matches!(refused, StoreError::Migration(_)), "{refused:?}");
}

#[tokio::test]
async fn urls_that_name_no_file_are_refused() {
    for url in ["postgres://localhost/actuary", "fleet.db", "sqlite:", "sqlite::memory:"] {
        let refused = Store::open(url, Options::default()).await.err().unwrap();
        assert!(matches!(refused, StoreError::UnsupportedUrl { .. }), "{url}: {refused:?}");
    }
    let refused = Store::open("sqlite:/nowhere/fleet.db", Options::default()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
}

#[tokio::test]
async fn what_is_acknowledged_is_in_the_files() {
    let database = Database::new();
    let store = database.ready().await;
    for i in 0..10 {
        store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
    }
    // What a killed process leaves behind: the database and its log, without a closing checkpoint.
    let left_behind = Database::new();
    for suffix in ["", "-wal"] {
        let name = |database: &Database| format!("{}{suffix}", database.path().display());
        fs::copy(name(&database), name(&left_behind)).unwrap();
    }
    let store = left_behind.open().await;
    assert_eq!(store.pending().await.unwrap(), 10);
    for i in 0..10 {
        let again = store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
        assert_eq!(again, Receipt::Duplicate);
    }
}

#[tokio::test]
async fn one_bad_upload_of_a_batch_fails_alone() {
    let database = Database::new();
    database.ready().await.close().await;
    let trigger = "create trigger bad before insert on uploads when new.upload_id like 'bad%'
                   begin select raise(abort, 'refused by the test'); end";
    execute(&database.path(), trigger).await;
    let store = database.open().await;
    let mut callers = JoinSet::new();
    for i in 0..40 {
        let store = store.clone();
        let id = if i % 17 == 5 { format!("bad{i}") } else { format!("u{i}") };
        callers.spawn(async move { (i, store.accept(&operator(), upload(&id, "0001"), day(0.0)).await) });
    }
    for (i, answer) in callers.join_all().await {
        match answer {
            Ok(receipt) => assert!(i % 17 != 5 && receipt == Receipt::Accepted, "{i}: {receipt:?}"),
            Err(error) => assert!(i % 17 == 5 && matches!(error, StoreError::Database(_)), "{i}: {error}"),
        }
    }
    assert_eq!(store.pending().await.unwrap(), 37);
}

/// A database with a processed life, closed.
async fn with_history() -> Database {
    let database = Database::new();
    let store = database.ready().await;
    for i in 0..10 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    drain(&store).await;
    store.close().await;
    database
}

#[derive(Debug, PartialEq)]
struct Served {
    uploads: Vec<store::UploadRecord>,
    estimates: Vec<domain::Estimate>,
    states: Vec<domain::State>,
    installed: Vec<store::Installed>,
    mask: Option<store::PublishedMask>,
    bundles: Vec<store::BundleRecord>,
}

/// Everything that is served of such a database.
async fn served(store: &Store) -> Result<Served, StoreError> {
    let mut uploads = Vec::new();
    for i in 0..10 {
        uploads.extend(store.upload(&operator(), &format!("u{i}").parse().unwrap()).await?);
    }
    Ok(Served {
        uploads,
        estimates: store.estimates(&component("0001"), None, None, None, 100).await?,
        states: store.states(&component("0001"), None, None, None, 100).await?,
        installed: store.installed(&operator(), &tail("EC-MXA")).await?,
        mask: store.mask(&fixture::mask().id()).await?,
        bundles: store.bundles().await?,
    })
}

#[tokio::test]
async fn a_damaged_row_is_named_and_never_served() {
    for (table, damage) in [
        ("uploads", "update uploads set body = replace(body, '0.0712', '0.0713')"),
        ("uploads", "update uploads set received_at = received_at + 1"),
        ("estimates", "update estimates set body = replace(body, '0.1', '0.2')"),
        ("estimates", "update estimates set flight_hours = flight_hours + 0.5"),
        ("states", "update states set body = replace(body, '1234.5', '1234.6')"),
        ("states", "update states set checksum = zeroblob(32)"),
        ("prognoses", "update prognoses set body = replace(body, '0.02', '0.03')"),
        ("prognoses", "update prognoses set issued_at = 0"),
        ("masks", "update masks set k_nom = 0.0753"),
        ("bundles", "update bundles set summary = replace(summary, '0.0752', '0.0753')"),
    ] {
        let database = with_history().await;
        assert!(execute(&database.path(), damage).await > 0, "{damage}");
        let store = database.open().await;
        match served(&store).await {
            Err(StoreError::Corrupt { row, .. }) => assert!(row.contains(table), "{damage}: {row}"),
            other => panic!("{damage}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn the_body_of_another_row_is_not_taken_for_a_rows_own() {
    let database = with_history().await;
    let swap = "update states set (body, checksum) = (select body, checksum from states order by block limit 1)";
    assert!(execute(&database.path(), swap).await > 1);
    let served = served(&database.open().await).await;
    assert!(matches!(served, Err(StoreError::Corrupt { .. })), "{served:?}");
}

#[tokio::test]
async fn a_damaged_bundle_is_not_handed_out() {
    let database = with_history().await;
    execute(&database.path(), "update bundles set body = x'00'").await;
    let body = database.open().await.bundle_body(&bundle("one").hash).await;
    assert!(matches!(body, Err(StoreError::Corrupt { .. })), "{body:?}");
}
