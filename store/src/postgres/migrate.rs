//! The schema: made by `actuary migrate` as the role that owns it, never by the service.

use std::sync::Arc;

use sqlx::{AssertSqlSafe, Connection as _, PgConnection, migrate::Migrator, postgres::PgConnectOptions, raw_sql};

use super::{
    open::{check_server, connect_options, schema_version},
    sql::{catch_up, derive_again, seal_models, seal_rows},
};
use crate::{StoreError, schema::SCHEMA};

/// Brings the schema of the database at `url` up to date, and lets a role serve it.
pub(crate) async fn migrate(url: &str, service_role: Option<&str>) -> Result<(), StoreError> {
    let options = connect_options(url)?.options([("search_path", "public")]);
    let mut connection = PgConnection::connect_with(&options).await?;
    check_server(&mut connection).await?;
    schema_version(&mut connection).await?;
    let mut migrator: Migrator = sqlx_macros::migrate!("../migrations/postgres");
    // A newer build may have added migrations that this one can live with: min_binary says so. Each one is a
    // transaction; of two processes that migrate at the same time, one fails and changes nothing.
    migrator.set_ignore_missing(true).set_locking(false);
    let migrated = migrator.run_direct(None, &mut connection, false).await;
    migrated.map_err(|error| StoreError::Migration(Arc::new(error)))?;
    seal(&options, &mut connection).await?;
    for operator in operators(&mut connection).await? {
        sqlx::query(ENTER).bind(&operator).execute(&mut connection).await?;
        if let Ok(operator) = operator.parse() {
            catch_up(&mut connection, &operator).await?;
        }
    }
    debug_assert_eq!(schema_version(&mut connection).await?.map(|version| version >= SCHEMA), Some(true));
    if let Some(role) = service_role {
        let_serve(&mut connection, role).await?;
    }
    Ok(connection.close().await?)
}

/// Gives their checksums to the rows of a database that had none yet, and makes its installations by the present rules;
/// from then on no row is without.
async fn seal(options: &PgConnectOptions, connection: &mut PgConnection) -> Result<(), StoreError> {
    let sealed: i64 = sqlx::query_scalar("select sealed from schema_info").fetch_one(&mut *connection).await?;
    if sealed == 1 {
        return Ok(());
    }
    let mut reader = PgConnection::connect_with(options).await?;
    for operator in operators(connection).await? {
        // Row-level security holds the owner of the tables, too.
        for connection in [&mut reader, &mut *connection] {
            sqlx::query(ENTER).bind(&operator).execute(connection).await?;
        }
        seal_rows(&mut reader, connection).await?;
        let Ok(operator) = operator.parse() else { continue };
        let mut transaction = connection.begin().await?;
        derive_again(&mut transaction, &operator).await?;
        transaction.commit().await?;
    }
    reader.close().await?;
    sqlx::query(ENTER).bind("").execute(&mut *connection).await?;
    seal_models(connection).await?;
    for validate in VALIDATE {
        sqlx::query(validate).execute(&mut *connection).await?;
    }
    sqlx::query("update schema_info set sealed = 1").execute(connection).await?;
    Ok(())
}

/// Enters an operator for the rest of a session.
const ENTER: &str = "select set_config('actuary.operator', $1, false)";

/// Says of each table that no row is without its checksum any longer.
const VALIDATE: [&str; 15] = [
    "alter table operators validate constraint operators_sealed",
    "alter table tails validate constraint tails_sealed",
    "alter table components validate constraint components_sealed",
    "alter table lives validate constraint lives_sealed",
    "alter table generations validate constraint generations_sealed",
    "alter table installations validate constraint installations_sealed",
    "alter table observed_installations validate constraint observed_installations_sealed",
    "alter table movements validate constraint movements_sealed",
    "alter table upload_keys validate constraint upload_keys_sealed",
    "alter table inbox validate constraint inbox_sealed",
    "alter table set_aside validate constraint set_aside_sealed",
    "alter table exclusions validate constraint exclusions_sealed",
    "alter table voided validate constraint voided_sealed",
    "alter table voided_events validate constraint voided_events_sealed",
    "alter table bundles validate constraint bundles_sealed",
];

/// All operators, for a role that owns the tables: what holds it as well is lifted in a transaction that changes
/// nothing.
async fn operators(connection: &mut PgConnection) -> Result<Vec<String>, StoreError> {
    let mut transaction = connection.begin().await?;
    sqlx::query("alter table operators no force row level security").execute(&mut *transaction).await?;
    let operators = sqlx::query_scalar("select operator from operators order by operator");
    let operators = operators.fetch_all(&mut *transaction).await?;
    transaction.rollback().await?;
    Ok(operators)
}

/// Makes a role a member of `actuary_service`.
async fn let_serve(connection: &mut PgConnection, role: &str) -> Result<(), StoreError> {
    let refuse = |why: &str| StoreError::UnsuitableRole { role: role.to_owned(), why: why.to_owned() };
    let known: Option<(bool, bool)> = sqlx::query_as(
        "select rolsuper or rolbypassrls, pg_has_role(oid, 'actuary_service', 'member') from pg_roles
         where rolname = $1",
    )
    .bind(role)
    .fetch_optional(&mut *connection)
    .await?;
    match known {
        None => Err(refuse("does not exist: create it with LOGIN and a password")),
        Some((true, _)) => Err(refuse("is above row-level security: let the service log in as another role")),
        Some((_, true)) => Ok(()),
        Some(_) => {
            let grant: String = sqlx::query_scalar("select format('grant actuary_service to %I', cast($1 as text))")
                .bind(role)
                .fetch_one(&mut *connection)
                .await?;
            raw_sql(AssertSqlSafe(grant)).execute(connection).await?;
            Ok(())
        }
    }
}
