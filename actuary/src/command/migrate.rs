//! `actuary migrate`: brings a database to the schema of this build.

use anyhow::Result;
use clap::Args;

use crate::{database::Database, say::say, service::on_runtime, telemetry::LogArguments};

/// Create the tables of a database, or bring them to the schema of this build; without effect when they are.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary migrate --database-url postgres://owner@localhost/actuary --service-role service\n\n\
    `actuary serve` migrates an SQLite file by itself. On Postgres only this command does, as the user who owns the tables."
)]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    /// The Postgres role as which servers and workers log in; it is let in, and must not own the tables.
    #[arg(long, env = "ACTUARY_SERVICE_ROLE", value_name = "ROLE")]
    service_role: Option<String>,
    #[command(flatten)]
    log: LogArguments,
}

/// Migrates.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.log.start();
    on_runtime(async {
        arguments.database.migrate(arguments.service_role.as_deref()).await?;
        say!("{}: up to date", arguments.database);
        Ok(())
    })
}
