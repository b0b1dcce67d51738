//! The file of an SQLite database: its names, its owner, its log, and what becomes of it under a service.

use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::{Path, PathBuf},
    time::Duration,
};

use crate::fixture::{Backend, Database, day, drain, operator, token, upload};
use domain::Actor;
use sqlx::{Connection, Executor, SqliteConnection, sqlite::SqliteConnectOptions};
use store::{Options, Receipt, Store, StoreError};
use tokio::time::timeout;

/// Longer than anything here takes: only a hang runs into it.
const HANG: Duration = Duration::from_secs(60);

fn url(path: &Path) -> String {
    format!("sqlite:{}", path.display())
}

fn beside(database: &Database, name: &str) -> PathBuf {
    database.path().with_file_name(name)
}

fn log(path: &Path) -> PathBuf {
    format!("{}-wal", path.display()).into()
}

async fn refusal(url: &str) -> StoreError {
    Store::open(url, Options::default()).await.err().unwrap_or_else(|| panic!("{url} is refused"))
}

/// How each way to open a file refuses it.
async fn refusals(url: &str) -> [StoreError; 4] {
    [
        refusal(url).await,
        Store::migrate(url, None).await.unwrap_err(),
        Store::open_read_only(url).await.err().unwrap(),
        Store::open_beside(url).await.err().unwrap(),
    ]
}

#[tokio::test]
async fn a_file_has_one_owner_whatever_it_is_called() {
    let database = Database::new(Backend::Sqlite);
    let store = database.open().await;
    let (link, name) = (beside(&database, "link.db"), beside(&database, "name.db"));
    symlink("fleet.db", &link).unwrap();
    fs::hard_link(database.path(), &name).unwrap();
    let dotted = database
        .path()
        .parent()
        .unwrap()
        .join("./../")
        .join(database.path().strip_prefix(database.path().parent().unwrap().parent().unwrap()).unwrap());
    for other in [&link, &name, &dotted] {
        let refused = refusal(&url(other)).await;
        assert!(matches!(refused, StoreError::Locked { .. } | StoreError::ManyNames { .. }), "{other:?}: {refused:?}");
    }
    store.close().await;
    for one in [&name, &database.path()] {
        let refused = refusal(&url(one)).await;
        assert!(matches!(refused, StoreError::ManyNames { names: 2, .. }), "{one:?}: {refused:?}");
    }
    fs::remove_file(name).unwrap();
    Store::open(&url(&link), Options::default()).await.unwrap().close().await;
    assert!(!log(&link).exists() && !beside(&database, "link.db.lock").exists());
}

#[tokio::test]
async fn a_url_with_parameters_names_no_file_and_is_not_repeated() {
    let database = Database::new(Backend::Sqlite);
    for name in ["?password=sesame", "file:", "file:?mode=memory&password=sesame"] {
        let url = match name.strip_prefix("file:") {
            Some(parameters) => format!("sqlite:file:{}{parameters}", database.path().display()),
            None => format!("{}{name}", database.url()),
        };
        for refused in refusals(&url).await {
            assert!(matches!(refused, StoreError::UnsupportedUrl { .. }), "{url}: {refused:?}");
            assert!(!refused.to_string().contains("sesame"), "{refused}");
        }
    }
    assert_eq!(fs::read_dir(database.path().parent().unwrap()).unwrap().count(), 0);
}

#[tokio::test]
async fn a_link_to_nothing_is_where_no_database_begins() {
    let database = Database::new(Backend::Sqlite);
    let link = beside(&database, "link.db");
    symlink("fleet.db", &link).unwrap();
    for refused in refusals(&url(&link)).await {
        assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
    }
    assert!(!database.path().exists());
}

#[tokio::test]
async fn a_copy_without_its_log_is_refused_untouched_until_it_is_taken_for_all_there_is() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let copy = beside(&database, "copy.db");
    fs::copy(database.path(), &copy).unwrap();
    let before = fs::read(&copy).unwrap();
    for refused in refusals(&url(&copy)).await {
        assert!(matches!(refused, StoreError::WithoutLog { .. }), "{refused:?}");
    }
    assert_eq!(fs::read(&copy).unwrap(), before);
    assert!(Store::adopt(&url(&copy)).await.unwrap(), "it was not closed");
    let taken = Store::open(&url(&copy), Options::default()).await.unwrap();
    assert_eq!(taken.pending().await.unwrap(), 0);
    taken.close().await;
    assert!(!Store::adopt(&url(&copy)).await.unwrap());
}

#[tokio::test]
async fn a_file_whose_tables_are_all_in_a_log_that_is_gone_is_never_an_empty_fleet() {
    let database = Database::new(Backend::Sqlite);
    let options = SqliteConnectOptions::new().filename(database.path()).create_if_missing(true);
    let mut writer = SqliteConnection::connect_with(&options).await.unwrap();
    writer.execute("pragma journal_mode = wal; create table lives (serial_number text)").await.unwrap();
    let copy = beside(&database, "copy.db");
    fs::copy(database.path(), &copy).unwrap();
    assert!(fs::metadata(&copy).unwrap().len() > 0 && log(&database.path()).exists());
    for refused in refusals(&url(&copy)).await {
        assert!(matches!(refused, StoreError::WithoutLog { .. }), "{refused:?}");
        assert!(!refused.to_string().contains("actuary migrate"), "{refused}");
    }
    assert!(matches!(Store::adopt(&url(&copy)).await, Err(StoreError::WithoutLog { .. })));
}

#[tokio::test]
async fn what_was_closed_or_left_with_its_log_is_opened_again() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let (killed, closed, copied) =
        (beside(&database, "killed.db"), beside(&database, "closed.db"), beside(&database, "copied.db"));
    fs::copy(database.path(), &killed).unwrap();
    fs::copy(log(&database.path()), log(&killed)).unwrap();
    // Whoever looks at it or acts on it beside leaves it as whole as it was; the second takes the log away.
    Store::open_read_only(&url(&killed)).await.unwrap().close().await;
    let administrator = Store::open_beside(&url(&killed)).await.unwrap();
    administrator.create_token(&token(&operator(), 1).1, Actor::Cli).await.unwrap();
    administrator.close().await;
    store.copy_to(&copied).await.unwrap();
    store.close().await;
    fs::copy(database.path(), &closed).unwrap();
    for path in [killed, copied, closed] {
        assert!(!log(&path).exists(), "{path:?}");
        let store = Store::open(&url(&path), Options::default()).await.unwrap();
        assert_eq!(store.pending().await.unwrap(), 1, "{path:?}");
        store.close().await;
    }
}

/// Sends an upload again until it is stored.
async fn insist(store: &Store, id: &str) {
    let stored = async {
        while store.accept(&operator(), upload(id, "0001"), day(0.0)).await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        while store.ping().await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(HANG, stored).await.expect("it is stored at last");
}

#[tokio::test]
async fn slow_nothing_is_acknowledged_while_the_file_or_its_log_is_gone_or_another() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    store.accept(&operator(), upload("u0", "0001"), day(0.0)).await.unwrap();
    let (path, away) = (database.path(), beside(&database, "away"));
    for (number, (gone, other)) in
        [(path.clone(), None), (path.clone(), Some("another file")), (log(&path), None)].into_iter().enumerate()
    {
        fs::rename(&gone, &away).unwrap();
        if let Some(text) = other {
            fs::write(&gone, text).unwrap();
        }
        for _ in 0..2 {
            let refused = store.accept(&operator(), upload("lost", "0001"), day(0.0)).await;
            assert!(matches!(refused, Err(StoreError::Displaced { .. })), "{number}: {refused:?}");
            let unready = store.ping().await;
            assert!(matches!(unready, Err(StoreError::Displaced { .. })), "{number}: {unready:?}");
        }
        // A connection that reads already goes on; where another one has to be opened, there is nothing to read.
        match store.pending().await {
            Ok(waiting) => assert_eq!(waiting, 1 + number as u64),
            Err(refused) => assert!(refused.is_outage(), "{refused:?}"),
        }
        fs::rename(&away, &gone).unwrap();
        insist(&store, &format!("u{}", number + 1)).await;
    }
    drain(&store).await;
    store.close().await;
    let store = database.open().await;
    assert_eq!(store.digest().await.unwrap().estimates, 4);
    assert_eq!(store.accept(&operator(), upload("u3", "0001"), day(0.0)).await.unwrap(), Receipt::Duplicate);
}

#[tokio::test]
async fn a_service_whose_file_was_replaced_takes_no_log_from_the_one_that_is_there_now() {
    let database = Database::new(Backend::Sqlite);
    let old = database.ready().await;
    let path = database.path();
    for name in [path.clone(), log(&path), format!("{}-shm", path.display()).into(), lock(&path)] {
        fs::remove_file(name).unwrap();
    }
    let new = database.ready().await;
    new.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    assert!(matches!(old.ping().await, Err(StoreError::Displaced { .. })));
    old.close().await;
    assert!(log(&path).exists());
    new.accept(&operator(), upload("u2", "0001"), day(0.0)).await.unwrap();
    assert_eq!(new.pending().await.unwrap(), 2);
}

fn lock(path: &Path) -> PathBuf {
    format!("{}.lock", path.display()).into()
}

#[tokio::test]
async fn nobody_else_may_read_the_files_of_data() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    let copy = beside(&database, "copy.db");
    store.copy_to(&copy).await.unwrap();
    let path = database.path();
    for file in [path.clone(), log(&path), format!("{}-shm", path.display()).into(), lock(&path), copy] {
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600, "{file:?}");
    }
}
