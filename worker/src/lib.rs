//! The bridge between store and pipeline: lease a component, read its life, compute off the
//! runtime, write the results in one short transaction.
//!
//! Invariants: no transaction is open while a computation runs; a worker whose lease was taken over
//! writes nothing (the store checks the fence); an upload whose estimate panics or is not finite is
//! set aside with its reason and never blocks the others.

mod analysis;
mod analyst;
mod lesson;
mod memory;
mod models;

use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, Instant},
};

use domain::{Component, Timestamp};
use store::{Completion, Lease, Store, StoreError};
use tokio::task::{JoinError, JoinSet};
use tokio_util::sync::CancellationToken;
use tracing::{Instrument, Span};

pub use crate::analyst::{Analysis, Analyst};

/// How the worker runs.
#[derive(Clone)]
pub struct Settings {
    /// Components analysed at the same time.
    pub concurrency: NonZeroUsize,
    /// How long a component is claimed; an analysis that takes longer is done again, with more time
    /// ([`Lease::duration`]).
    pub lease: Duration,
    /// How long to wait for news before looking again.
    pub idle: Duration,
    /// How long analyses under way may go on after the stop; what has not ended then is handed back.
    pub drain: Duration,
    /// The present, for the times of results.
    pub clock: Clock,
}

/// Tells the present.
pub type Clock = Arc<dyn Fn() -> Timestamp + Send + Sync>;

/// Why a component could not be analysed; it stays pending and is tried again later.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A life is pinned to a bundle that the store does not hold.
    #[error("bundle {0} is not in the store")]
    UnknownModel(domain::ContentHash),
    /// The store holds a bundle that this binary cannot use.
    #[error("bundle {hash}: {reason}")]
    UnusableModel {
        /// The bundle.
        hash: domain::ContentHash,
        /// What is wrong with it.
        reason: String,
    },
    /// A life is pinned to a prior that the store does not hold.
    #[error("prior {0} is not in the store")]
    UnknownPrior(domain::ContentHash),
    /// The store holds a prior that this binary cannot use.
    #[error("prior {hash}: {reason}")]
    UnusablePrior {
        /// The prior.
        hash: domain::ContentHash,
        /// What is wrong with it.
        reason: String,
    },
    /// The analysis of the whole life failed, not that of one upload.
    #[error("analysis of a life: {0}")]
    Analysis(#[from] pipeline::OutlookError),
    /// Finished lives could not teach.
    #[error("learning from finished lives: {0}")]
    Learning(#[from] pipeline::OtherFaults),
    /// The analysis panicked.
    #[error("analysis of a life ended abnormally: {0}")]
    Abnormal(#[from] JoinError),
}

impl WorkerError {
    /// Whether the store tells of it, once for all that meet it.
    fn is_outage(&self) -> bool {
        matches!(self, Self::Store(error) if error.is_outage())
    }
}

/// Analyses components until `shutdown`; returns once the analyses under way have ended or were handed back.
/// A computation that was handed back may still run on its thread; nothing waits for it.
pub async fn run(store: Store, settings: Settings, shutdown: CancellationToken) {
    let analyst = Arc::new(Analyst::new(store.clone(), settings.clock.clone()));
    let mut parts = JoinSet::new();
    for _ in 0..settings.concurrency.get() {
        let (store, analyst, of_lane, stop) = (store.clone(), analyst.clone(), settings.clone(), shutdown.clone());
        let lane = move || lane(store.clone(), analyst.clone(), of_lane.clone(), stop.clone());
        parts.spawn(keep_up(lane, settings.clone(), shutdown.clone()));
    }
    let (of_learning, stop) = (settings.clone(), shutdown.clone());
    let learning = move || lesson::learn(store.clone(), analyst.clone(), of_learning.clone(), stop.clone());
    parts.spawn(keep_up(learning, settings, shutdown));
    parts.join_all().await;
}

/// Starts a part of the worker again whenever it ends abnormally, until `shutdown`.
async fn keep_up<F>(part: impl Fn() -> F, settings: Settings, shutdown: CancellationToken)
where
    F: Future<Output = ()> + Send + 'static,
{
    while let Err(error) = tokio::spawn(part()).await {
        metrics::counter!(metric::WORKER_RESTARTS.name).increment(1);
        tracing::error!(%error, "a part of the worker ended abnormally; it is started again");
        wait(std::future::pending(), &settings, &shutdown).await;
        if shutdown.is_cancelled() {
            return;
        }
    }
}

async fn lane(store: Store, analyst: Arc<Analyst>, settings: Settings, shutdown: CancellationToken) {
    while !shutdown.is_cancelled() {
        match store.lease(settings.lease).await {
            Ok(Some(lease)) => {
                let span = span_of(&lease);
                serve_lease(&store, &analyst, &settings, lease, &shutdown).instrument(span).await
            }
            // It looks into the queue itself once it listens, so nothing that came since the lease was asked for is missed.
            Ok(None) => wait(store.work_available(), &settings, &shutdown).await,
            Err(error) => {
                if !error.is_outage() {
                    tracing::error!(%error, "cannot lease a component");
                }
                wait(std::future::pending(), &settings, &shutdown).await;
            }
        }
    }
}

/// What the log says of everything that is done for a lease.
fn span_of(lease: &Lease) -> Span {
    let Component { operator, part_number, serial_number } = &lease.component;
    tracing::info_span!("lease", %operator, %part_number, %serial_number, fence = lease.fence)
}

async fn wait(news: impl Future<Output = ()>, settings: &Settings, shutdown: &CancellationToken) {
    tokio::select! {
        () = news => {}
        () = tokio::time::sleep(settings.idle) => {}
        () = shutdown.cancelled() => {}
    }
}

async fn serve_lease(
    store: &Store,
    analyst: &Analyst,
    settings: &Settings,
    lease: Lease,
    shutdown: &CancellationToken,
) {
    let begun = Instant::now();
    let completion = tokio::select! {
        biased;
        completion = analyst.serve(&lease) => completion,
        () = drained(settings, shutdown) => {
            metrics::counter!(metric::LEASES.name, "outcome" => "returned").increment(1);
            tracing::info!("the worker stops before the analysis has ended; the component is handed back");
            return hand_back(store, &lease, Duration::ZERO).await;
        }
    };
    metrics::histogram!(metric::ANALYSIS_SECONDS.name).record(begun.elapsed());
    let outcome = match &completion {
        Ok(Completion::Done) => "done",
        Ok(Completion::Fenced) => "fenced",
        Err(_) => "failed",
    };
    metrics::counter!(metric::LEASES.name, "outcome" => outcome).increment(1);
    match completion {
        Ok(Completion::Done) => tracing::debug!("analysed"),
        Ok(Completion::Fenced) => {
            tracing::info!("the lease ended early: a correction came in, or another worker took over")
        }
        Err(error) => {
            tracing::error!(attempts = lease.attempts, %error, "analysis failed");
            hand_back(store, &lease, Duration::from_secs(1 << lease.attempts.min(8))).await;
        }
    }
}

/// Completes when analyses may not go on any longer.
async fn drained(settings: &Settings, shutdown: &CancellationToken) {
    shutdown.cancelled().await;
    tokio::time::sleep(settings.drain).await;
}

async fn hand_back(store: &Store, lease: &Lease, retry_after: Duration) {
    if let Err(error) = store.abandon(lease, retry_after).await {
        tracing::error!(%error, "cannot hand the component back; its lease will expire");
    }
}
