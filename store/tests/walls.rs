//! The walls between operators hold without the application's own filters.
//!
//! All SQL that the store sends for an operator is taken from the log of a server, and sent again by another
//! one: as it is, and with every comparison of an operator cut out. What that one is answered must not depend on
//! whether the other has any rows, and must not change them.

mod fixture;

/// The database that stands behind the store.
const BACKEND: fixture::Backend = fixture::Backend::Postgres;

use std::{collections::BTreeMap, fs};

use domain::{Actor, EventKind, Finding, MaintenanceEvent, OperatorId, Upload};
use fixture::{bundle, bundle_body, by_hand, configuration, day, drain, fail, finding, later_upload, prior, tail};
use serde_json::Value;
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection, Row, ValueRef};
use store::{Options, Store, UploadStateKind};
use tests::postgres::{Cluster, TestDatabase};

const OWN: &str = "alpha";
const FOREIGN: &str = "bravo";

/// Everything that a store does for an operator.
async fn live(store: &Store, operator: &OperatorId) {
    let upload = |i: usize| {
        let hours = [10.0 * i as f64, 6000.0][usize::from(i == 11)];
        Upload { tail: tail("EC-MXA"), ..later_upload(&format!("{operator}-{i}"), &format!("{operator}-unit"), hours) }
    };
    for i in 0..12 {
        store.accept(operator, upload(i), day(0.0)).await.unwrap();
    }
    store.accept(operator, upload(0), day(0.0)).await.unwrap();
    let known = |i: usize| upload(i).upload_id;
    store
        .add_sensor_configuration(operator, &tail("EC-MXA"), day(2.0), &configuration(0.25), by_hand(0.0))
        .await
        .unwrap();
    drain(store).await;
    store.void_upload(operator, &known(3), by_hand(1.0)).await.unwrap();
    store.retry_upload(operator, &known(11), by_hand(1.0)).await.unwrap();
    drain(store).await;
    let component = upload(0).component(operator);
    fail(store, operator, component.serial_number.as_str(), 1000.0).await;
    let mistaken = MaintenanceEvent {
        kind: EventKind::Finding(Finding::Serviceable),
        ..finding(&format!("{operator}-mistake"), component.serial_number.as_str(), Finding::Failed, 500.0)
    };
    store.record_event(operator, &mistaken, day(0.0)).await.unwrap();
    store.void_event(operator, &mistaken.event_id, by_hand(0.0)).await.unwrap();
    store.add_prior(operator, &prior(operator.as_str(), 10, 0.0), operator.as_str().as_bytes()).await.unwrap();
    let (_, token) = fixture::token(operator, operator.as_str().as_bytes()[0]);
    store.create_token(&token, Actor::Cli).await.unwrap();

    store.upload(operator, &known(1)).await.unwrap().unwrap();
    let states =
        [UploadStateKind::Pending, UploadStateKind::Processed, UploadStateKind::SetAside, UploadStateKind::Voided];
    for state in states {
        store.uploads(operator, state, None, 10).await.unwrap();
    }
    assert_eq!(store.tails(operator, None, 10).await.unwrap().len(), 1);
    assert!(store.knows_tail(operator, &tail("EC-MXA")).await.unwrap());
    assert_eq!(store.installed_fleet(operator, None, 10).await.unwrap().len(), 1);
    assert_eq!(store.installed(operator, &tail("EC-MXA")).await.unwrap().len(), 1);
    assert!(store.component(&component).await.unwrap().is_some());
    assert!(!store.estimates(&component, None, None, None, None, 100).await.unwrap().is_empty());
    assert!(!store.states(&component, None, None, None, None, 100).await.unwrap().is_empty());
    assert_eq!(store.events(&component).await.unwrap().len(), 2);
    assert!(store.event(operator, &mistaken.event_id).await.unwrap().is_some());
    assert_eq!(store.issued_on_finished_lives(operator, 200.0, 10).await.unwrap().len(), 1);
    let finished = store.finished_lives(operator, &component.part_number, &bundle("one").hash).await.unwrap();
    assert_eq!(finished.len(), 1);
    assert_eq!(store.priors(operator).await.unwrap().len(), 1);
    store.prior_body(operator, &prior(operator.as_str(), 10, 0.0).hash).await.unwrap().unwrap();
    store.sensor_configurations(operator, &tail("EC-MXA")).await.unwrap();
    assert_eq!(store.tokens(operator).await.unwrap().len(), 1);
    store.audit(Some(operator), 0, 10).await.unwrap();
    store.checkpoint(&component, 0, 1, &[(1, bundle("one").hash)]).await.unwrap();
    store.lessons().await.unwrap();
    store.digest().await.unwrap();
    store.verify().await.unwrap();
    store.work_figures().await.unwrap();
}

/// A statement with the parameters that it was sent with.
#[derive(Debug, Clone)]
struct Statement {
    sql: String,
    parameters: BTreeMap<usize, String>,
}

impl Statement {
    /// From a record of the log, if it is one of the service's.
    fn of(record: &Value) -> Option<Self> {
        let text = |field: &str| record[field].as_str().unwrap_or_default();
        if text("user") != "actuary_test_service" {
            return None;
        }
        let (_, sql) = text("message").strip_prefix("execute ")?.split_once(": ")?;
        let detail = text("detail");
        let parameters = detail.split_once(": ").map(|(_, list)| parameters(list)).unwrap_or_default();
        Some(Self { sql: sql.to_owned(), parameters })
    }

    /// The text with literals in the place of parameters.
    fn literal(&self, sql: &str) -> String {
        let mut parts = sql.split('$');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let digits = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
            let literal = part[..digits].parse().ok().and_then(|number: usize| self.parameters.get(&number));
            text += literal.map_or("null", String::as_str);
            text += &part[digits..];
        }
        text
    }
}

/// Reads `$1 = 'text', $2 = NULL`: literals as SQL has them.
fn parameters(list: &str) -> BTreeMap<usize, String> {
    let mut found = BTreeMap::new();
    let mut rest = list;
    while let Some((number, value)) = rest.strip_prefix('$').and_then(|rest| rest.split_once(" = ")) {
        let end = match value.strip_prefix('\'') {
            None => value.find(", $").unwrap_or(value.len()),
            Some(quoted) => {
                let mut at = 0;
                loop {
                    at += quoted[at..].find('\'').expect("a literal ends");
                    if quoted[at + 1..].starts_with('\'') {
                        at += 2;
                    } else {
                        break at + 2;
                    }
                }
            }
        };
        found.insert(number.parse().expect("a number"), value[..end].to_owned());
        rest = value[end..].trim_start_matches(", ");
    }
    found
}

/// The statement without any comparison of an operator with something.
fn unfiltered(sql: &str) -> String {
    const COMPARISON: &str = "operator = ";
    let mut text = String::new();
    let mut rest = sql;
    while let Some(at) = rest.find(COMPARISON) {
        let word = |c: char| c.is_ascii_alphanumeric() || "_.$".contains(c);
        let begin = rest[..at].rfind(|c| !word(c)).map_or(0, |before| before + 1);
        let value = &rest[at + COMPARISON.len()..];
        let end = value.find(|c| !word(c)).unwrap_or(value.len());
        text += &rest[..begin];
        text += "true";
        rest = &value[end..];
    }
    text + rest
}

/// What a statement answers, or why it was refused.
async fn answer(connection: &mut PgConnection, sql: &str) -> Result<Vec<String>, String> {
    let rows = sqlx::raw_sql(AssertSqlSafe(sql)).fetch_all(connection).await.map_err(|error| error.to_string())?;
    Ok(rows
        .iter()
        .map(|row| {
            let column = |i| {
                let value = row.try_get_raw(i).unwrap();
                if value.is_null() { "null".to_owned() } else { value.as_str().unwrap().to_owned() }
            };
            (0..row.len()).map(column).collect::<Vec<_>>().join("|")
        })
        .collect())
}

/// A superuser who can put on the service's role.
struct Judge {
    connection: PgConnection,
    tables: Vec<String>,
}

impl Judge {
    async fn of(database: &TestDatabase) -> Self {
        let mut connection = PgConnection::connect(&database.superuser_url()).await.unwrap();
        let tables = sqlx::query_scalar(
            "select c.relname::text from pg_class c join pg_attribute a on a.attrelid = c.oid and a.attname = 'operator'
             where c.relnamespace = 'public'::regnamespace and c.relkind in ('r', 'p') and not c.relispartition
             order by 1",
        )
        .fetch_all(&mut connection)
        .await
        .unwrap();
        Self { connection, tables }
    }

    /// What the service is answered for an operator, or for none, while some operators have no rows; and a digest
    /// of the rows of all others than that operator afterwards.
    async fn try_out(
        &mut self,
        sql: &str,
        as_operator: &str,
        without: &[&str],
    ) -> (Result<Vec<String>, String>, String) {
        let connection = &mut self.connection;
        connection.execute("begin").await.unwrap();
        for (table, operator) in self.tables.iter().flat_map(|table| without.iter().map(move |one| (table, one))) {
            let sql = format!("delete from {table} where operator = '{operator}'");
            connection.execute(AssertSqlSafe(sql)).await.unwrap();
        }
        connection.execute("savepoint statement; set local role actuary_test_service").await.unwrap();
        if !as_operator.is_empty() {
            let sql = format!("set local actuary.operator = '{as_operator}'");
            connection.execute(AssertSqlSafe(sql)).await.unwrap();
        }
        let answered = answer(connection, sql).await;
        if answered.is_err() {
            connection.execute("rollback to savepoint statement").await.unwrap();
        }
        connection.execute("set local role none").await.unwrap();
        let mut digest = String::new();
        for table in &self.tables {
            let sql = format!(
                "select coalesce(md5(string_agg(t::text, ';' order by t::text)), '') from {table} t
                 where operator <> '{as_operator}'"
            );
            digest += &answer(connection, &sql).await.unwrap()[0];
        }
        connection.execute("rollback").await.unwrap();
        (answered, digest)
    }
}

#[tokio::test]
async fn slow_no_statement_of_the_store_reaches_another_operator_even_without_its_filters() {
    let settings = ["logging_collector=on", "log_destination=jsonlog", "log_statement=all"];
    let Some(cluster) = Cluster::start_with(&settings) else { return };
    let database = cluster.database().await;
    Store::migrate(&database.owner_url(), Some(database.service_role())).await.unwrap();
    let store = Store::open(&database.service_url(), Options::default()).await.unwrap();
    store.register_bundle(&bundle("one"), &bundle_body("one"), by_hand(0.0)).await.unwrap();
    store.activate_bundle(&bundle("one").hash, by_hand(0.0)).await.unwrap();
    live(&store, &OWN.parse().unwrap()).await;
    live(&store, &FOREIGN.parse().unwrap()).await;
    store.close().await;

    let log = fs::read_dir(cluster.data().join("log")).unwrap().map(|entry| entry.unwrap().path());
    let log: String = log
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    // Of each text the last one sent: it was for the foreign operator. What names an operator to the wall is the
    // key to it, and no filter.
    let statements: BTreeMap<String, Statement> = log
        .lines()
        .filter_map(|line| Statement::of(&serde_json::from_str(line).unwrap()))
        .filter(|statement| !statement.sql.contains("set_config") && !statement.sql.contains("pg_xact_status"))
        .map(|statement| (statement.sql.clone(), statement))
        .collect();
    assert!(statements.len() > 60, "{} statements", statements.len());

    let mut judge = Judge::of(&database).await;
    let (_, untouched) = judge.try_out("select 1", OWN, &[]).await;
    let (mut answered, mut tried) = (0, 0);
    for statement in statements.values() {
        let cut = unfiltered(&statement.sql);
        for sql in [&statement.sql, &cut].map(|sql| statement.literal(sql)) {
            let (answer, digest) = judge.try_out(&sql, OWN, &[]).await;
            assert_eq!(digest, untouched, "{sql}\nchanges rows of another operator");
            let (alone, _) = judge.try_out(&sql, OWN, &[FOREIGN]).await;
            assert_eq!(answer, alone, "{sql}\ntells something of another operator");
            let (nobody, _) = judge.try_out(&sql, "", &[]).await;
            let (empty, _) = judge.try_out(&sql, "", &[OWN, FOREIGN]).await;
            assert_eq!(nobody, empty, "{sql}\ntells something to nobody");
            tried += 1;
            answered += usize::from(answer.is_ok());
        }
    }
    println!("{tried} statements tried, {answered} answered");
    assert!(answered * 4 > tried * 3, "{answered} of {tried} statements were answered");
}
