//! `actuary simulate fleet`: a fleet that uploads to a running service.

use std::{path::PathBuf, time::Duration};

use anyhow::Result;
use clap::Args;
use domain::{OperatorId, Timestamp};
use simulator::{Client, Fleet, FleetError, FleetPlan, Pace};

use super::PhysicsName;
use crate::{
    clock,
    database::Database,
    exit::Failure,
    files::output::OutputFile,
    flights::FlightArguments,
    frame_key::FrameKeyFile,
    http::{self, Access, Address},
    say::say,
    telemetry::LogArguments,
    upkeep::UpkeepArguments,
    uplink::{KeyMaker, Uplink},
};

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Fly a simulated fleet against a running service, as fast as it takes the uploads, and report what its mechanics do. Started
/// again with the same options, it goes on where the service heard of it last.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary simulate fleet --url http://127.0.0.1:8080 --tails 2 --truth truth.csv")]
pub struct Arguments {
    /// The service.
    #[arg(long, env = "ACTUARY_URL", hide_env_values = true)]
    url: Address,
    #[command(flatten)]
    access: Access,
    /// Aircraft of the fleet.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=999))]
    tails: u32,
    /// Actuators of each: ailerons, flaps, elevators; no grating sees what an elevator does.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=6))]
    positions: u32,
    /// Flight hours to fly after the back-filled past.
    #[arg(long, default_value_t = 200.0, allow_negative_numbers = true)]
    hours: f64,
    /// Seed of everything hidden.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// When the past ends (RFC 3339); the hours are flown before now without it.
    #[arg(long, value_name = "TIME")]
    start: Option<Timestamp>,
    /// What makes the samples.
    #[arg(long, value_enum, default_value_t = PhysicsName::Hf)]
    physics: PhysicsName,
    #[command(flatten)]
    upkeep: UpkeepArguments,
    #[command(flatten)]
    flights: FlightArguments,
    /// How uploads come down: as JSON, or as frames of one ACARS block each. Their keys are made in the service's database,
    /// from the secret that it was started with.
    #[arg(long, value_enum, default_value_t)]
    uplink: Uplink,
    #[command(flatten)]
    secret: FrameKeyFile,
    /// Whose aircraft fly: the operator of the token.
    #[arg(long, env = "ACTUARY_OPERATOR", default_value = "default")]
    operator: OperatorId,
    #[command(flatten)]
    database: Database,
    /// Where to write the hidden truth.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    log: LogArguments,
}

/// Flies the fleet.
pub fn run(arguments: Arguments) -> Result<()> {
    arguments.log.start();
    tokio::runtime::Runtime::new()?.block_on(fly(arguments))
}

async fn fly(arguments: Arguments) -> Result<()> {
    if !(0.0..=100_000.0).contains(&arguments.hours) {
        return Err(Failure::BadInput(format!("--hours {}: must be 0 to 100000", arguments.hours)).into());
    }
    let now = clock::system()();
    let start = arguments.start.unwrap_or(now.plus_hours(-24.0 / simulator::FH_PER_DAY * arguments.hours));
    let plan = arguments.flights.of(FleetPlan {
        tails: arguments.tails as usize,
        positions: arguments.positions as usize,
        seed: arguments.seed,
        start,
        physics: arguments.physics.into(),
        upkeep: arguments.upkeep.into(),
        missions: Vec::new(),
        pace: Pace::default(),
        weak_transmission: Vec::new(),
    })?;
    let url = arguments.url.url()?;
    let truth = arguments.truth.as_deref().map(OutputFile::new).transpose()?;
    let client = Client::new(arguments.access.client(&url, PATIENCE)?, url);
    let client = match arguments.uplink {
        Uplink::Json => client,
        Uplink::Frame => {
            let (secret, store) = (arguments.secret.required()?, arguments.database.open_beside().await?);
            client.with_frames(KeyMaker::of(store, secret, arguments.operator.clone(), clock::system()).await?)
        }
    };
    let mut fleet = Fleet::launch(plan, client).await.map_err(failure)?;
    let flown = fleet.fly_until(arguments.hours).await.map_err(failure)?;
    if let Some(truth) = &truth {
        truth.write(|writer| simulator::write_truth(fleet.truth(), writer))?;
    }
    say!("{} uploads accepted, {} known already", flown.accepted, flown.duplicates);
    Ok(())
}

fn failure(error: FleetError) -> anyhow::Error {
    match error {
        FleetError::NotReachable { url, error } => http::silent(&url, &error).into(),
        FleetError::Overloaded(_) => Failure::NotReachable(error.to_string()).into(),
        FleetError::BadPlan { .. } => Failure::BadInput(error.to_string()).into(),
        other => other.into(),
    }
}
