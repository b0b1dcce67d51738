//! What only Postgres can get wrong: roles, walls, partitions, several processes, connections that end.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::Duration,
};

use crate::fixture::{
    self, Backend, Database, HandClock, LEASE, bundle, bundle_body, by_hand, component, day, drain, later_upload,
    life_inputs, operator, results, states, upload,
};
use domain::{OperatorId, Timestamp, Upload};
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection, Row, migrate::Migrator};
use store::{Clock, Completion, Options, Receipt, Store, StoreError};
use tests::postgres::{Cluster, TestDatabase};
use tokio::{task::JoinSet, time::timeout};

/// Longer than anything here takes: only a hang runs into it.
const HANG: Duration = Duration::from_secs(120);

async fn connect(url: &str) -> PgConnection {
    PgConnection::connect(url).await.unwrap()
}

async fn execute(url: &str, sql: &str) {
    let mut connection = connect(url).await;
    connection.execute(AssertSqlSafe(sql)).await.unwrap_or_else(|error| panic!("{sql}: {error}"));
    connection.close().await.unwrap();
}

async fn number(url: &str, sql: &str) -> i64 {
    let mut connection = connect(url).await;
    let row = connection.fetch_one(AssertSqlSafe(sql)).await.unwrap_or_else(|error| panic!("{sql}: {error}"));
    connection.close().await.unwrap();
    row.get(0)
}

async fn refusal(url: &str) -> StoreError {
    Store::open(url, Options::default()).await.err().expect("the database is refused")
}

#[tokio::test]
async fn a_database_without_a_schema_is_refused_with_the_way_out() {
    let Some(empty) = TestDatabase::create_empty().await else { return };
    let refused = refusal(&empty.service_url()).await;
    assert!(matches!(refused, StoreError::NotMigrated), "{refused:?}");
    assert!(refused.to_string().contains("actuary migrate"), "{refused}");
    Store::migrate(&empty.owner_url(), Some(empty.service_role())).await.unwrap();
    Store::migrate(&empty.owner_url(), Some(empty.service_role())).await.unwrap();
    Store::open(&empty.service_url(), Options::default()).await.unwrap().ping().await.unwrap();
}

#[tokio::test]
async fn a_schema_that_excludes_this_build_is_refused_and_one_that_does_not_is_served() {
    let database = Database::new(Backend::Postgres);
    let cluster = database.postgres().await;
    execute(&cluster.owner_url(), "update schema_info set version = 99").await;
    database.open().await.close().await;
    execute(&cluster.owner_url(), "update schema_info set min_binary = 98").await;
    let refused = refusal(&cluster.service_url()).await;
    assert!(matches!(refused, StoreError::NewerSchema { version: 99, min_binary: 98, .. }), "{refused:?}");
    execute(&cluster.owner_url(), "update schema_info set min_binary = 1, version = 1").await;
    let refused = refusal(&cluster.service_url()).await;
    assert!(matches!(refused, StoreError::OlderSchema { version: 1, .. }), "{refused:?}");
}

/// The migrations from before rows had checksums.
const BEFORE_CHECKSUMS: [&str; 5] = [
    "0001_initial.sql",
    "0002_credentials.sql",
    "0003_component_lives.sql",
    "0004_generations.sql",
    "0005_lesson_claims.sql",
];

#[tokio::test]
async fn rows_from_before_checksums_get_them_and_a_build_that_knows_none_is_refused() {
    let Some(old) = TestDatabase::create_empty().await else { return };
    let folder = tempfile::tempdir().unwrap();
    for migration in BEFORE_CHECKSUMS {
        std::fs::copy(format!("../migrations/postgres/{migration}"), folder.path().join(migration)).unwrap();
    }
    let mut owner = connect(&old.owner_url()).await;
    Migrator::new(folder.path()).await.unwrap().run_direct(None, &mut owner, false).await.unwrap();
    for row in [
        "insert into operators (operator, enrolled_at) values ('default', 1), ('elsewhere', 2)",
        "insert into tails (operator, tail) values ('default', 'EC-MXA'), ('elsewhere', 'EC-MXB')",
    ] {
        execute(&old.superuser_url(), row).await;
    }
    Store::migrate(&old.owner_url(), Some(old.service_role())).await.unwrap();
    let store = Store::open(&old.service_url(), Options::default()).await.unwrap();
    for (name, tail) in [("default", "EC-MXA"), ("elsewhere", "EC-MXB")] {
        let tails = store.tails(&name.parse().unwrap(), None, 10).await.unwrap();
        assert_eq!(tails, [tail.parse().unwrap()]);
    }
    assert_eq!(store.verify().await.unwrap().damaged, []);
    store.register_bundle(&bundle("one"), &bundle_body("one"), by_hand(0.0)).await.unwrap();
    store.activate_bundle(&bundle("one").hash, by_hand(0.0)).await.unwrap();
    store.accept(&operator(), upload("u", "0001"), day(0.0)).await.unwrap();
    let mut superuser = connect(&old.superuser_url()).await;
    for write in
        ["insert into tails (operator, tail) values ('default', 'EC-OLD')", "update lives set ended_by = 'end'"]
    {
        let refused = superuser.execute(write).await;
        assert!(refused.is_err(), "{write}: {refused:?}");
    }
}

#[tokio::test]
async fn roles_that_row_level_security_does_not_bind_are_refused() {
    let database = Database::new(Backend::Postgres);
    let cluster = database.postgres().await;
    for role in [
        "create role test_stranger login",
        "create role test_inheriting login; grant actuary_service, actuary_system to test_inheriting",
        "create role test_bypassing login bypassrls; grant actuary_service to test_bypassing",
        "create role test_climbing login; grant actuary_service, test_bypassing to test_climbing",
    ] {
        let sql = format!("do $$ begin {role}; exception when duplicate_object then null; end $$");
        execute(&cluster.superuser_url(), &sql).await;
    }
    let as_role = |role: &str| {
        cluster.service_url().replacen(&format!("{0}:{0}@", cluster.service_role()), &format!("{role}@"), 1)
    };
    for (url, why) in [
        (cluster.superuser_url(), "above row-level security"),
        (cluster.owner_url(), "owns the tables"),
        (as_role("test_stranger"), "--service-role"),
        (as_role("test_inheriting"), "inherits actuary_system"),
        (as_role("test_bypassing"), "above row-level security"),
        (as_role("test_climbing"), "above row-level security"),
    ] {
        let refused = refusal(&url).await;
        assert!(matches!(&refused, StoreError::UnsuitableRole { .. }), "{url}: {refused:?}");
        assert!(refused.to_string().contains(why), "{url}: {refused}");
    }
    let refused = Store::migrate(&cluster.owner_url(), Some("test_bypassing")).await.unwrap_err();
    assert!(matches!(refused, StoreError::UnsuitableRole { .. }), "{refused:?}");
}

#[tokio::test]
async fn a_database_that_loses_what_it_acknowledged_is_refused() {
    let database = Database::new(Backend::Postgres);
    let cluster = database.postgres().await;
    let sql = "do $$ begin execute format(
                 'alter role actuary_test_service in database %I set synchronous_commit = off', current_database());
               end $$";
    execute(&cluster.superuser_url(), sql).await;
    let refused = refusal(&cluster.service_url()).await;
    assert!(matches!(&refused, StoreError::NotDurable { setting: "synchronous_commit", found, .. } if found == "off"));
}

#[tokio::test]
async fn secrets_of_a_url_are_not_told() {
    let refused = refusal("mysql://me:secret@host/db").await.to_string();
    assert!(refused.contains("mysql://...@host/db") && !refused.contains("secret"), "{refused}");
}

#[tokio::test]
async fn every_table_of_operators_is_walled_in() {
    let database = Database::new(Backend::Postgres);
    let open: Vec<String> = sqlx::query_scalar(
        "select cast(c.oid::regclass as text) from pg_class c
         where c.relnamespace = 'public'::regnamespace and c.relkind in ('r', 'p')
           and exists (select from pg_attribute a
                       where a.attrelid = c.oid and a.attname = 'operator' and not a.attisdropped)
           and not (c.relrowsecurity and c.relforcerowsecurity)",
    )
    .fetch_all(&mut connect(&database.postgres().await.superuser_url()).await)
    .await
    .unwrap();
    assert_eq!(open, Vec::<String>::new(), "tables with operators and without a forced wall");
    let views: Vec<String> = sqlx::query_scalar(
        "select relname::text from pg_class c where relnamespace = 'public'::regnamespace and relkind in ('v', 'm')
           and not coalesce(reloptions, '{}') @> array['security_invoker=true']",
    )
    .fetch_all(&mut connect(&database.postgres().await.superuser_url()).await)
    .await
    .unwrap();
    assert_eq!(views, Vec::<String>::new(), "views that see more than who asks");
}

#[tokio::test]
async fn nothing_is_visible_before_an_operator_is_named_or_behind_anothers_wall() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    for i in 0..5 {
        let upload = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    drain(&store).await;
    let cluster = database.postgres().await;
    let tables: Vec<String> = sqlx::query_scalar(
        "select c.relname::text from pg_class c join pg_attribute a on a.attrelid = c.oid and a.attname = 'operator'
         where c.relnamespace = 'public'::regnamespace and c.relkind in ('r', 'p', 'v')
           and has_table_privilege('actuary_service', c.oid, 'select')",
    )
    .fetch_all(&mut connect(&cluster.superuser_url()).await)
    .await
    .unwrap();
    assert!(tables.len() > 15, "{tables:?}");
    let mut connection = connect(&cluster.service_url()).await;
    let mut seen = BTreeMap::new();
    let own = operator();
    for named in ["", "other", own.as_str()] {
        if !named.is_empty() {
            connection.execute(AssertSqlSafe(format!("set actuary.operator = '{named}'"))).await.unwrap();
        }
        for table in &tables {
            let sql = AssertSqlSafe(format!("select count(*) from {table}"));
            let rows: i64 = connection.fetch_one(sql).await.unwrap().get(0);
            *seen.entry(named).or_insert(0) += rows.min(1);
        }
    }
    assert_eq!((seen[""], seen["other"]), (0, 0), "tables of which rows are seen");
    assert!(seen[own.as_str()] > 8, "{seen:?}");
}

/// Noon of a day some months after the present, by the machine's clock.
fn months_ahead(months: i64) -> Timestamp {
    Clock::system().now().plus_hours(24.0 * 30.5 * months as f64)
}

#[tokio::test]
async fn uploads_lie_in_the_partition_of_their_month_or_raise_an_alarm() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    let cluster = database.postgres().await;
    let in_default = "select count(*) from uploads_default";
    store.accept(&operator(), upload("now", "0001"), months_ahead(0)).await.unwrap();
    store.accept(&operator(), upload("soon", "0001"), months_ahead(2)).await.unwrap();
    assert_eq!(number(&cluster.superuser_url(), in_default).await, 0);
    assert_eq!(store.work_figures().await.unwrap().without_partition, 0);
    store.accept(&operator(), upload("later", "0001"), months_ahead(5)).await.unwrap();
    assert_eq!(store.work_figures().await.unwrap().without_partition, 1);
    // When its month comes near, it is moved.
    execute(&cluster.service_url(), "select make_upload_partitions(6)").await;
    assert_eq!(number(&cluster.superuser_url(), in_default).await, 0);
    assert_eq!(store.work_figures().await.unwrap().without_partition, 0);
    for id in ["now", "soon", "later"] {
        let record = store.upload(&operator(), &id.parse().unwrap()).await.unwrap();
        assert_eq!(record.map(|record| record.upload), Some(upload(id, "0001")));
    }
    assert_eq!(store.verify().await.unwrap().damaged, []);
}

#[tokio::test]
async fn a_database_open_for_reading_is_not_written() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let reader = Store::open_read_only(&database.postgres().await.service_url()).await.unwrap();
    assert_eq!(reader.pending().await.unwrap(), 1);
    let refused = reader.accept(&operator(), upload("u2", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::ReadOnly)), "{refused:?}");
}

/// Until the database is ready again, as a probe waits for it.
async fn becomes_ready(store: &Store) {
    let ready = async {
        while store.ping().await.is_err() {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(HANG, ready).await.expect("it is ready at last");
}

#[tokio::test]
async fn a_disk_without_room_refuses_what_is_sent_until_there_is_room_and_reading_goes_on() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    store.accept(&operator(), upload("before", "0001"), day(0.0)).await.unwrap();
    let owner = database.postgres().await.owner_url();
    let full = "create function full_disk() returns trigger language plpgsql as
                $$ begin raise exception 'could not extend file' using errcode = '53100'; end $$";
    execute(&owner, full).await;
    for table in ["uploads", "lesson_claims"] {
        let sql =
            format!("create trigger full_disk before insert on {table} for each row execute function full_disk()");
        execute(&owner, &sql).await;
    }
    let mut callers = JoinSet::new();
    for i in 0..20 {
        let store = store.clone();
        callers.spawn(async move { store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await });
    }
    for answer in callers.join_all().await {
        assert!(matches!(answer, Err(StoreError::StorageFull(_))), "{answer:?}");
    }
    assert!(matches!(store.ping().await, Err(StoreError::StorageFull(_))));
    assert_eq!(store.pending().await.unwrap(), 1);
    execute(&owner, "drop function full_disk cascade").await;
    becomes_ready(&store).await;
    assert_eq!(store.accept(&operator(), upload("u0", "0001"), day(0.0)).await.unwrap(), Receipt::Accepted);
}

#[tokio::test]
async fn a_server_that_became_a_standby_is_left_for_the_primary() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    let superuser = database.postgres().await.superuser_url();
    let read_only = |on: &str| {
        format!(
            "do $$ begin execute format('alter role actuary_test_service in database %I
               set default_transaction_read_only = {on}', current_database()); end $$"
        )
    };
    execute(&superuser, &read_only("on")).await;
    let ended = "select count(pg_terminate_backend(pid)) from pg_stat_activity
                 where datname = current_database() and pid <> pg_backend_pid()";
    number(&superuser, ended).await;
    let refused = store.accept(&operator(), upload("u1", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::ReadOnly)), "{refused:?}");
    assert!(matches!(store.ping().await, Err(StoreError::ReadOnly)));
    assert_eq!(store.pending().await.unwrap(), 0);
    execute(&superuser, &read_only("off")).await;
    becomes_ready(&store).await;
    assert_eq!(store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap(), Receipt::Accepted);
}

#[tokio::test]
async fn slow_an_operator_whose_row_another_holds_is_told_and_written_again_when_it_is_free() {
    let database = Database::new(Backend::Postgres);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let mut holder = connect(&database.postgres().await.superuser_url()).await;
    holder.execute("begin; select 1 from operators for update").await.unwrap();
    let refused = store.accept(&operator(), upload("u2", "0001"), day(0.0)).await;
    assert!(matches!(refused, Err(StoreError::Busy(_))), "{refused:?}");
    assert_eq!(store.pending().await.unwrap(), 1);
    holder.execute("rollback").await.unwrap();
    assert_eq!(store.accept(&operator(), upload("u2", "0001"), day(0.0)).await.unwrap(), Receipt::Accepted);
    becomes_ready(&store).await;
}

/// Keeps ending the connections of the service, until dropped.
struct Chaos(tokio::task::JoinHandle<()>, Arc<AtomicUsize>);

impl Chaos {
    fn on(url: String, every: Duration) -> Self {
        let ended = Arc::new(AtomicUsize::new(0));
        let count = ended.clone();
        let task = tokio::spawn(async move {
            let mut connection = connect(&url).await;
            loop {
                let sql = "select count(pg_terminate_backend(pid)) from pg_stat_activity
                           where datname = current_database() and pid <> pg_backend_pid()";
                let row = connection.fetch_one(sql).await.unwrap();
                count.fetch_add(row.get::<i64, _>(0) as usize, Ordering::SeqCst);
                tokio::time::sleep(every).await;
            }
        });
        Self(task, ended)
    }
}

impl Drop for Chaos {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Asks again while the database does not answer, as an aircraft does.
async fn insist(store: &Store, operator: &OperatorId, upload: &Upload) -> (Receipt, usize) {
    for refusals in 0.. {
        match store.accept(operator, upload.clone(), day(0.0)).await {
            Ok(receipt) => return (receipt, refusals),
            Err(StoreError::Unavailable(_)) => {}
            Err(error) => panic!("{}: {error}", upload.upload_id),
        }
    }
    unreachable!("counts for ever")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn connections_that_end_lose_no_upload_and_count_none_twice() {
    const UPLOADS: usize = 150;
    let database = Database::new(Backend::Postgres);
    let stores = [database.ready().await, database.open().await];
    let url = database.postgres().await.superuser_url();
    let chaos = Chaos::on(url.clone(), Duration::from_millis(100));
    let mut callers = JoinSet::new();
    for caller in 0..12 {
        let store = stores[caller % 2].clone();
        callers.spawn(async move {
            let mut answers = Vec::new();
            for i in (caller..UPLOADS).step_by(12) {
                let operator: OperatorId = format!("op{}", i % 3).parse().unwrap();
                let upload = later_upload(&format!("u{i}"), &format!("{:04}", i % 20), i as f64);
                answers.push(insist(&store, &operator, &upload).await);
            }
            answers
        });
    }
    let answers = timeout(HANG, callers.join_all()).await.unwrap().concat();
    assert!(chaos.1.load(Ordering::SeqCst) > 10, "hardly a connection was ended");
    drop(chaos);
    assert_eq!(answers.len(), UPLOADS);
    // Whoever was never refused was told what it did itself, also where the answer to a commit was lost.
    let doubted: Vec<_> = answers.iter().filter(|(receipt, _)| *receipt != Receipt::Accepted).collect();
    assert!(doubted.iter().all(|(receipt, refusals)| *receipt == Receipt::Duplicate && *refusals > 0), "{doubted:?}");
    assert_eq!(stores[0].pending().await.unwrap(), UPLOADS as u64);
    let kept = "select count(*) from uploads u join upload_keys k using (operator, upload_id) join inbox w
                using (operator, upload_id)";
    assert_eq!(number(&url, kept).await, UPLOADS as i64);
}

/// Works until told, now and then for longer than a lease lasts, and now and then for nothing.
async fn work(store: Store, clock: HandClock, number: usize, finished: Arc<AtomicBool>, fates: Arc<Mutex<[usize; 3]>>) {
    let mut turn = number;
    while !finished.load(Ordering::SeqCst) {
        let lease = match store.lease(LEASE).await {
            Ok(Some(lease)) => lease,
            Ok(None) => {
                let _ = timeout(Duration::from_millis(20), store.work_available()).await;
                // Whoever was given up has to be waited for.
                clock.advance(LEASE / 8);
                continue;
            }
            Err(StoreError::Unavailable(_)) => continue,
            Err(error) => panic!("lease: {error}"),
        };
        turn += 1;
        if turn.is_multiple_of(11) {
            continue; // As if killed.
        }
        let Ok(inputs) = store.life_inputs(&lease).await else { continue };
        let results = inputs.iter().map(results).collect::<Vec<_>>();
        if turn.is_multiple_of(7) {
            clock.advance(LEASE);
            tokio::task::yield_now().await;
        }
        let fate = match store.complete(&lease, results).await {
            Ok(Completion::Done) => 0,
            Ok(Completion::Fenced) => 1,
            Err(StoreError::Unavailable(_)) => 2,
            Err(error) => panic!("complete: {error}"),
        };
        fates.lock().unwrap()[fate] += 1;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn slow_eight_workers_of_two_processes_write_every_result_once_and_in_order() {
    const UPLOADS: usize = 150;
    const UNITS: usize = 12;
    let clock = HandClock::new();
    let database = Database::with(Backend::Postgres, Options { clock: Some(clock.clock()), ..Options::default() });
    let stores = [database.ready().await, database.open().await];
    let url = database.postgres().await.superuser_url();
    let (finished, fates) = (Arc::new(AtomicBool::new(false)), Arc::default());
    let mut workers = JoinSet::new();
    for i in 0..8 {
        let (finished, fates) = (finished.clone(), Arc::clone(&fates));
        workers.spawn(work(stores[i % 2].clone(), clock.clone(), i, finished, fates));
    }
    let chaos = Chaos::on(url.clone(), Duration::from_millis(500));
    for i in 0..UPLOADS {
        // Backwards now and then, so that states are replaced.
        let hours = if i % 10 == 9 { i - 9 } else { i } as f64;
        let upload = later_upload(&format!("u{i}"), &format!("{:04}", i % UNITS), hours);
        insist(&stores[i % 2], &operator(), &upload).await;
    }
    drop(chaos);
    timeout(HANG, async {
        while stores[0].pending().await.unwrap() > 0 {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    })
    .await
    .unwrap();
    finished.store(true, Ordering::SeqCst);
    workers.join_all().await;
    let [done, fenced, _] = *fates.lock().unwrap();
    assert!(done > 0 && fenced > 0, "{done} done, {fenced} fenced");
    let mut estimated = 0;
    for unit in 0..UNITS {
        let component = component(&format!("{unit:04}"));
        let estimates = stores[0].estimates(&component, None, None, None, None, 1000).await.unwrap();
        estimated += estimates.len();
        let kept = stores[0].states(&component, None, None, None, None, 1000).await.unwrap();
        assert_eq!(kept, states(&estimates), "states of {unit}");
    }
    assert_eq!(estimated, UPLOADS, "estimates");
    // A later prognosis of a life never rests on less than an earlier one.
    let inversions = "select count(*) from (
        select cast(cast(body as json) #>> '{forecast,Ok,propagation,observations}' as bigint)
                 < lag(cast(cast(body as json) #>> '{forecast,Ok,propagation,observations}' as bigint))
                   over (partition by operator, part_number, serial_number, overhaul_index, generation order by fence)
               as inverted from prognoses) as p where inverted";
    assert_eq!(number(&url, inversions).await, 0);
    assert_eq!(number(&url, "select count(*) from prognoses").await, done as i64, "one prognosis for each result");
}

#[tokio::test]
async fn a_server_that_crashed_and_came_back_is_served_again_with_all_that_was_acknowledged() {
    let Some(cluster) = Cluster::start() else { return };
    let database = cluster.database().await;
    Store::migrate(&database.owner_url(), Some(database.service_role())).await.unwrap();
    let store = Store::open(&database.service_url(), Options::default()).await.unwrap();
    store.register_bundle(&bundle("one"), &bundle_body("one"), by_hand(0.0)).await.unwrap();
    store.activate_bundle(&bundle("one").hash, by_hand(0.0)).await.unwrap();
    for i in 0..20 {
        store.accept(&fixture::operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
    }
    let lease = fixture::lease(&store).await;
    let inputs = life_inputs(&store, &lease).await;
    cluster.crash();
    let operator = operator();
    let (read, written) = tokio::join!(store.pending(), store.accept(&operator, upload("u20", "0001"), day(0.0)));
    assert!(matches!(read, Err(StoreError::Unavailable(_))), "{read:?}");
    assert!(matches!(written, Err(StoreError::Unavailable(_))), "{written:?}");
    // What is asked while it comes back waits for it.
    let coming_back = {
        let store = store.clone();
        tokio::spawn(async move { insist(&store, &fixture::operator(), &upload("u20", "0001")).await.0 })
    };
    cluster.resume();
    assert_eq!(coming_back.await.unwrap(), Receipt::Accepted);
    assert_eq!(store.pending().await.unwrap(), 21);
    assert_eq!(store.complete(&lease, vec![results(&inputs)]).await.unwrap(), Completion::Done);
    assert_eq!(store.pending().await.unwrap(), 1);
    store.close().await;
}
