//! `actuary serve`: the service by itself.

use std::time::Duration;

use anyhow::Result;
use clap::Args;

use crate::{
    clock,
    service::{Service, Settings, interrupted},
    telemetry,
};

/// Serve REST, gRPC and pages, with the worker in the same process. Loopback only, no tokens.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary serve --database-url sqlite:fleet.sqlite --port 8080")]
pub struct Arguments {
    /// The database.
    #[arg(long, env = "ACTUARY_DATABASE_URL", default_value = "sqlite:actuary.sqlite")]
    database_url: String,
    /// Port on the loopback address; 0 takes any free one.
    #[arg(long, env = "ACTUARY_PORT", default_value_t = 8080)]
    port: u16,
    /// Days after which the newest data is stale.
    #[arg(long, env = "ACTUARY_STALE_AFTER_DAYS", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    stale_after_days: u32,
    /// Refuse uploads for tails, positions and components that are not known yet.
    #[arg(long, env = "ACTUARY_NO_ENROLMENT")]
    no_enrolment: bool,
}

/// Serves until interrupted.
pub fn run(arguments: Arguments) -> Result<()> {
    telemetry::start();
    tokio::runtime::Runtime::new()?.block_on(async {
        let service = Service::start(Settings {
            database_url: arguments.database_url,
            port: arguments.port,
            clock: clock::system(),
            stale_after: Duration::from_secs(86_400 * u64::from(arguments.stale_after_days)),
            enrol: !arguments.no_enrolment,
        })
        .await?;
        println!("listening on {}", service.url());
        interrupted().await;
        service.stop().await
    })
}
