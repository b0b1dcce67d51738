//! Store, server and worker in one process: config -> store -> models -> spawn -> wait -> drain.

use std::{
    net::{Ipv4Addr, SocketAddr},
    num::NonZeroUsize,
    sync::Arc,
    thread::available_parallelism,
    time::Duration,
};

use anyhow::Result;
use store::{Options, Store};
use tokio::{net::TcpListener, task::JoinHandle};
use tokio_util::sync::CancellationToken;

use crate::{clock::Clock, default_model, exit::Failure, scorer::IssuedScorer};

/// How long an analysis may take before another worker takes over.
const LEASE: Duration = Duration::from_secs(120);
const IDLE: Duration = Duration::from_secs(1);

/// What a service is started with.
pub struct Settings {
    /// Where the data is: `sqlite:FILE`.
    pub database_url: String,
    /// Loopback port; 0 = any free one.
    pub port: u16,
    /// The present.
    pub clock: Clock,
    /// Age from which data is stale.
    pub stale_after: Duration,
    /// Whether uploads enrol what is not known yet.
    pub enrol: bool,
}

/// A running service.
pub struct Service {
    /// Its database.
    pub store: Store,
    /// Where it listens.
    pub address: SocketAddr,
    shutdown: CancellationToken,
    server: JoinHandle<()>,
    worker: JoinHandle<()>,
}

impl Service {
    /// Opens the database, makes sure that a model is active, and starts server and worker.
    pub async fn start(settings: Settings) -> Result<Self> {
        // Before anything is recorded.
        let metrics = server::Metrics::install()?;
        let listener = bind(settings.port).await?;
        let address = listener.local_addr()?;
        let store = Store::open(&settings.database_url, Options::default())
            .await
            .map_err(|error| Failure::BadInput(format!("{}: {error}", settings.database_url)))?;
        default_model::provide(&store, (settings.clock)()).await?;
        let shutdown = CancellationToken::new();
        let worker_settings =
            worker::Settings { concurrency: lanes(), lease: LEASE, idle: IDLE, clock: settings.clock.clone() };
        let worker = tokio::spawn(worker::run(store.clone(), worker_settings, shutdown.clone()));
        let state = server::State {
            store: store.clone(),
            clock: settings.clock,
            stale_after: settings.stale_after,
            enrol: settings.enrol,
            scorer: Arc::new(IssuedScorer),
            metrics,
        };
        let server = tokio::spawn(server::serve(listener, state, shutdown.clone().cancelled_owned()));
        Ok(Self { store, address, shutdown, server, worker })
    }

    /// `http://` and the address.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Stops taking requests, lets running work end, and closes the database.
    pub async fn stop(self) -> Result<()> {
        self.shutdown.cancel();
        let served = self.server.await;
        self.worker.await?;
        self.store.close().await;
        Ok(served?)
    }
}

/// Ends at SIGINT or SIGTERM.
pub async fn interrupted() {
    use tokio::signal::unix::{SignalKind, signal};
    let terminated = async {
        match signal(SignalKind::terminate()) {
            Ok(mut signal) => signal.recv().await,
            Err(_) => std::future::pending().await,
        }
    };
    tokio::select! {
        _ = terminated => {}
        _ = tokio::signal::ctrl_c() => {}
    }
}

/// Loopback only: there is no way yet to tell callers apart.
async fn bind(port: u16) -> Result<TcpListener> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let refuse = |error: std::io::Error| Failure::BadInput(format!("cannot listen on {address}: {error}"));
    Ok(TcpListener::bind(address).await.map_err(refuse)?)
}

/// One analysis per core.
fn lanes() -> NonZeroUsize {
    available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
