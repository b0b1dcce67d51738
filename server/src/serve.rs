//! From a listener to answered connections, and an end within a bounded time.

use std::{io, time::Duration};

use axum::Router;
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto, graceful::GracefulShutdown},
    service::TowerToHyperService,
};
use tokio::{
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_util::sync::CancellationToken;

use crate::{Metrics, Probed, State, app, rest};

/// A client that has not finished its header by then is cut off; it bounds idle connections too.
const HEADER_TIMEOUT: Duration = Duration::from_secs(20);
/// A silent HTTP/2 peer is asked for a sign of life.
const PING_INTERVAL: Duration = Duration::from_secs(30);
/// How long answers under way may take after the stop.
const DRAIN: Duration = Duration::from_secs(5);
/// How often what was recorded is sorted, whether or not anybody asks for it.
const UPKEEP: Duration = Duration::from_secs(5);
/// Pause after the system refused a connection, such as for want of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Serves REST, gRPC and pages on `listener` until `shutdown` completes; then lets answers under
/// way end, for at most five seconds.
pub async fn serve(listener: TcpListener, state: State, shutdown: impl Future<Output = ()>) {
    let stopping = CancellationToken::new();
    let metrics = state.metrics.clone();
    let router = app::router(state, stopping.clone()).await;
    answer(listener, router, metrics, stopping, shutdown).await;
}

/// Serves the probes of a process and nothing else, in the same manner.
pub async fn serve_probes(listener: TcpListener, probed: Probed, shutdown: impl Future<Output = ()>) {
    let metrics = probed.metrics.clone();
    answer(listener, rest::probes(probed), metrics, CancellationToken::new(), shutdown).await;
}

async fn answer(
    listener: TcpListener,
    router: Router,
    metrics: Metrics,
    stopping: CancellationToken,
    shutdown: impl Future<Output = ()>,
) {
    let mut upkeep = tokio::time::interval(UPKEEP);
    let builder = builder();
    let graceful = GracefulShutdown::new();
    let mut connections = JoinSet::new();
    let mut shutdown = std::pin::pin!(shutdown);
    loop {
        tokio::select! {
            () = &mut shutdown => break,
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => {
                    let connection = connection(builder.clone(), stream, router.clone(), graceful.watcher());
                    connections.spawn(connection);
                }
                Err(error) => pause_after(&error).await,
            },
            _ = upkeep.tick() => metrics.upkeep(),
            // Finished connections are collected as they end.
            Some(_) = connections.join_next() => {}
        }
    }
    drop(listener);
    stopping.cancel();
    if timeout(DRAIN, graceful.shutdown()).await.is_err() {
        tracing::warn!(connections = connections.len(), "connections were cut off after the drain");
    }
    connections.shutdown().await;
}

fn builder() -> auto::Builder<TokioExecutor> {
    let mut builder = auto::Builder::new(TokioExecutor::new());
    builder.http1().timer(TokioTimer::new()).header_read_timeout(HEADER_TIMEOUT);
    builder.http2().timer(TokioTimer::new()).keep_alive_interval(PING_INTERVAL).keep_alive_timeout(HEADER_TIMEOUT);
    builder
}

async fn connection(
    builder: auto::Builder<TokioExecutor>,
    stream: TcpStream,
    router: Router,
    watcher: hyper_util::server::graceful::Watcher,
) {
    // The protocol is told by the first bytes, and no header time-out runs before it is known.
    if !matches!(timeout(HEADER_TIMEOUT, stream.readable()).await, Ok(Ok(()))) {
        return;
    }
    // Small answers must not wait for each other's acknowledgement.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(router);
    let serving = builder.serve_connection(TokioIo::new(stream), service).into_owned();
    if let Err(error) = watcher.watch(serving).await {
        tracing::debug!(error, "a connection ended abnormally");
    }
}

async fn pause_after(error: &io::Error) {
    tracing::warn!(%error, "cannot accept a connection");
    tokio::time::sleep(ACCEPT_PAUSE).await;
}
