//! The schema: made by `actuary migrate` as the role that owns it, never by the service.

use std::sync::Arc;

use sqlx::{AssertSqlSafe, Connection as _, PgConnection, migrate::Migrator, raw_sql};

use super::open::{check_server, connect_options, schema_version};
use crate::{StoreError, schema::SCHEMA};

/// Brings the schema of the database at `url` up to date, and lets a role serve it.
pub(crate) async fn migrate(url: &str, service_role: Option<&str>) -> Result<(), StoreError> {
    let options = connect_options(url)?.options([("search_path", "public")]);
    let mut connection = PgConnection::connect_with(&options).await?;
    check_server(&mut connection).await?;
    schema_version(&mut connection).await?;
    let mut migrator: Migrator = sqlx::migrate!("../migrations/postgres");
    // A newer build may have added migrations that this one can live with: min_binary says so. Each one is a
    // transaction; of two processes that migrate at the same time, one fails and changes nothing.
    migrator.set_ignore_missing(true).set_locking(false);
    let migrated = migrator.run_direct(None, &mut connection, false).await;
    migrated.map_err(|error| StoreError::Migration(Arc::new(error)))?;
    debug_assert_eq!(schema_version(&mut connection).await?.map(|version| version >= SCHEMA), Some(true));
    if let Some(role) = service_role {
        let_serve(&mut connection, role).await?;
    }
    Ok(connection.close().await?)
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
