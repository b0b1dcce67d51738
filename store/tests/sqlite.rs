//! What only SQLite can get wrong: the file, its owner, its damage.

mod fixture;

/// The database that stands behind the store.
const BACKEND: fixture::Backend = fixture::Backend::Sqlite;

use std::{fs, path::Path};

use domain::{Actor, ContentHash, EventKind, Finding, MaintenanceEvent, SetAsideReason};
use fixture::{
    Database, bundle, by_hand, component, configuration, day, drain, finding, later_upload, lease, life_inputs,
    operator, prior, results, serve, tail, token, upload,
};
use metrics_exporter_prometheus::PrometheusBuilder;
use sqlx::{Connection, Executor, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions};
use store::{Checkpoint, Completion, EventReceipt, Options, Receipt, Retrial, Store, StoreError, UploadState, Voiding};
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

/// Counts the rows that are written of where components are.
const COUNT_WRITES: &str = "
    create table writes (row integer primary key);
    create trigger a1 after insert on installations begin insert into writes values (null); end;
    create trigger a2 after delete on installations begin insert into writes values (null); end;
    create trigger a3 after update on installations begin insert into writes values (null); end;
    create trigger a4 after insert on observed_installations begin insert into writes values (null); end;
    create trigger a5 after delete on observed_installations begin insert into writes values (null); end;
    create trigger a6 after update on observed_installations begin insert into writes values (null); end;";

#[tokio::test]
async fn the_last_of_many_turns_at_a_place_writes_as_many_rows_as_the_first() {
    let database = Database::new();
    let store = database.ready().await;
    execute(&database.path(), COUNT_WRITES).await;
    let seen = |turn: usize| later_upload(&format!("u{turn}"), ["0001", "0002"][turn % 2], turn as f64);
    let moved = |turn: usize| MaintenanceEvent {
        kind: [EventKind::Install, EventKind::Remove][turn % 2],
        occurred_at: day(100.0 + turn as f64),
        ..finding(&format!("e{turn}"), "0003", Finding::Serviceable, 0.0)
    };
    let mut written = Vec::new();
    for turn in 0..300 {
        if turn % 20 == 0 {
            written.push(execute(&database.path(), "delete from writes").await);
        }
        store.accept(&operator(), seen(turn), day(0.0)).await.unwrap();
        store.record_event(&operator(), &moved(turn), day(0.0)).await.unwrap();
    }
    assert!(written[2] > 20, "{written:?}");
    assert!(written[2..].iter().all(|rows| *rows == written[2]), "{written:?}");
    store.accept(&operator(), later_upload("late", "0002", 2.0), day(0.0)).await.unwrap();
    assert!(execute(&database.path(), "delete from writes").await <= written[2] + 8);
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
    for url in ["mysql://localhost/actuary", "fleet.db", "sqlite:", "sqlite::memory:"] {
        let refused = Store::open(url, Options::default()).await.err().unwrap();
        assert!(matches!(refused, StoreError::UnsupportedUrl { .. }), "{url}: {refused:?}");
    }
    let refused = Store::open("sqlite:/nowhere/fleet.db", Options::default()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
}

/// What a killed process leaves behind: the database and its log, without a closing checkpoint.
fn killed(database: &Database) -> Database {
    let left_behind = Database::new();
    for suffix in ["", "-wal"] {
        let name = |database: &Database| format!("{}{suffix}", database.path().display());
        fs::copy(name(database), name(&left_behind)).unwrap();
    }
    left_behind
}

#[tokio::test]
async fn what_is_acknowledged_is_in_the_files() {
    let database = Database::new();
    let store = database.ready().await;
    for i in 0..10 {
        store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
    }
    let events = ["kept", "voided"].map(|id| finding(id, "0001", Finding::Failed, 200.0));
    for event in &events {
        store.record_event(&operator(), event, day(0.0)).await.unwrap();
    }
    store.void_event(&operator(), &events[1].event_id, by_hand(0.0)).await.unwrap();
    store.add_prior(&operator(), &prior("learned", 10, 0.0), b"learned").await.unwrap();
    let left_behind = killed(&database);
    let store = left_behind.open().await;
    assert_eq!(store.pending().await.unwrap(), 10);
    for event in &events {
        assert_eq!(store.record_event(&operator(), event, day(1.0)).await.unwrap(), EventReceipt::Duplicate);
    }
    let voided = store.void_event(&operator(), &events[1].event_id, by_hand(1.0)).await.unwrap();
    assert_eq!(voided, Some(Voiding::AlreadyVoided));
    assert_eq!(store.component(&component("0001")).await.unwrap().unwrap().lives[0].found_failed_fh, Some(200.0));
    assert_eq!(store.priors(&operator()).await.unwrap(), [prior("learned", 10, 0.0)]);
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

#[tokio::test]
async fn a_transaction_that_the_database_ended_by_itself_is_the_last_of_its_connection_only() {
    let database = Database::new();
    database.ready().await.close().await;
    // As a full disk does, it leaves nothing to be rolled back; the other fails in the commit itself.
    for sql in [
        "create trigger gone before insert on uploads when new.upload_id like 'gone%'
         begin select raise(rollback, 'ended by the test'); end",
        "create table elsewhere (id text primary key)",
        "create table bound (id text references elsewhere deferrable initially deferred)",
        "create trigger late after insert on uploads when new.upload_id like 'late%'
         begin insert into bound values (new.upload_id); end",
    ] {
        execute(&database.path(), sql).await;
    }
    let store = database.open().await;
    for bad in ["gone", "late"] {
        let mut callers = JoinSet::new();
        for i in 0..20 {
            let (store, failing) = (store.clone(), i % 7 == 3);
            let id = if failing { format!("{bad}{i}") } else { format!("{i}-beside-{bad}") };
            callers.spawn(
                async move { (failing, store.accept(&operator(), upload(&id, "0001"), day(0.0)).await.is_err()) },
            );
        }
        for (failing, failed) in callers.join_all().await {
            assert_eq!(failing, failed, "{bad}");
        }
        store.ping().await.unwrap();
        let after = store.accept(&operator(), upload(&format!("after-{bad}"), "0001"), day(0.0)).await;
        assert_eq!(after.unwrap(), Receipt::Accepted);
    }
    assert_eq!(store.pending().await.unwrap(), 2 * 17 + 2);
}

#[tokio::test]
async fn every_commit_is_measured() {
    let recorder = PrometheusBuilder::new().build_recorder();
    let figures = recorder.handle();
    let _recording = metrics::set_default_local_recorder(&recorder);
    let database = Database::new();
    let store = database.ready().await;
    let commits = || {
        let text = figures.render();
        let line = text.lines().find(|line| line.starts_with("commit_seconds_count")).unwrap();
        line.rsplit(' ').next().unwrap().parse::<u64>().unwrap()
    };
    let before = commits();
    for id in ["u1", "u2", "u3"] {
        store.accept(&operator(), upload(id, "0001"), day(0.0)).await.unwrap();
    }
    assert_eq!(commits(), before + 3);
}

/// A database with a processed and finished life and a learned prior, closed.
async fn with_history() -> Database {
    let database = Database::new();
    let store = database.ready().await;
    for i in 0..10 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    let configuration = configuration(0.25);
    store.add_sensor_configuration(&operator(), &tail("EC-MXA"), day(2.0), &configuration, by_hand(0.0)).await.unwrap();
    drain(&store).await;
    let event = finding("end", "0001", Finding::Failed, 1000.0);
    store.record_event(&operator(), &event, day(0.0)).await.unwrap();
    store.add_prior(&operator(), &prior("learned", 10, 0.0), b"learned").await.unwrap();
    store.create_token(&token(&operator(), 2).1, Actor::Cli).await.unwrap();
    store.close().await;
    database
}

#[derive(Debug, Clone, PartialEq)]
struct Served {
    uploads: Vec<store::UploadRecord>,
    estimates: Vec<domain::Estimate>,
    states: Vec<domain::State>,
    installed: Vec<store::Installed>,
    mask: Option<store::PublishedMask>,
    bundles: Vec<store::BundleRecord>,
    configurations: Vec<store::TailConfiguration>,
    component: Option<store::ComponentRecord>,
    events: Vec<store::EventRecord>,
    finished: Vec<store::IssuedLife>,
    priors: Vec<store::PriorRecord>,
    prior: Option<Vec<u8>>,
}

/// Everything that is served of such a database.
async fn served(store: &Store) -> Result<Served, StoreError> {
    let mut uploads = Vec::new();
    for i in 0..10 {
        uploads.extend(store.upload(&operator(), &format!("u{i}").parse().unwrap()).await?);
    }
    Ok(Served {
        uploads,
        estimates: store.estimates(&component("0001"), None, None, None, None, 100).await?,
        states: store.states(&component("0001"), None, None, None, None, 100).await?,
        installed: store.installed(&operator(), &tail("EC-MXA")).await?,
        mask: store.mask(&fixture::mask().id()).await?,
        bundles: store.bundles().await?,
        configurations: store.sensor_configurations(&operator(), &tail("EC-MXA")).await?,
        component: store.component(&component("0001")).await?,
        events: store.events(&component("0001")).await?,
        finished: store.issued_on_finished_lives(&operator(), 200.0, 10).await?,
        priors: store.priors(&operator()).await?,
        prior: store.prior_body(&operator(), &ContentHash::of(b"learned")).await?,
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
        ("prognoses", "update prognoses set forecast_from_fh = forecast_from_fh - 0.5"),
        ("prognoses", "update prognoses set forecast_from_fh = null"),
        ("maintenance_events", "update maintenance_events set body = replace(body, '1000', '1001')"),
        ("maintenance_events", "update maintenance_events set flight_hours = flight_hours + 1"),
        ("maintenance_events", "update maintenance_events set kind = 'finding_serviceable'"),
        ("priors", "update priors set lives = 100"),
        ("priors", "update priors set body = x'00'"),
        ("masks", "update masks set k_nom = 0.0753"),
        ("sensor_configurations", "update sensor_configurations set body = replace(body, '0.25', '0.26')"),
        ("tail_sensor_configurations", "update tail_sensor_configurations set effective_from = effective_from - 1"),
        ("bundles", "update bundles set summary = replace(summary, '0.0752', '0.0753')"),
    ] {
        let database = with_history().await;
        assert!(execute(&database.path(), damage).await > 0, "{damage}");
        let store = database.open().await;
        let found = store.verify().await.unwrap();
        assert!(found.damaged.iter().any(|row| row.table == table), "{damage}: {found:?}");
        match served(&store).await {
            Err(StoreError::Corrupt { row, .. }) => assert!(row.contains(table), "{damage}: {row}"),
            Ok(served) => {
                let unit = &served.installed[0];
                assert!(unit.is_damaged && unit.prognosis.is_none(), "{damage}: {unit:?}");
            }
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
async fn a_damaged_token_lets_nobody_in() {
    for damage in [
        "update tokens set operator = 'elsewhere'",
        "update tokens set scope = 'admin'",
        "update tokens set tail = 'EC-MXB', scope = 'aircraft'",
        "update tokens set name = null",
        "update tokens set secret_hash = zeroblob(32)",
        "update tokens set created_at = created_at + 1",
        "update tokens set expires_at = null",
        "update tokens set revoked_at = 1",
    ] {
        let database = with_history().await;
        assert_eq!(execute(&database.path(), damage).await, 1);
        let found = database.open().await.token(&token(&operator(), 2).0.id).await;
        assert!(matches!(found, Err(StoreError::Corrupt { .. })), "{damage}: {found:?}");
    }
}

#[tokio::test]
async fn a_damaged_bundle_is_not_handed_out() {
    let database = with_history().await;
    execute(&database.path(), "update bundles set body = x'00'").await;
    let store = database.open().await;
    assert_eq!(store.verify().await.unwrap().damaged.len(), 1);
    let body = store.bundle_body(&bundle("one").hash).await;
    assert!(matches!(body, Err(StoreError::Corrupt { .. })), "{body:?}");
}

/// A database as a build that knew only some first migrations left it, with rows that `copies` take out of
/// a later one.
async fn of_schema(migrations: &[&str], later: &Database, copies: &[&'static str]) -> Database {
    let folder = tempfile::tempdir().unwrap();
    for migration in migrations {
        fs::copy(Path::new("../migrations/sqlite").join(migration), folder.path().join(migration)).unwrap();
    }
    let database = Database::new();
    let options = SqliteConnectOptions::new().filename(database.path()).create_if_missing(true);
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    Migrator::new(folder.path()).await.unwrap().run_direct(None, &mut connection, false).await.unwrap();
    sqlx::query("attach $1 as later").bind(later.path().to_str()).execute(&mut connection).await.unwrap();
    for copy in copies {
        connection.execute(*copy).await.unwrap();
    }
    connection.close().await.unwrap();
    database
}

/// Rows that no migration has changed.
const UNCHANGED: [&str; 14] = [
    "insert into bundles select hash, summary, body, active, added_at, activated_at, checksum from later.bundles",
    "insert into masks select * from later.masks",
    "insert into operators select operator, enrolled_at from later.operators",
    "insert into tails select operator, tail from later.tails",
    "insert into components select operator, part_number, serial_number, enrolled_at from later.components",
    "insert into generations select operator, part_number, serial_number, overhaul_index, number, model, prior from later.generations",
    "insert into installations select operator, tail, position, part_number, serial_number, from_at, from_upload, to_at,
       to_upload from later.observed_installations",
    "insert into upload_keys select operator, upload_id, part_number, serial_number, recorded_at, content_hash from later.upload_keys",
    "insert into uploads select * from later.uploads",
    "insert into component_queue select * from later.component_queue",
    "insert into estimates select * from later.estimates",
    "insert into states select * from later.states",
    "insert into prognoses select operator, part_number, serial_number, overhaul_index, generation, fence,
       issued_at, body, checksum from later.prognoses",
    "insert into lives (operator, part_number, serial_number, overhaul_index, generation)
     select operator, part_number, serial_number, overhaul_index, generation from later.lives",
];

/// A database of the first schema: with the rows of `with_history`, one upload set aside and one that waits.
async fn of_first_schema(history: &Database) -> Database {
    let waiting = [
        "insert into inbox select operator, part_number, serial_number, recorded_at, upload_id from later.inbox",
        "insert into set_aside select operator, part_number, serial_number, recorded_at, upload_id,
           'bins of 180, not of 360', recorded_at from later.uploads where upload_id = 'aside'",
        "delete from inbox where upload_id = 'aside'",
    ];
    of_schema(&["0001_initial.sql"], history, &[UNCHANGED.as_slice(), &waiting].concat()).await
}

/// A database of the second schema, with the rows of `with_history`.
async fn of_second_schema(history: &Database) -> Database {
    let added = [
        "update lives set prognosis_fence = (select max(fence) from prognoses)",
        "insert into sensor_configurations select * from later.sensor_configurations",
        "insert into tail_sensor_configurations select * from later.tail_sensor_configurations",
    ];
    let migrations = ["0001_initial.sql", "0002_corrections.sql"];
    of_schema(&migrations, history, &[UNCHANGED.as_slice(), &added].concat()).await
}

/// Takes back what a build of the second schema does not know: the finding and the prior.
fn without_learning(served: Served) -> Served {
    let mut served = Served { events: Vec::new(), finished: Vec::new(), priors: Vec::new(), prior: None, ..served };
    served.component.iter_mut().flat_map(|one| &mut one.lives).for_each(|life| life.found_failed_fh = None);
    served.installed.iter_mut().for_each(|one| one.found_failed_fh = None);
    served
}

#[tokio::test]
async fn a_database_of_the_first_schema_keeps_its_rows_and_its_answers() {
    let history = with_history().await;
    let store = history.open().await;
    for id in ["aside", "waits"] {
        store.accept(&operator(), upload(id, "0001"), day(7.0)).await.unwrap();
    }
    let expected = Served { configurations: Vec::new(), ..without_learning(served(&store).await.unwrap()) };
    assert!(expected.installed[0].prognosis.is_some() && !expected.states.is_empty());
    store.close().await;
    let database = of_first_schema(&history).await;
    let store = database.open().await;
    let state = async |id: &str| store.upload(&operator(), &id.parse().unwrap()).await.unwrap().unwrap().state;
    let aside =
        UploadState::SetAside { reason: SetAsideReason::NotEstimable, detail: "bins of 180, not of 360".to_owned() };
    assert_eq!(state("aside").await, aside);
    assert_eq!(state("waits").await, UploadState::Pending);
    let figures = store.work_figures().await.unwrap();
    assert_eq!((figures.pending, figures.oldest_pending_since, figures.set_aside), (1, Some(day(7.0)), 1));
    let retried = store.retry_upload(&operator(), &"aside".parse().unwrap(), by_hand(8.0)).await.unwrap();
    assert_eq!(retried, Some(Retrial::Retried));
    assert_eq!(served(&store).await.unwrap(), expected);
    assert_eq!(store.verify().await.unwrap().damaged, [], "its rows have their checksums");
    drain(&store).await;
    assert_eq!(state("aside").await, UploadState::Processed);
}

#[tokio::test]
async fn a_database_of_the_second_schema_keeps_its_answers_and_its_issued_forecasts() {
    let history = with_history().await;
    let store = history.open().await;
    let expected = served(&store).await.unwrap();
    assert!(!expected.finished[0].prognoses.is_empty());
    store.close().await;
    let database = of_second_schema(&history).await;
    let store = database.open().await;
    let event = finding("end", "0001", Finding::Failed, 1000.0);
    assert_eq!(without_learning(served(&store).await.unwrap()), without_learning(expected.clone()));
    assert_eq!(store.record_event(&operator(), &event, day(0.0)).await.unwrap(), EventReceipt::Recorded);
    store.add_prior(&operator(), &prior("learned", 10, 0.0), b"learned").await.unwrap();
    assert_eq!(served(&store).await.unwrap(), expected);
}

#[tokio::test]
async fn a_damaged_prognosis_does_not_keep_a_database_from_being_migrated() {
    let database = of_second_schema(&with_history().await).await;
    assert!(execute(&database.path(), "update prognoses set body = substr(body, 2)").await > 0);
    let store = database.open().await;
    let unit = store.installed(&operator(), &tail("EC-MXA")).await.unwrap().remove(0);
    assert!(unit.is_damaged && unit.prognosis.is_none(), "{unit:?}");
}

#[tokio::test]
async fn a_damaged_checkpoint_is_as_if_it_were_not_there() {
    for damage in [
        "update checkpoints set body = x'00' where block = (select max(block) from checkpoints)",
        "update checkpoints set checksum = zeroblob(32) where block = (select max(block) from checkpoints)",
        "update checkpoints set digest = zeroblob(32) where block = (select max(block) from checkpoints)",
        "update checkpoints set block = block + 1 where block = (select max(block) from checkpoints)",
        "delete from checkpoints where block = (select max(block) from checkpoints)",
    ] {
        let database = Database::new();
        let store = database.ready().await;
        for i in 0..4 {
            let upload = later_upload(&format!("u{i}"), "0001", 1000.0 * f64::from(i));
            store.accept(&operator(), upload, day(0.0)).await.unwrap();
        }
        let lease = fixture::lease(&store).await;
        let mut results = results(&life_inputs(&store, &lease).await);
        let checkpoint = |state: &domain::State| Checkpoint {
            block: state.block,
            digest: state.digest,
            body: state.digest.bytes().to_vec(),
        };
        results.checkpoints = results.states.iter().map(checkpoint).collect();
        let (kept, states) = (results.checkpoints.clone(), results.states.clone());
        store.complete(&lease, vec![results]).await.unwrap();
        let digest = store.digest().await.unwrap();
        store.close().await;
        assert_eq!(execute(&database.path(), damage).await, 1, "{damage}");
        let store = Store::open_read_only(&database.url()).await.unwrap();
        let mut wanted: Vec<_> = states.iter().map(|state| (state.block, state.digest)).collect();
        wanted.extend(states.last().map(|state| (state.block + 1, state.digest)));
        let found = store.checkpoint(&component("0001"), 0, 1, &wanted).await.unwrap();
        assert_eq!(found.as_ref(), Some(&kept[kept.len() - 2]), "{damage}");
        assert_eq!(store.digest().await.unwrap(), digest);
    }
}

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
async fn what_a_killed_process_left_in_the_log_is_read() {
    let database = Database::new();
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
    let database = Database::new();
    let refused = Store::open_read_only(&database.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
    assert!(!database.path().exists());
    let old = of_first_schema(&with_history().await).await;
    let refused = Store::open_read_only(&old.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::OlderSchema { version: 1, .. }), "{refused:?}");
    old.open().await.close().await;
    Store::open_read_only(&old.url()).await.unwrap();
}

#[tokio::test]
async fn a_reopened_database_leases_at_once_what_was_leased_before() {
    let database = Database::new();
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let before = lease(&store).await;
    store.close().await;
    let store = database.open().await;
    assert_eq!(serve(&store, &before).await, Completion::Fenced);
    let after = lease(&store).await;
    assert_eq!((after.fence, after.attempts), (before.fence + 1, 1));
}

/// A database whose operator `default` has a chain of five records.
async fn with_audit() -> Database {
    let database = Database::new();
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

#[tokio::test]
async fn administrative_acts_are_done_beside_the_owner_who_sees_them_at_once() {
    let database = Database::new();
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
    let database = Database::new();
    let refused = Store::open_beside(&database.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::Io { .. }), "{refused:?}");
    assert!(!database.path().exists());
    let old = of_first_schema(&with_history().await).await;
    let refused = Store::open_beside(&old.url()).await.err().unwrap();
    assert!(matches!(refused, StoreError::OlderSchema { version: 1, .. }), "{refused:?}");
}
