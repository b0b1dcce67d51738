//! `actuary serve`: what answers callers, with or without a worker beside it.

use std::time::Duration;

use anyhow::Result;
use clap::{Args, builder::FalseyValueParser};

use crate::{
    clock,
    database::Database,
    door::DoorArguments,
    exit::Failure,
    frame_key::FrameKeyFile,
    health::HealthArguments,
    service::{Api, Service, Settings, on_runtime},
    telemetry::LogArguments,
    work::WorkArguments,
};

/// Serve REST, gRPC and pages, with a worker in the same process. As long as no token was ever created, everyone on this
/// machine is the administrator of the operator `default`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary serve --database-url sqlite:fleet.sqlite --port 8080\n  \
    actuary serve --listen 0.0.0.0:8443 --tls-cert service.pem --tls-key service.key --client-ca fleet.pem")]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    #[command(flatten)]
    door: DoorArguments,
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
    frames: FrameKeyFile,
    #[command(flatten)]
    health: HealthArguments,
    #[command(flatten)]
    work: WorkArguments,
    #[command(flatten)]
    log: LogArguments,
}

/// Serves until interrupted.
pub fn run(arguments: Arguments) -> Result<()> {
    arguments.log.start();
    if arguments.no_worker && !arguments.database.is_postgres() {
        let text = "--no-worker needs Postgres: nobody else can work on an SQLite file that this process serves";
        return Err(Failure::BadInput(text.to_owned()).into());
    }
    let clock = clock::system();
    let door = arguments.door.door(clock.clone())?;
    let frame_key = arguments.frames.read()?;
    on_runtime(async {
        Service::start(Settings {
            database: arguments.database,
            clock,
            api: Some(Api {
                door,
                stale_after: Duration::from_secs(86_400 * u64::from(arguments.stale_after_days)),
                enrol: !arguments.no_enrolment,
                frame_key,
            }),
            probes: arguments.health.address(),
            work: (!arguments.no_worker).then(|| arguments.work.work()),
        })
        .await?
        .run()
        .await
    })
}
