//! From a listener to answered connections, and an end within a bounded time.

use std::{io, net::SocketAddr, sync::Arc, time::Duration};

use axum::{Extension, Router};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto, graceful::GracefulShutdown},
    service::TowerToHyperService,
};
use tokio::{
    io::{AsyncBufReadExt, AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, BufReader},
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_rustls::server::TlsStream;
use tokio_util::sync::CancellationToken;
use tower::Layer;

use crate::{
    Metrics, Probed, State, app,
    auth::{ClientCertificate, Peer},
    rest,
    tls::{self, Tls},
};

/// A client that has not finished its header by then is cut off; it bounds idle connections too.
const HEADER_TIMEOUT: Duration = Duration::from_secs(20);
/// A client that has not finished its handshake by then is cut off.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// How long a client whose handshake was refused may take to read why.
const FAREWELL: Duration = Duration::from_secs(1);
/// A silent HTTP/2 peer is asked for a sign of life.
const PING_INTERVAL: Duration = Duration::from_secs(30);
/// How long answers under way may take after the stop.
const DRAIN: Duration = Duration::from_secs(5);
/// How often what was recorded is sorted, whether or not anybody asks for it.
const UPKEEP: Duration = Duration::from_secs(5);
/// How often it is seen whether the files of TLS have changed.
const TLS_REFRESH: Duration = Duration::from_secs(1);
/// Pause after the system refused a connection, such as for want of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Serves REST, gRPC and pages on `listener` until `shutdown` completes; then lets answers under
/// way end, for at most five seconds.
pub async fn serve(listener: TcpListener, state: State, shutdown: impl Future<Output = ()>) {
    serve_all(listener, None, state, shutdown).await;
}

/// The same behind TLS. Where client certificates are known, callers that show nothing are refused even as long as
/// there is no token.
pub async fn serve_tls(listener: TcpListener, tls: Tls, state: State, shutdown: impl Future<Output = ()>) {
    serve_all(listener, Some(tls), state, shutdown).await;
}

async fn serve_all(listener: TcpListener, tls: Option<Tls>, state: State, shutdown: impl Future<Output = ()>) {
    let stopping = CancellationToken::new();
    let metrics = state.metrics.clone();
    let closed = tls.as_ref().is_some_and(Tls::knows_clients);
    let router = app::router(state, closed, stopping.clone()).await;
    answer(listener, tls, router, metrics, stopping, shutdown).await;
}

/// Serves the probes of a process and nothing else, in the same manner.
pub async fn serve_probes(listener: TcpListener, probed: Probed, shutdown: impl Future<Output = ()>) {
    let metrics = probed.metrics.clone();
    answer(listener, None, rest::probes(probed), metrics, CancellationToken::new(), shutdown).await;
}

async fn answer(
    listener: TcpListener,
    tls: Option<Tls>,
    router: Router,
    metrics: Metrics,
    stopping: CancellationToken,
    shutdown: impl Future<Output = ()>,
) {
    let mut upkeep = tokio::time::interval(UPKEEP);
    let mut refresh = tokio::time::interval(TLS_REFRESH);
    let graceful = GracefulShutdown::new();
    let door = Door { builder: builder(), router, tls: tls.clone(), stopping: stopping.clone() };
    let mut connections = JoinSet::new();
    let mut shutdown = std::pin::pin!(shutdown);
    loop {
        tokio::select! {
            () = &mut shutdown => break,
            accepted = listener.accept() => match accepted {
                Ok((stream, peer)) => {
                    connections.spawn(door.clone().welcome(stream, peer, graceful.watcher()));
                }
                Err(error) => pause_after(&error).await,
            },
            _ = upkeep.tick() => metrics.upkeep(),
            _ = refresh.tick(), if tls.is_some() => {
                let tls = tls.clone();
                tokio::task::spawn_blocking(move || tls.iter().for_each(Tls::refresh));
            }
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

type Watcher = hyper_util::server::graceful::Watcher;

/// What every connection comes through.
#[derive(Clone)]
struct Door {
    builder: auto::Builder<TokioExecutor>,
    router: Router,
    tls: Option<Tls>,
    stopping: CancellationToken,
}

impl Door {
    /// Answers a connection until its end.
    async fn welcome(self, stream: TcpStream, address: SocketAddr, watcher: Watcher) {
        // Small answers must not wait for each other's acknowledgement.
        let _ = stream.set_nodelay(true);
        let stopping = self.stopping.clone();
        let Some(tls) = self.tls.clone() else {
            return self.attend(stream, Peer(None), watcher).await;
        };
        let shaken = tokio::select! {
            shaken = shake_hands(&tls, stream, address) => shaken,
            () = stopping.cancelled() => None,
        };
        if let Some(stream) = shaken {
            let chain = stream.get_ref().1.peer_certificates().unwrap_or_default();
            let peer = Peer(ClientCertificate::new(chain, tls).map(Arc::new));
            self.attend(stream, peer, watcher).await;
        }
    }

    async fn attend(self, stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, peer: Peer, watcher: Watcher) {
        let mut stream = BufReader::new(stream);
        // The protocol is told by the first bytes, and no header time-out runs before it is known.
        let begun = tokio::select! {
            begun = timeout(HEADER_TIMEOUT, stream.fill_buf()) => matches!(begun, Ok(Ok(bytes)) if !bytes.is_empty()),
            () = self.stopping.cancelled() => false,
        };
        if !begun {
            return;
        }
        let service = TowerToHyperService::new(Extension(peer).layer(self.router));
        let serving = self.builder.serve_connection(TokioIo::new(stream), service).into_owned();
        if let Err(error) = watcher.watch(serving).await {
            tracing::debug!(error, "a connection ended abnormally");
        }
    }
}

/// The connection behind a handshake. A client whose certificate is refused is told why before it is left, and so is
/// the log.
async fn shake_hands(tls: &Tls, stream: TcpStream, address: SocketAddr) -> Option<TlsStream<TcpStream>> {
    let shaking = tls.acceptor().accept(stream).into_fallible();
    let (error, stream) = match timeout(HANDSHAKE_TIMEOUT, shaking).await {
        Ok(Ok(stream)) => return Some(stream),
        Ok(Err(refused)) => refused,
        Err(_) => {
            tracing::debug!(%address, "a client did not finish its handshake in time");
            return None;
        }
    };
    match tls::refused(&error) {
        (reason, true) => tracing::warn!(%address, reason, "a client certificate was refused"),
        (reason, false) => tracing::info!(%address, reason, "a handshake failed"),
    }
    let _ = timeout(FAREWELL, part(stream)).await;
    None
}

/// Ends a connection so that what was said last arrives: what the client still sends is read away, for otherwise the
/// system would cut the connection off.
async fn part(mut stream: TcpStream) -> io::Result<()> {
    stream.shutdown().await?;
    let mut rest = [0; 4096];
    while stream.read(&mut rest).await? > 0 {}
    Ok(())
}

async fn pause_after(error: &io::Error) {
    tracing::warn!(%error, "cannot accept a connection");
    tokio::time::sleep(ACCEPT_PAUSE).await;
}
