//! `actuary worker`: analyses what servers on the same Postgres take in.

use anyhow::Result;
use clap::Args;

use crate::{
    clock,
    database::Database,
    exit::Failure,
    health::HealthArguments,
    service::{Service, Settings, on_runtime},
    telemetry::LogArguments,
    work::WorkArguments,
};

/// Analyse uploads and learn priors, beside any number of servers and other workers on one Postgres.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary worker --database-url postgres://actuary@localhost/actuary --health-port 9090"
)]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    #[command(flatten)]
    health: HealthArguments,
    #[command(flatten)]
    work: WorkArguments,
    #[command(flatten)]
    log: LogArguments,
}

/// Works until interrupted.
pub fn run(arguments: Arguments) -> Result<()> {
    arguments.log.start();
    if !arguments.database.is_postgres() {
        let database = &arguments.database;
        return Err(Failure::BadInput(format!(
            "{database}: a worker of its own needs Postgres; an SQLite file belongs to one process: `actuary serve` works on it, too"
        ))
        .into());
    }
    on_runtime(async {
        Service::start(Settings {
            database: arguments.database,
            clock: clock::system(),
            api: None,
            probes: arguments.health.address(),
            work: Some(arguments.work.work()),
        })
        .await?
        .run()
        .await
    })
}
