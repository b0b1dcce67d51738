//! Opening: only a database that is durable and migrated, and only as a role that row-level security binds.

use std::{sync::Arc, time::Duration};

use sqlx::{
    Connection as _, PgConnection,
    postgres::{PgConnectOptions, PgPoolOptions},
};
use tokio::sync::Notify;

use super::{Engine, lanes::Lanes, partitions, sql::Turns, writer::Writer};
use crate::{Options, StoreError, outages::Outages, schema::SCHEMA};

/// Time that a caller waits for a connection before it is told to come back.
const PATIENCE: Duration = Duration::from_secs(2);
/// The oldest server whose views obey the row-level security of whoever asks.
const OLDEST_SERVER: i64 = 15;
/// Settings of every connection. A process that stops in the middle of a transaction must not hold its
/// locks for ever.
const SETTINGS: [(&str, &str); 3] =
    [("lock_timeout", "5s"), ("idle_in_transaction_session_timeout", "10s"), ("search_path", "public")];

impl Engine {
    pub(crate) async fn open(url: &str, options: Options) -> Result<Self, StoreError> {
        let mut engine = Self::connect(connect_options(url)?.options(SETTINGS), options).await?;
        engine.partitions = Some(partitions::keep(engine.pool.clone()));
        Ok(engine)
    }

    pub(crate) async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        let read_only = connect_options(url)?.options(SETTINGS).options([("default_transaction_read_only", "on")]);
        Self::connect(read_only, Options::default()).await
    }

    async fn connect(database: PgConnectOptions, options: Options) -> Result<Self, StoreError> {
        let pool = |connections| {
            let pool = PgPoolOptions::new().max_connections(connections).acquire_timeout(PATIENCE);
            pool.connect_lazy_with(database.clone())
        };
        let (main, uploading) = (pool(options.read_connections + options.write_connections), options.write_connections);
        check(&mut *main.acquire().await?).await?;
        let committed = Arc::<Notify>::default();
        let outages = Arc::<Outages>::default();
        let writer = |pool| Writer { pool, clock: options.clock.clone(), outages: outages.clone() };
        Ok(Self {
            writer: writer(main.clone()),
            turns: Turns::default(),
            uploads: Lanes::new(writer(pool(uploading)), options.queue_capacity, committed.clone()),
            pool: main,
            clock: options.clock.clone(),
            committed,
            partitions: None,
        })
    }

    pub(crate) async fn close(&self) {
        self.uploads.close().await;
        if let Some(partitions) = &self.partitions {
            partitions.abort();
        }
        self.pool.close().await;
    }

    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        if self.uploads.is_closed() {
            return Err(StoreError::Closed);
        }
        self.can_store().await?;
        sqlx::query("select version from schema_info").fetch_one(&self.pool).await?;
        Ok(())
    }
}

pub(super) fn connect_options(url: &str) -> Result<PgConnectOptions, StoreError> {
    let options: PgConnectOptions = url.parse().map_err(|_| StoreError::unsupported(url))?;
    Ok(options.application_name("actuary"))
}

async fn check(connection: &mut PgConnection) -> Result<(), StoreError> {
    check_server(connection).await?;
    check_role(connection).await?;
    match schema_version(connection).await? {
        None => return Err(StoreError::NotMigrated),
        Some(version) if version < SCHEMA => return Err(StoreError::OlderSchema { version, own: SCHEMA }),
        Some(version) if !is_sealed(connection).await? => {
            return Err(StoreError::OlderSchema { version: version - 1, own: SCHEMA });
        }
        Some(_) => {}
    }
    check_durability(connection).await
}

pub(super) async fn check_server(connection: &mut PgConnection) -> Result<(), StoreError> {
    let (number, encoding): (i64, String) = sqlx::query_as(
        "select cast(current_setting('server_version_num') as bigint), current_setting('server_encoding')",
    )
    .fetch_one(connection)
    .await?;
    if number / 10_000 < OLDEST_SERVER {
        return Err(StoreError::UnsupportedServer { why: format!("it is Postgres {}", number / 10_000) });
    }
    match encoding.as_str() {
        "UTF8" => Ok(()),
        other => Err(StoreError::UnsupportedServer { why: format!("the encoding of the database is {other}") }),
    }
}

/// Tells whether the database at `url` holds a schema of any version, whoever asks.
pub(crate) async fn has_schema(url: &str) -> Result<bool, StoreError> {
    let mut connection = PgConnection::connect_with(&connect_options(url)?).await?;
    let found = schema_exists(&mut connection).await?;
    connection.close().await?;
    Ok(found)
}

async fn schema_exists(connection: &mut PgConnection) -> Result<bool, StoreError> {
    let exists = "select to_regclass('public.schema_info') is not null";
    Ok(sqlx::query_scalar(exists).fetch_one(connection).await?)
}

/// The version of the schema, if there is one; refuses one that excludes this build.
pub(super) async fn schema_version(connection: &mut PgConnection) -> Result<Option<i64>, StoreError> {
    if !schema_exists(connection).await? {
        return Ok(None);
    }
    let (version, min_binary): (i64, i64) =
        sqlx::query_as("select version, min_binary from public.schema_info").fetch_one(connection).await?;
    if min_binary > SCHEMA {
        return Err(StoreError::NewerSchema { version, min_binary, own: SCHEMA });
    }
    Ok(Some(version))
}

/// Tells whether every row has its checksum: `actuary migrate` was not interrupted before that.
async fn is_sealed(connection: &mut PgConnection) -> Result<bool, StoreError> {
    let sealed: i64 = sqlx::query_scalar("select sealed from public.schema_info").fetch_one(connection).await?;
    Ok(sealed == 1)
}

/// Refuses a role that row-level security does not hold, or that is not let in.
async fn check_role(connection: &mut PgConnection) -> Result<(), StoreError> {
    let (role, above): (String, bool) = sqlx::query_as(
        "select cast(current_user as text), exists (
           select from pg_roles r
           where (r.rolsuper or r.rolbypassrls) and pg_has_role(current_user, r.oid, 'member'))",
    )
    .fetch_one(&mut *connection)
    .await?;
    let refuse = |why: &str| Err(StoreError::UnsuitableRole { role: role.clone(), why: why.to_owned() });
    if above {
        return refuse("is above row-level security, or may become a role that is: operators would not be apart");
    }
    let owned: Option<(bool,)> = sqlx::query_as(
        "select pg_has_role(current_user, c.relowner, 'member') from pg_class c
         where c.oid = to_regclass('public.schema_info')",
    )
    .fetch_optional(&mut *connection)
    .await?;
    match owned {
        None => return Err(StoreError::NotMigrated),
        Some((true,)) => return refuse("owns the tables, and could lift what keeps operators apart"),
        Some((false,)) => {}
    }
    let (member, system, inherits): (bool, bool, bool) = sqlx::query_as(
        "select pg_has_role(current_user, 'actuary_service', 'usage'),
                pg_has_role(current_user, 'actuary_system', 'member'),
                pg_has_role(current_user, 'actuary_system', 'usage')",
    )
    .fetch_one(connection)
    .await?;
    if !(member && system) {
        return refuse("is not a member of actuary_service: name it in actuary migrate --service-role");
    }
    if inherits {
        return refuse(
            "inherits actuary_system and would see all operators at once: alter role actuary_service noinherit",
        );
    }
    Ok(())
}

async fn check_durability(connection: &mut PgConnection) -> Result<(), StoreError> {
    const WANTED: [(&str, &[&str]); 3] =
        [("fsync", &["on"]), ("full_page_writes", &["on"]), ("synchronous_commit", &["on", "remote_apply"])];
    for (setting, wanted) in WANTED {
        let found: String =
            sqlx::query_scalar("select current_setting($1)").bind(setting).fetch_one(&mut *connection).await?;
        if !wanted.contains(&found.as_str()) {
            return Err(StoreError::NotDurable { setting, wanted: "on", found });
        }
    }
    Ok(())
}
