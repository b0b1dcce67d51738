//! `actuary demo`: server, worker, database and a simulated fleet in one process.

use std::{
    fs,
    io::IsTerminal,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, Result};
use clap::Args;
use domain::OperatorId;
use proto::{
    answer::{Page, RulAnswer, TailItem},
    frame::InstallationKey,
};
use simulator::{Client, Fleet, FleetPlan, Pace, Physics};
use tokio::task::JoinHandle;

use crate::{
    clock::SimulatedClock,
    database::Database,
    default_model,
    door::Door,
    exit::Failure,
    flights::FlightArguments,
    hindsight,
    http::Access,
    interrupt::{Unfinished, interrupted},
    say::{note, say},
    service::{Api, Service, Settings, Work, on_runtime},
    table,
    telemetry::LogArguments,
    upkeep::UpkeepArguments,
    uplink::{KeyMaker, Uplink},
};

/// When the demo's future begins.
const START: &str = "2026-01-01T00:00:00Z";
/// Before the oldest unit of any fleet was new.
const DAWN: &str = "2022-01-01T00:00:00Z";
/// The port that is tried first when none is asked for.
const PORT: u16 = 8080;
/// Flight hours per step of the fleet's past, which it flies as fast as it can.
const PAST_STEP_FH: f64 = 40.0;
/// Flight hours per step of its future.
const STEP_FH: f64 = 4.0;
/// Pause between steps while somebody looks on.
const PACE: Duration = Duration::from_millis(1000);
const REFRESH: Duration = Duration::from_secs(2);
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Watch a simulated fleet upload, wear, and be prognosed: everything in one process.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  actuary demo --tails 2 --hours 100 --exit --json > rul.json\n  actuary demo --missions short-haul,cruise"
)]
pub struct Arguments {
    /// Aircraft of the fleet.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    tails: u32,
    /// Simulated flight hours to fly after the back-filled past; without end when not given.
    #[arg(long, allow_negative_numbers = true)]
    hours: Option<f64>,
    /// Seed of everything hidden.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder that keeps the fleet between runs; a fresh temporary one without it.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Port on the loopback address; 8080, or any free one if that is taken.
    #[arg(long)]
    port: Option<u16>,
    #[command(flatten)]
    upkeep: UpkeepArguments,
    #[command(flatten)]
    flights: FlightArguments,
    /// How uploads come down: as JSON, or as frames of one ACARS block each, by keys that are made with the fleet.
    #[arg(long, value_enum, default_value_t)]
    uplink: Uplink,
    /// Stop after the hours (200 when not given), once nothing is pending.
    #[arg(long)]
    exit: bool,
    /// At the end, print an array of RUL objects on standard output; all else goes to standard error.
    #[arg(long, requires = "exit")]
    json: bool,
    #[command(flatten)]
    log: LogArguments,
}

/// Runs the demo.
pub fn run(arguments: Arguments) -> Result<()> {
    arguments.log.start();
    let hours = hours(&arguments)?;
    let make = || tempfile::Builder::new().prefix("actuary-demo-").tempdir();
    let temporary = if arguments.data.is_none() { Some(Unfinished::new(make)?) } else { None };
    let folder = match (&arguments.data, &temporary) {
        (Some(folder), _) => folder.clone(),
        (None, Some(temporary)) => temporary.path().to_owned(),
        (None, None) => unreachable!("one of the two is there"),
    };
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let secret = (arguments.uplink == Uplink::Frame).then(|| secret(&folder.join("frame.key"))).transpose()?;
    on_runtime(demo(&arguments, hours, Database::file(&folder.join("actuary.sqlite")), secret))
}

/// Hours to fly, as far as they are limited.
fn hours(arguments: &Arguments) -> Result<Option<f64>, Failure> {
    match arguments.hours {
        Some(hours) if !(0.0..=100_000.0).contains(&hours) => {
            Err(Failure::BadInput(format!("--hours {hours}: must be 0 to 100000")))
        }
        None if arguments.exit => Ok(Some(200.0)),
        hours => Ok(hours),
    }
}

/// The secret in a file, from which keys of frames follow; a new one where there is none.
fn secret(file: &Path) -> Result<InstallationKey> {
    let written = || file.display().to_string();
    if !file.exists() {
        let mut random = [0; 32];
        getrandom::fill(&mut random).context("the system gives no random numbers")?;
        fs::write(file, hex::encode(random) + "\n").with_context(written)?;
    }
    let text = fs::read_to_string(file).with_context(written)?;
    text.trim_end().parse().with_context(written)
}

async fn demo(
    arguments: &Arguments,
    hours: Option<f64>,
    database: Database,
    secret: Option<InstallationKey>,
) -> Result<()> {
    let plan = plan(arguments)?;
    must_admit_all(&database).await?;
    if !plan.missions.is_empty() {
        let store = database.open().await?;
        let provided = default_model::provide_paced(&store, DAWN.parse()?).await;
        store.close().await;
        provided?;
    }
    let clock = SimulatedClock::new(DAWN.parse()?);
    let settings = |port| Settings {
        database: database.clone(),
        clock: clock.shared(),
        api: Some(Api {
            door: Door::loopback(port),
            stale_after: Duration::from_secs(30 * 86_400),
            enrol: true,
            frame_key: secret.clone(),
        }),
        probes: None,
        work: Some(Work::default()),
    };
    let service = match arguments.port {
        Some(port) => Service::start(settings(port)).await?,
        None => match Service::start(settings(PORT)).await {
            Ok(service) => service,
            Err(_) => Service::start(settings(0)).await?,
        },
    };
    let url = format!("http://{}", service.api.context("the demo answers nobody")?);
    let screen = Screen { url: url.clone(), json: arguments.json };
    screen.say(&format!("Fleet health at {url}/  (REST: /openapi.json, gRPC with reflection on the same port)"));
    let keys = match secret {
        None => None,
        Some(secret) => Some(KeyMaker::of(service.store.clone(), secret, OperatorId::default(), clock.shared()).await?),
    };
    let client = Client::new(Access::default().client(&url.parse()?, PATIENCE)?, url.parse()?);
    let client = keys.into_iter().fold(client, Client::with_frames);
    let flight = tokio::spawn(fly(plan, client, clock, hours, !arguments.exit));
    let onlooker = tokio::spawn(screen.clone().look_on());
    let outcome = tokio::select! {
        landed = finished(flight, &service, arguments.exit) => landed.map(Some),
        () = interrupted() => match arguments.exit {
            true => Err(Failure::Interrupted("the fleet had not landed".to_owned()).into()),
            false => Ok(None),
        },
    };
    onlooker.abort();
    if let (Ok(Some(fleet)), true) = (&outcome, arguments.exit) {
        screen.finish(fleet).await?;
    }
    service.stop().await?;
    outcome.map(|_| ())
}

/// The fleet that was asked for.
fn plan(arguments: &Arguments) -> Result<FleetPlan> {
    let plan = arguments.flights.of(FleetPlan {
        tails: arguments.tails as usize,
        positions: 2,
        seed: arguments.seed,
        start: START.parse()?,
        physics: Physics::HighFidelity,
        upkeep: arguments.upkeep.into(),
        missions: Vec::new(),
        pace: Pace::default(),
        weak_transmission: Vec::new(),
    })?;
    plan.check().map_err(|error| Failure::BadInput(error.to_string()))?;
    Ok(plan)
}

/// Refuses a database whose callers must show a token: the demo's fleet has none.
async fn must_admit_all(database: &Database) -> Result<()> {
    let store = database.open().await?;
    let has_tokens = store.has_tokens().await;
    store.close().await;
    if !has_tokens? {
        return Ok(());
    }
    Err(Failure::BadInput(format!(
        "--data: tokens were created in {database}, so callers must show one, and the demo has none: give another folder, \
         or let `actuary serve` answer from it and `actuary simulate fleet --token` fly"
    ))
    .into())
}

/// Flies the fleet's past as fast as it can, then its future step by step; the clock flies along.
async fn fly(plan: FleetPlan, client: Client, clock: SimulatedClock, hours: Option<f64>, paced: bool) -> Result<Fleet> {
    let mut fleet = Fleet::launch(plan.clone(), client).await?;
    let mut now_fh = fleet.flown_fh();
    let last_fh = hours.map_or(f64::INFINITY, |hours| now_fh.max(0.0) + hours);
    while now_fh < last_fh {
        let past = now_fh < 0.0;
        now_fh = if past { (now_fh + PAST_STEP_FH).min(0.0) } else { (now_fh + STEP_FH).min(last_fh) };
        clock.advance_to(plan.time_at(now_fh));
        let pause = tokio::time::sleep(if paced && !past { PACE } else { Duration::ZERO });
        fleet.fly_until(now_fh).await?;
        pause.await;
    }
    Ok(fleet)
}

/// Waits for the fleet to land; without `exit` the service goes on afterwards.
async fn finished(flight: JoinHandle<Result<Fleet>>, service: &Service, exit: bool) -> Result<Fleet> {
    let fleet = flight.await??;
    if !exit {
        interrupted().await;
        return Ok(fleet);
    }
    while service.store.pending().await? > 0 {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    Ok(fleet)
}

/// Where the fleet is shown.
#[derive(Clone)]
struct Screen {
    url: String,
    json: bool,
}

impl Screen {
    /// Shows the table again and again, and says when the first RULs are there.
    async fn look_on(self) {
        let started = Instant::now();
        let terminal = if self.json { std::io::stderr().is_terminal() } else { std::io::stdout().is_terminal() };
        let mut seen = false;
        let mut last = String::new();
        loop {
            tokio::time::sleep(REFRESH).await;
            let Ok(prognoses) = self.prognoses().await else { continue };
            if !seen && prognoses.iter().any(|body| body.rul_fh.is_some()) {
                seen = true;
                self.say(&format!("First remaining lives after {:.1} s.", started.elapsed().as_secs_f64()));
            }
            let table = table::fleet(&prognoses);
            if terminal {
                self.say(&format!("\x1b[H\x1b[2J{}/\n\n{table}", self.url));
            } else if seen && table != last {
                self.say(&table);
                tokio::time::sleep(4 * REFRESH).await;
            }
            last = table;
        }
    }

    /// The last word: the table, or JSON, and how good the forecasts were.
    async fn finish(&self, fleet: &Fleet) -> Result<()> {
        let prognoses = self.prognoses().await?;
        if self.json {
            say!("{}", serde_json::to_string_pretty(&prognoses)?);
        } else {
            self.say(&table::fleet(&prognoses));
        }
        self.say(&hindsight::verdict(&prognoses, fleet.truth()));
        Ok(())
    }

    /// The whole fleet, as any dashboard would read it.
    async fn prognoses(&self) -> Result<Vec<RulAnswer>> {
        let http = Access::default().client(&self.url.parse()?, PATIENCE)?;
        let mut prognoses = Vec::new();
        let mut cursor = String::new();
        loop {
            let tails: Page<TailItem> = http
                .get(format!("{}/v1/tails?limit=1000{cursor}", self.url))
                .send()
                .await?
                .error_for_status()?
                .json()
                .await?;
            for tail in tails.items {
                let ruls: Page<RulAnswer> = http
                    .get(format!("{}/v1/tails/{}/rul", self.url, tail.tail))
                    .send()
                    .await?
                    .error_for_status()?
                    .json()
                    .await?;
                prognoses.extend(ruls.items);
            }
            match tails.next_cursor {
                None => return Ok(prognoses),
                Some(next) => cursor = format!("&cursor={next}"),
            }
        }
    }

    fn say(&self, text: &str) {
        if self.json {
            note!("{text}");
        } else {
            say!("{text}");
        }
    }
}
