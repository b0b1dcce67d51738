//! What only SQLite can get wrong: the file, its owner, its damage.

mod audit;
mod beside;
mod damage;
mod file;
mod flips;
mod migration;
mod opening;
mod writing;

use crate::fixture::{
    self, Backend, Database, by_hand, checks, component, configuration, day, drain, finding, frame_key, later_upload,
    operator, plan, prior, settings, tail, token,
};
use domain::{Actor, ContentHash, Finding};
use sqlx::{Connection, Executor, SqliteConnection, sqlite::SqliteConnectOptions};
use std::{fs, path::Path};
use store::{Options, Store, StoreError};

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

/// What a killed process leaves behind: the database and its log, without a closing checkpoint.
fn killed(database: &Database) -> Database {
    let left_behind = Database::new(Backend::Sqlite);
    for suffix in ["", "-wal"] {
        let name = |database: &Database| format!("{}{suffix}", database.path().display());
        fs::copy(name(database), name(&left_behind)).unwrap();
    }
    left_behind
}

/// A database with a processed and finished life and a learned prior, closed.
async fn with_history() -> Database {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    for i in 0..10 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    let configuration = configuration(0.25);
    store.add_sensor_configuration(&operator(), &tail("EC-MXA"), day(2.0), &configuration, by_hand(0.0)).await.unwrap();
    store.set_plan(&operator(), &tail("EC-MXA"), &plan(4.0), by_hand(0.0)).await.unwrap();
    store.set_checks(&operator(), &[(tail("EC-MXA"), checks(90.0))], by_hand(0.0)).await.unwrap();
    store.set_settings(&operator(), &settings(0.25), by_hand(0.0)).await.unwrap();
    drain(&store).await;
    let event = finding("end", "0001", Finding::Failed, 1000.0);
    store.record_event(&operator(), &event, day(0.0)).await.unwrap();
    store.add_prior(&operator(), &prior("learned", 10, 0.0), b"learned").await.unwrap();
    store.create_token(&token(&operator(), 2).1, Actor::Cli).await.unwrap();
    store.create_frame_key(&frame_key(&operator(), 2), Actor::Cli).await.unwrap();
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
    plans: Vec<store::TailPlan>,
    checks: Option<store::TailChecks>,
    settings: Option<store::OperatorSettings>,
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
        plans: store.plans(&operator(), &tail("EC-MXA")).await?,
        checks: store.checks(&operator(), &tail("EC-MXA")).await?,
        settings: store.settings(&operator()).await?,
        component: store.component(&component("0001")).await?,
        events: store.events(&component("0001")).await?,
        finished: store.issued_on_finished_lives(&operator(), 200.0, 10).await?,
        priors: store.priors(&operator()).await?,
        prior: store.prior_body(&operator(), &ContentHash::of(b"learned")).await?,
    })
}
