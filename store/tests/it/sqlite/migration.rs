//! Databases of earlier schemas.

use domain::{Checks, Finding, Plan, SetAsideReason};
use sqlx::{Connection, Executor, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions};
use std::{fs, path::Path};
use store::{EventReceipt, Retrial, UploadState};

use super::{Served, execute, served, with_history};
use crate::fixture::{
    Backend, Database, by_hand, checks, day, drain, finding, operator, plan, prior, settings, tail, upload,
};

/// A database as a build that knew only some first migrations left it, with rows that `copies` take out of
/// a later one.
async fn of_schema(migrations: &[&str], later: &Database, copies: &[&'static str]) -> Database {
    let folder = tempfile::tempdir().unwrap();
    for migration in migrations {
        fs::copy(Path::new("../migrations/sqlite").join(migration), folder.path().join(migration)).unwrap();
    }
    let database = Database::new(Backend::Sqlite);
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
    "insert into uploads select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum
       from later.uploads",
    "insert into component_queue select * from later.component_queue",
    "insert into estimates select * from later.estimates",
    "insert into states select * from later.states",
    "insert into prognoses select operator, part_number, serial_number, overhaul_index, generation, fence,
       issued_at, body, checksum from later.prognoses",
    "insert into lives (operator, part_number, serial_number, overhaul_index, generation)
     select operator, part_number, serial_number, overhaul_index, generation from later.lives",
];

/// A database of the first schema: with the rows of `with_history`, one upload set aside and one that waits.
pub async fn of_first_schema(history: &Database) -> Database {
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

/// Takes back what a build of the second schema does not know: the finding, the prior, the plan, the checks and the settings.
fn without_learning(served: Served) -> Served {
    let mut served = Served { events: Vec::new(), finished: Vec::new(), priors: Vec::new(), prior: None, ..served };
    served.component.iter_mut().flat_map(|one| &mut one.lives).for_each(|life| life.found_failed_fh = None);
    for one in &mut served.installed {
        (one.found_failed_fh, one.plan, one.checks) = (None, Plan::default(), Checks::default());
    }
    Served { plans: Vec::new(), checks: None, settings: None, ..served }
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
    store.set_plan(&operator(), &tail("EC-MXA"), &plan(4.0), by_hand(0.0)).await.unwrap();
    store.set_checks(&operator(), &[(tail("EC-MXA"), checks(90.0))], by_hand(0.0)).await.unwrap();
    store.set_settings(&operator(), &settings(0.25), by_hand(0.0)).await.unwrap();
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
