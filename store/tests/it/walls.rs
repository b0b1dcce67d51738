//! Two walls stand between operators: row-level security and the application's own filters, the only ones that SQLite has.
//! Each holds without the other.
//!
//! All SQL that the store sends for an operator is taken from the log of a server, and sent again: by another operator, as it
//! is and with every comparison of an operator cut out; and as it is where row-level security does not hold. What
//! is answered must not depend on whether the other operator has any rows, and must not change them. Both have done the same
//! with things of the same names.

use std::{
    collections::{BTreeMap, HashMap},
    fs,
    ops::Range,
};

use crate::fixture::{
    self, bundle, bundle_body, by_hand, checks, configuration, day, drain, fail, finding, later_upload, plan, prior,
    settings, tail,
};
use domain::{Actor, EventKind, Finding, MaintenanceEvent, OperatorId, Upload, UploadStateKind};
use serde_json::Value;
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection, Row, ValueRef};
use store::{Options, Scope, Store};
use tests::postgres::{Cluster, TestDatabase};

const OWN: &str = "alpha";
const FOREIGN: &str = "bravo";

/// Everything that a store does for an operator.
async fn live(store: &Store, operator: &OperatorId) {
    let upload = |i: usize| {
        let hours = [10.0 * i as f64, 6000.0][usize::from(i == 11)];
        Upload { tail: tail("EC-MXA"), ..later_upload(&format!("upload-{i}"), "unit", hours) }
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
    store.set_plan(operator, &tail("EC-MXA"), &plan(4.0), by_hand(0.0)).await.unwrap();
    store.set_checks(operator, &[(tail("EC-MXA"), checks(90.0))], by_hand(0.0)).await.unwrap();
    store.set_settings(operator, &settings(0.25), by_hand(0.0)).await.unwrap();
    drain(store).await;
    store.void_upload(operator, &known(3), by_hand(1.0)).await.unwrap();
    store.retry_upload(operator, &known(11), by_hand(1.0)).await.unwrap();
    drain(store).await;
    let component = upload(0).component(operator);
    fail(store, operator, component.serial_number.as_str(), 1000.0).await;
    let mistaken = MaintenanceEvent {
        kind: EventKind::Finding(Finding::Serviceable),
        ..finding("mistake", component.serial_number.as_str(), Finding::Failed, 500.0)
    };
    store.record_event(operator, &mistaken, day(0.0)).await.unwrap();
    let second = finding("second", component.serial_number.as_str(), Finding::Failed, 1100.0);
    store.record_event(operator, &second, day(0.0)).await.unwrap();
    store.void_event(operator, &mistaken.event_id, by_hand(0.0)).await.unwrap();
    store.add_prior(operator, &prior(operator.as_str(), 10, 0.0), operator.as_str().as_bytes()).await.unwrap();
    let (_, token) = fixture::token(operator, operator.as_str().as_bytes()[0]);
    store.create_token(&token, Actor::Cli).await.unwrap();
    let key = fixture::frame_key(operator, 2);
    store.create_frame_key(&key, Actor::Cli).await.unwrap();
    store.frame_key(operator, key.id).await.unwrap().unwrap();
    assert_eq!(store.frame_keys(operator).await.unwrap().len(), 1);

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
    assert_eq!(store.events(&component).await.unwrap().len(), 3);
    assert!(store.event(operator, &mistaken.event_id).await.unwrap().is_some());
    assert_eq!(store.issued_on_finished_lives(operator, 200.0, 10).await.unwrap().len(), 1);
    let finished = store.finished_lives(operator, &component.part_number, &bundle("one").hash).await.unwrap();
    assert_eq!(finished.len(), 1);
    assert_eq!(store.priors(operator).await.unwrap().len(), 1);
    store.prior_body(operator, &prior(operator.as_str(), 10, 0.0).hash).await.unwrap().unwrap();
    store.sensor_configurations(operator, &tail("EC-MXA")).await.unwrap();
    assert_eq!(store.plans(operator, &tail("EC-MXA")).await.unwrap().len(), 1);
    store.plan(operator, &tail("EC-MXA")).await.unwrap().unwrap();
    store.checks(operator, &tail("EC-MXA")).await.unwrap().unwrap();
    assert_eq!(store.fleet_checks(operator, None, 10).await.unwrap().len(), 1);
    store.settings(operator).await.unwrap().unwrap();
    store.version(operator, Scope::Fleet).await.unwrap();
    store.version(operator, Scope::Tail(&tail("EC-MXA"))).await.unwrap();
    assert_eq!(store.tokens(operator).await.unwrap().len(), 1);
    store.audit(Some(operator), 0, 10).await.unwrap();
    store.checkpoint(&component, 0, 1, &[(1, bundle("one").hash)]).await.unwrap();
    store.lessons().await.unwrap();
    store.digest().await.unwrap();
    store.verify().await.unwrap();
    store.work_figures().await.unwrap();
}

/// Makes the things of an operator others than those of the same names: in a further life, moved, voided, planned, named
/// otherwise or under way.
async fn live_on(store: &Store, operator: &OperatorId) {
    let upload = |name: &str, hours| Upload { tail: tail("EC-MXA"), ..later_upload(name, "unit", hours) };
    let event = |name: &str, kind, hours| MaintenanceEvent { kind, ..finding(name, "unit", Finding::Failed, hours) };
    for event in [
        event("overhaul", EventKind::Overhaul, 165.0),
        event("installed", EventKind::Install, 100.0),
        event("removed", EventKind::Remove, 130.0),
        event("again", EventKind::Install, 131.0),
    ] {
        store.record_event(operator, &event, day(0.0)).await.unwrap();
    }
    store.void_event(operator, &"second".parse().unwrap(), by_hand(2.0)).await.unwrap();
    store.void_upload(operator, &upload("upload-5", 50.0).upload_id, by_hand(2.0)).await.unwrap();
    store
        .add_sensor_configuration(operator, &tail("EC-MXA"), day(3.0), &configuration(0.5), by_hand(0.0))
        .await
        .unwrap();
    store.set_plan(operator, &tail("EC-MXA"), &plan(5.0), by_hand(0.0)).await.unwrap();
    store.set_checks(operator, &[(tail("EC-MXA"), checks(91.0))], by_hand(2.0)).await.unwrap();
    store.set_settings(operator, &settings(0.26), by_hand(2.0)).await.unwrap();
    store.revoke_frame_key(operator, fixture::frame_key(operator, 2).id, by_hand(2.0)).await.unwrap().unwrap();
    store.add_prior(operator, &prior("later", 10, 5.0), b"later").await.unwrap();
    store.accept(operator, upload("more", 130.0), day(0.0)).await.unwrap();
    let alike =
        Upload { serial_number: "UNIT".parse().unwrap(), position: "ail-l".parse().unwrap(), ..upload("alike", 0.0) };
    store.accept(operator, alike, day(0.0)).await.unwrap();
    drain(store).await;
    store.accept(operator, upload("waiting", 140.0), day(0.0)).await.unwrap();
    fixture::lease(store).await;
}

/// A statement with the parameters that it was sent with.
#[derive(Debug, Clone)]
struct Statement {
    sql: String,
    parameters: BTreeMap<usize, String>,
}

/// What the service sent, by text and by whether it was sent for the foreign operator alone; of each the last one. What names an operator to the wall is the key to it, and no filter; what asks for the time
/// or for the outcome of a commit is never answered the same.
fn sent(log: &str) -> BTreeMap<(String, bool), Statement> {
    let mut sent = BTreeMap::new();
    // What the transaction of a connection was let in by: one that has looked over all operators looks into each of them.
    let mut keys: HashMap<u64, String> = HashMap::new();
    for record in log.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()) {
        let pid = record["pid"].as_u64().unwrap();
        if record["message"].as_str().is_some_and(|message| message.to_lowercase().starts_with("statement: begin")) {
            keys.remove(&pid);
        }
        let Some(statement) = Statement::of(&record) else { continue };
        if statement.sql.contains("set_config") {
            *keys.entry(pid).or_default() += &statement.literal(&statement.sql);
        } else if !["pg_xact_status", "clock_timestamp"].iter().any(|it| statement.sql.contains(it)) {
            let for_one = keys
                .get(&pid)
                .is_some_and(|key| key.contains(&format!("'{FOREIGN}'")) && !key.contains("actuary_system"));
            sent.insert((statement.sql.clone(), for_one), statement);
        }
    }
    sent
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

/// Where a statement compares an operator with something.
fn comparisons(sql: &str) -> Vec<Range<usize>> {
    const COMPARISON: &str = "operator = ";
    let word = |c: char| c.is_ascii_alphanumeric() || "_.$".contains(c);
    let range = |(at, _): (usize, &str)| {
        let begin = sql[..at].rfind(|c| !word(c)).map_or(0, |before| before + 1);
        let value = at + COMPARISON.len();
        begin..sql[value..].find(|c| !word(c)).map_or(sql.len(), |end| value + end)
    };
    sql.match_indices(COMPARISON).map(range).collect()
}

/// The statement without some of its comparisons.
fn without(sql: &str, comparisons: &[Range<usize>]) -> String {
    let mut text = sql.to_owned();
    for comparison in comparisons.iter().rev() {
        text.replace_range(comparison.clone(), "true");
    }
    text
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

    /// What is answered to an operator, or to none, while some operators have no rows; and a digest of the rows of all
    /// others than that operator afterwards. Behind the wall it is the service that asks.
    async fn try_out(
        &mut self,
        sql: &str,
        wall: bool,
        as_operator: &str,
        without: &[&str],
    ) -> (Result<Vec<String>, String>, String) {
        let connection = &mut self.connection;
        connection.execute("begin").await.unwrap();
        for (table, operator) in self.tables.iter().flat_map(|table| without.iter().map(move |one| (table, one))) {
            let sql = format!("delete from {table} where operator = '{operator}'");
            connection.execute(AssertSqlSafe(sql)).await.unwrap();
        }
        connection.execute("savepoint statement").await.unwrap();
        if wall {
            connection.execute("set local role actuary_test_service").await.unwrap();
        }
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

    /// How a statement reaches what is not an operator's, if it does.
    async fn reach(&mut self, sql: &str, wall: bool, operator: &str, other: &str) -> Option<&'static str> {
        let (_, untouched) = self.try_out("select 1", wall, operator, &[]).await;
        let (answer, digest) = self.try_out(sql, wall, operator, &[]).await;
        if digest != untouched {
            return Some("changes rows of another operator");
        }
        let (alone, _) = self.try_out(sql, wall, operator, &[other]).await;
        (answer != alone).then_some("tells something of another operator")
    }
}

#[tokio::test]
async fn slow_each_wall_between_operators_holds_without_the_other() {
    let settings = ["logging_collector=on", "log_destination=jsonlog", "log_statement=all"];
    let Some(cluster) = Cluster::start_with(&settings) else { return };
    let database = cluster.database().await;
    Store::migrate(&database.owner_url(), Some(database.service_role())).await.unwrap();
    let store = Store::open(&database.service_url(), Options::default()).await.unwrap();
    store.register_bundle(&bundle("one"), &bundle_body("one"), by_hand(0.0)).await.unwrap();
    store.activate_bundle(&bundle("one").hash, by_hand(0.0)).await.unwrap();
    live(&store, &OWN.parse().unwrap()).await;
    live(&store, &FOREIGN.parse().unwrap()).await;
    live_on(&store, &OWN.parse().unwrap()).await;
    store.close().await;

    let log = fs::read_dir(cluster.data().join("log")).unwrap().map(|entry| entry.unwrap().path());
    let log: String = log
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    let statements = sent(&log);
    assert!(statements.len() > 60, "{} statements", statements.len());
    let mut judge = Judge::of(&database).await;
    security_holds(&mut judge, statements.values()).await;
    filters_hold(&mut judge, statements.iter().filter(|((_, for_one), _)| *for_one).map(|(_, one)| one)).await;
}

/// Row-level security keeps an operator from what is another's, whatever a statement compares.
async fn security_holds(judge: &mut Judge, statements: impl Iterator<Item = &Statement>) {
    let (mut answered, mut tried) = (0, 0);
    for statement in statements {
        let cut = without(&statement.sql, &comparisons(&statement.sql));
        for sql in [&statement.sql, &cut].map(|sql| statement.literal(sql)) {
            assert_eq!(judge.reach(&sql, true, OWN, FOREIGN).await, None, "{sql}");
            let (nobody, _) = judge.try_out(&sql, true, "", &[]).await;
            let (empty, _) = judge.try_out(&sql, true, "", &[OWN, FOREIGN]).await;
            assert_eq!(nobody, empty, "{sql}\ntells something to nobody");
            tried += 1;
            answered += usize::from(nobody.is_ok());
        }
    }
    println!("{tried} statements tried, {answered} answered");
    assert!(answered * 4 > tried * 3, "{answered} of {tried} statements were answered");
}

/// Where nothing but the comparisons of a statement holds, it reaches nothing of another operator; and that would be seen:
/// it does without most of them.
async fn filters_hold(judge: &mut Judge, statements: impl Iterator<Item = &Statement>) {
    let (mut seen, mut cut) = (0, 0);
    for statement in statements {
        let sql = statement.literal(&statement.sql);
        assert_eq!(judge.reach(&sql, false, FOREIGN, OWN).await, None, "{sql}");
        for comparison in comparisons(&statement.sql) {
            let sql = statement.literal(&without(&statement.sql, &[comparison]));
            let reached = judge.reach(&sql, false, FOREIGN, OWN).await;
            seen += usize::from(reached.is_some());
            cut += 1;
        }
    }
    println!("{seen} of {cut} comparisons are missed when they are cut out");
    assert!(seen * 2 > cut, "{seen} of {cut}");
}
