//! Derived rows, derived once more from their sources and compared with what is stored.
//!
//! It finds what no checksum can: a row that is missing, or one that was never right. Uploads are read one after the
//! other; in memory are an operator's installations, and the names of what was voided and created.

use std::{collections::BTreeSet, fmt::Debug};

use domain::{Action, AuditRecord, OperatorId, TailNumber};

use super::super::{
    Connection,
    access::{audit, operators},
    board::{
        self,
        curves::{self, CurveRow},
        derived,
        tails::TailBoardRow,
        units::{self, UnitRow},
    },
    events::standing,
    ground::row,
    lives::components,
    models::bundles,
    places::{movements, observed, sightings, tails, utilisation},
};
use crate::{DamagedRow, StoreError, Verification};

/// All operators that have rows to derive from, as far as they can be seen.
pub(super) async fn operators(connection: &mut Connection) -> Result<BTreeSet<OperatorId>, StoreError> {
    let mut operators: BTreeSet<OperatorId> = operators::names(connection).await?.into_iter().collect();
    // Whoever was given a token may have sent nothing.
    operators.extend(audit::chains(connection).await?.iter().filter_map(|chain| chain.parse().ok()));
    Ok(operators)
}

/// Derives what follows from the uploads, the events and the audit log of an operator.
pub(super) async fn verify(
    connection: &mut Connection,
    operator: &OperatorId,
    found: &mut Verification,
) -> Result<(), StoreError> {
    let compared = async {
        let defined = sightings::defined(connection, operator).await?;
        let told = tails::defined(connection, operator).await?;
        let tails = told.iter().map(ToString::to_string).collect();
        compare(found, "observed_installations", defined, observed::stored(connection, operator).await?);
        let known = names(connection, "select tail from tails where operator = $1", operator).await?;
        missing(found, "tails", operator, &tails, &known);
        let stored = movements::stored(connection, operator).await?;
        let events = standing::of_operator(connection, operator).await?;
        compare(found, "movements", movements::defined(operator, &events)?, stored);
        let (defined, stored) = board(connection, operator).await?;
        compare(found, "board", defined, stored);
        priors(connection, operator, found).await?;
        acts(connection, operator, found).await
    };
    told(compared.await, found)
}

/// What the board should say of an operator's components and tails, and what it says. How much a tail flies is told
/// while nothing on it waits: until then it may be what it was.
async fn board(connection: &mut Connection, operator: &OperatorId) -> Result<(Vec<String>, Vec<String>), StoreError> {
    let (mut defined, mut stored, mut tails) = (Vec::new(), Vec::new(), BTreeSet::new());
    for component in components::next_components(connection, operator, None, u32::MAX).await? {
        if let Some((unit, curve)) = derived::rows(connection, &component).await? {
            defined.push(format!("{unit:?}"));
            defined.extend(curve.map(|curve| format!("{curve:?}")));
        }
    }
    for row in curves::of_operator(connection, operator).await? {
        stored.push(format!("{:?}", CurveRow { checksum: None, ..row }));
    }
    for row in units::of_operator(connection, operator).await? {
        tails.extend(row.tail.parse::<TailNumber>().ok());
        stored.push(format!("{:?}", UnitRow { checksum: None, ..row }));
    }
    for tail in tails {
        let row = board::tails::find(connection, operator, &tail).await?;
        let waits = board::tails::waits(connection, operator, &tail).await?;
        let flown = match row.as_ref().filter(|_| waits) {
            Some(row) => row.flown(),
            None => utilisation::flown(connection, operator, &tail).await?,
        };
        let wanted = board::tails::derived(connection, operator, &tail, flown).await?;
        defined.push(format!("{wanted:?}"));
        stored.extend(row.map(|row| format!("{:?}", TailBoardRow { checksum: None, ..row })));
    }
    Ok((defined, stored))
}

/// Notes damage that keeps a table from being compared.
fn told(compared: Result<(), StoreError>, found: &mut Verification) -> Result<(), StoreError> {
    match compared {
        Err(StoreError::Corrupt { row, detail }) => {
            found.damaged.push(DamagedRow { table: "derived rows", row, detail: format!("not compared: {detail}") });
            Ok(())
        }
        compared => compared,
    }
}

/// Names the rows that are stored and should not be, and those that should be stored and are not.
fn compare<T: Ord + Debug>(found: &mut Verification, table: &'static str, defined: Vec<T>, stored: Vec<T>) {
    let (defined, stored) = (BTreeSet::from_iter(defined), BTreeSet::from_iter(stored));
    let row = |row: &T, detail: &str| DamagedRow { table, row: format!("{row:?}"), detail: detail.to_owned() };
    found.damaged.extend(defined.difference(&stored).map(|one| row(one, "it is missing")));
    found.damaged.extend(stored.difference(&defined).map(|one| row(one, "nothing tells it")));
}

/// Names what should be there by its name and is not.
fn missing(
    found: &mut Verification,
    table: &'static str,
    operator: &OperatorId,
    wanted: &BTreeSet<String>,
    known: &BTreeSet<String>,
) {
    let row =
        |name: &String| DamagedRow { table, row: format!("{operator}/{name}"), detail: "it is missing".to_owned() };
    found.damaged.extend(wanted.difference(known).map(row));
}

async fn names(
    connection: &mut Connection,
    sql: &'static str,
    operator: &OperatorId,
) -> Result<BTreeSet<String>, StoreError> {
    let names: Vec<String> = sqlx::query_scalar(sql).bind(operator.as_str()).fetch_all(connection).await?;
    Ok(names.into_iter().collect())
}

/// The priors by which an operator's lives are judged: its own, and those of bundles.
async fn priors(
    connection: &mut Connection,
    operator: &OperatorId,
    found: &mut Verification,
) -> Result<(), StoreError> {
    let hashes = |rows: Vec<Vec<u8>>| rows.iter().map(|bytes| hash_name(bytes)).collect::<BTreeSet<String>>();
    let judging = sqlx::query_scalar("select distinct prior from generations where operator = $1");
    let judging = hashes(judging.bind(operator.as_str()).fetch_all(&mut *connection).await?);
    let learned = sqlx::query_scalar("select hash from priors where operator = $1");
    let mut known = hashes(learned.bind(operator.as_str()).fetch_all(&mut *connection).await?);
    known.extend(bundles::readable(connection).await?.iter().map(|bundle| bundle.prior.to_string()));
    missing(found, "priors", operator, &judging, &known);
    Ok(())
}

fn hash_name(bytes: &[u8]) -> String {
    row::hash("hashes", bytes).map_or_else(|error| error.to_string(), |hash| hash.to_string())
}

/// Compares an operator's audit log with what must be there since.
async fn acts(connection: &mut Connection, operator: &OperatorId, found: &mut Verification) -> Result<(), StoreError> {
    let (mut uploads, mut events, mut tokens) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    let (mut configurations, mut plans, mut keys) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    let (mut settings, mut checks) = (BTreeSet::new(), BTreeSet::new());
    audit::each(connection, Some(operator), |record: AuditRecord| {
        match record.action {
            Action::UploadVoided => uploads.insert(record.subject),
            Action::EventVoided => events.insert(record.subject),
            Action::TokenCreated => tokens.insert(record.subject),
            Action::FrameKeyCreated => keys.insert(record.subject),
            Action::SensorConfigurationAdded => configurations.insert(record.subject),
            Action::SettingsSet => settings.insert(record.at.micros().to_string()),
            Action::ChecksSet => checks.insert(format!("{} at {}", record.subject, record.at.micros())),
            Action::PlanSet => plans.insert(format!("{} at {}", record.subject, record.at.micros())),
            _ => false,
        };
    })
    .await?;
    for (table, wanted, sql) in [
        ("voided", uploads, "select upload_id from voided where operator = $1"),
        ("voided_events", events, "select event_id from voided_events where operator = $1"),
        ("tokens", tokens, "select token_id from tokens where operator = $1"),
        ("frame_keys", keys, "select key_id from frame_keys where operator = $1"),
        (
            "tail_sensor_configurations",
            configurations,
            "select distinct tail from tail_sensor_configurations where operator = $1",
        ),
        ("operator_settings", settings, "select cast(set_at as text) from operator_settings where operator = $1"),
        ("tail_checks", checks, "select tail || ' at ' || cast(set_at as text) from tail_checks where operator = $1"),
        ("tail_plans", plans, "select tail || ' at ' || cast(set_at as text) from tail_plans where operator = $1"),
    ] {
        let known = names(connection, sql, operator).await?;
        missing(found, table, operator, &wanted, &known);
    }
    Ok(())
}

/// Compares the audit log of the installation with what must be there since.
pub(super) async fn verify_installation(
    connection: &mut Connection,
    found: &mut Verification,
) -> Result<(), StoreError> {
    let (mut added, mut active) = (BTreeSet::new(), None);
    let read = audit::each(connection, None, |record: AuditRecord| match record.action {
        Action::ModelAdded => {
            added.insert(record.subject);
        }
        Action::ModelActivated => active = Some(record.subject),
        _ => {}
    });
    told(read.await, found)?;
    let rows: Vec<(Vec<u8>, i64)> =
        sqlx::query_as("select hash, active from bundles").fetch_all(&mut *connection).await?;
    let known: BTreeSet<String> = rows.iter().map(|(bytes, _)| hash_name(bytes)).collect();
    let activated = rows.iter().find(|(_, active)| *active == 1).map(|(bytes, _)| hash_name(bytes));
    let published: Vec<Vec<u8>> = sqlx::query_scalar("select mask_id from masks").fetch_all(&mut *connection).await?;
    let published: BTreeSet<String> = published.iter().map(|bytes| hash_name(bytes)).collect();
    let bundles = bundles::readable(connection).await?;
    let masks = bundles.iter().flat_map(|bundle| &bundle.masks).map(|mask| mask.id().to_string());
    let mut tell = |table: &'static str, row: String, detail: &str| {
        found.damaged.push(DamagedRow { table, row, detail: detail.to_owned() });
    };
    for lost in added.difference(&known) {
        tell("bundles", lost.clone(), "it is missing");
    }
    for lost in masks.filter(|mask| !published.contains(mask)) {
        tell("masks", lost, "it is missing");
    }
    if active.is_some() && active != activated {
        tell("bundles", active.unwrap_or_default(), "it was activated last, and is not active");
    }
    Ok(())
}
