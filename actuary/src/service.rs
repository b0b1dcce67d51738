//! The parts of one process around a store: what answers callers, what answers probes, what works.
//! Config -> store -> models -> spawn -> wait -> drain.

use std::{io, net::SocketAddr, num::NonZeroUsize, sync::Arc, thread::available_parallelism, time::Duration};

use anyhow::{Context, Result, anyhow};
use proto::frame::InstallationKey;
use server::Tls;
use store::Store;
use tokio::{net::TcpListener, runtime::Runtime, task::JoinSet, time::timeout};
use tokio_util::sync::CancellationToken;

use crate::{
    clock::Clock,
    database::Database,
    default_model,
    door::{Door, heed_hangups},
    exit::Failure,
    forecaster::WhatIf,
    interrupt::{hangups, interrupted},
    say::say,
    scorer::IssuedScorer,
};

/// How long a worker without work waits before it looks again.
const IDLE: Duration = Duration::from_secs(1);
/// How long analyses under way may go on after the stop.
const DRAIN: Duration = Duration::from_secs(5);
/// Parts that have not ended by then are cut off; they have five seconds for what is under way.
const STOP: Duration = Duration::from_secs(8);
/// How long the database may take to be closed.
const CLOSE: Duration = Duration::from_secs(1);

/// What a process is started with; what is `None` it does not do.
pub struct Settings {
    /// Where the data is.
    pub database: Database,
    /// The present.
    pub clock: Clock,
    /// Answers callers.
    pub api: Option<Api>,
    /// Answers probes at an address of their own.
    pub probes: Option<SocketAddr>,
    /// Analyses what was uploaded.
    pub work: Option<Work>,
}

/// How callers are answered.
pub struct Api {
    /// Where; port 0 = any free one.
    pub door: Door,
    /// Age from which data is stale.
    pub stale_after: Duration,
    /// Whether uploads enrol what is not known yet.
    pub enrol: bool,
    /// The secret from which frame keys follow.
    pub frame_key: Option<InstallationKey>,
}

/// How uploads are analysed.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// Components analysed at the same time.
    pub lanes: NonZeroUsize,
    /// How long a component is claimed: an analysis that takes longer is done again by another worker.
    pub lease: Duration,
}

impl Default for Work {
    /// One analysis per core, two minutes each.
    fn default() -> Self {
        Self { lanes: available_parallelism().unwrap_or(NonZeroUsize::MIN), lease: Duration::from_secs(120) }
    }
}

impl Work {
    /// As the worker takes it.
    pub fn settings(self, clock: Clock) -> worker::Settings {
        worker::Settings { concurrency: self.lanes, lease: self.lease, idle: IDLE, drain: DRAIN, clock }
    }
}

/// A running process.
pub struct Service {
    /// Its database.
    pub store: Store,
    /// Where it answers callers.
    pub api: Option<SocketAddr>,
    /// Where it answers probes besides.
    pub probes: Option<SocketAddr>,
    tls: Option<Tls>,
    shutdown: CancellationToken,
    parts: JoinSet<()>,
}

impl Service {
    /// Opens the database and starts what was asked for; whoever answers callers makes sure that a model
    /// is active first.
    pub async fn start(settings: Settings) -> Result<Self> {
        outlive_limits();
        // Before anything is recorded.
        let metrics = server::Metrics::install()?;
        let api_listener = bind(settings.api.as_ref().map(|api| api.door.address)).await?;
        let probes_listener = bind(settings.probes).await?;
        let store = settings.database.open().await?;
        let mut service = Self {
            store: store.clone(),
            api: address(api_listener.as_ref())?,
            probes: address(probes_listener.as_ref())?,
            tls: None,
            shutdown: CancellationToken::new(),
            parts: JoinSet::new(),
        };
        let Self { tls, shutdown, parts, .. } = &mut service;
        let clock = settings.clock;
        let units = settings.api.as_ref().map(|api| server::Units::new(api.stale_after));
        if let (Some(listener), Some(api)) = (api_listener, settings.api) {
            api.door.must_be_guarded(&store).await?;
            default_model::provide(&store, clock()).await?;
            let state = server::State {
                store: store.clone(),
                clock: clock.clone(),
                stale_after: api.stale_after,
                enrol: api.enrol,
                hosts: api.door.hosts.clone(),
                origins: api.door.origins.clone(),
                max_connections: api.door.max_connections.get(),
                scorer: Arc::new(IssuedScorer),
                forecaster: Arc::new(WhatIf::new(store.clone(), clock.clone())),
                frame_key: api.frame_key,
                metrics: metrics.clone(),
            };
            let stopped = shutdown.clone().cancelled_owned();
            tls.clone_from(&api.door.tls);
            match api.door.tls {
                None => parts.spawn(server::serve(listener, state, stopped)),
                Some(tls) => parts.spawn(server::serve_tls(listener, tls, state, stopped)),
            };
        }
        if let Some(listener) = probes_listener {
            let (store, clock) = (store.clone(), clock.clone());
            let probed = server::Probed { store, clock, metrics: metrics.clone(), units };
            parts.spawn(server::serve_probes(listener, probed, shutdown.clone().cancelled_owned()));
        }
        if let Some(work) = settings.work {
            parts.spawn(worker::run(store, work.settings(clock), shutdown.clone()));
        }
        Ok(service)
    }

    /// Says on standard output where it answers, one line each.
    fn announce(&self) {
        if let Some(address) = self.api {
            say!("listening on {}://{address}", if self.tls.is_some() { "https" } else { "http" });
        }
        if let Some(address) = self.probes {
            say!("probes on http://{address}");
        }
    }

    /// Says where it answers, and runs until the process is told to stop, or until a part of it ends before.
    pub async fn run(mut self) -> Result<()> {
        // Whoever reads where it answers may send it signals.
        let told_to_stop = interrupted();
        // It does nothing that a stop would have to wait for.
        tokio::spawn(heed_hangups(hangups()?, self.tls.clone()));
        self.announce();
        let ended = tokio::select! {
            () = told_to_stop => Ok(()),
            Some(ended) = self.parts.join_next() => Err(match ended {
                Ok(()) => anyhow!("a part of the service ended"),
                Err(error) => anyhow!(error).context("a part of the service ended"),
            }),
        };
        let stopped = self.stop().await;
        ended.and(stopped)
    }

    /// Takes no more requests and work, lets what is under way end, and closes the database: within ten
    /// seconds, whatever hangs.
    pub async fn stop(mut self) -> Result<()> {
        self.shutdown.cancel();
        let ended = async {
            while let Some(part) = self.parts.join_next().await {
                part?;
            }
            Ok(())
        };
        let stopped = match timeout(STOP, ended).await {
            Ok(ended) => ended,
            Err(_) => {
                tracing::warn!("what was still under way was cut off");
                self.parts.shutdown().await;
                Ok(())
            }
        };
        if timeout(CLOSE, self.store.close()).await.is_err() {
            tracing::warn!("the database was left before it was closed; what was acknowledged is in it");
        }
        stopped
    }
}

/// Runs a process on a runtime of its own; computations that still run at its end are left alone.
pub fn on_runtime(process: impl Future<Output = Result<()>>) -> Result<()> {
    let runtime = Runtime::new().context("cannot start")?;
    let outcome = runtime.block_on(process);
    runtime.shutdown_background();
    outcome
}

/// A file that must not grow further is an error of its writer, as a full disk is, and no end of the process, as
/// SIGXFSZ would have it.
fn outlive_limits() {
    use tokio::signal::unix::{SignalKind, signal};
    const SIGXFSZ: i32 = 25;
    let _ = signal(SignalKind::from_raw(SIGXFSZ));
}

async fn bind(address: Option<SocketAddr>) -> Result<Option<TcpListener>> {
    let Some(address) = address else { return Ok(None) };
    let refuse = |error: io::Error| Failure::BadInput(format!("cannot listen on {address}: {error}"));
    Ok(Some(TcpListener::bind(address).await.map_err(refuse)?))
}

fn address(listener: Option<&TcpListener>) -> io::Result<Option<SocketAddr>> {
    listener.map(TcpListener::local_addr).transpose()
}
