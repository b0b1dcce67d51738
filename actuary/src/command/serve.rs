//! `actuary serve`: what answers callers, with or without a worker beside it.

use std::time::Duration;

use anyhow::Result;
use clap::{Args, builder::FalseyValueParser};

use crate::{
    clock,
    database::Database,
    exit::Failure,
    health::HealthArguments,
    service::{Api, Service, Settings, loopback, on_runtime},
    telemetry,
    work::WorkArguments,
};

/// Serve REST, gRPC and pages, with a worker in the same process. Loopback only, no tokens.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary serve --database-url sqlite:fleet.sqlite --port 8080")]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    /// Port on the loopback address; 0 takes any free one.
    #[arg(long, env = "ACTUARY_PORT", default_value_t = 8080)]
    port: u16,
    /// Days after which the newest data is stale.
    #[arg(long, env = "ACTUARY_STALE_AFTER_DAYS", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    stale_after_days: u32,
    /// Refuse uploads for tails, positions and components that are not known yet.
    #[arg(long, env = "ACTUARY_NO_ENROLMENT", value_parser = FalseyValueParser::new())]
    no_enrolment: bool,
    /// Leave the analysis to `actuary worker` processes on the same Postgres.
    #[arg(long, env = "ACTUARY_NO_WORKER", value_parser = FalseyValueParser::new())]
    no_worker: bool,
    #[command(flatten)]
    health: HealthArguments,
    #[command(flatten)]
    work: WorkArguments,
}

/// Serves until interrupted.
pub fn run(arguments: Arguments) -> Result<()> {
    telemetry::start();
    if arguments.no_worker && !arguments.database.is_postgres() {
        let text = "--no-worker needs Postgres: nobody else can work on an SQLite file that this process serves";
        return Err(Failure::BadInput(text.to_owned()).into());
    }
    on_runtime(async {
        let service = Service::start(Settings {
            database: arguments.database,
            clock: clock::system(),
            api: Some(Api {
                address: loopback(arguments.port),
                stale_after: Duration::from_secs(86_400 * u64::from(arguments.stale_after_days)),
                enrol: !arguments.no_enrolment,
            }),
            probes: arguments.health.address(),
            work: (!arguments.no_worker).then(|| arguments.work.work()),
        })
        .await?;
        service.announce();
        service.run().await
    })
}
