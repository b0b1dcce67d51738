//! Serving: from a listener to answered connections, and an end within a bounded time.

use std::{convert::Infallible, io, net::SocketAddr, sync::Arc, time::Duration};

use axum::{
    Router,
    body::{Body, HttpBody},
    extract::Request,
    http::{StatusCode, header::CONTENT_LENGTH},
    response::Response,
};
use hyper::{body::Incoming, service::service_fn};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto, graceful::GracefulShutdown},
};
use tokio::{
    io::{AsyncBufReadExt, AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, BufReader},
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_rustls::server::TlsStream;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use crate::{
    Metrics, Probed, app,
    auth::{ClientCertificate, Peer, is_probe},
    connections::{Connections, Place, Taken},
    outgoing::Outgoing,
    refusal::{Refusal, is_grpc},
    rest,
    state::State,
    tls::{self, Tls},
};

/// A client that has not finished its header by then is cut off; it bounds idle connections too.
const HEADER_TIMEOUT: Duration = Duration::from_secs(20);
/// A client that has not finished its handshake by then is cut off.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// The time that a client whose handshake was refused may take to read why.
const FAREWELL: Duration = Duration::from_secs(1);
/// A silent HTTP/2 peer is asked for a sign of life.
const PING_INTERVAL: Duration = Duration::from_secs(30);
/// The time that answers under way may take after the stop.
const DRAIN: Duration = Duration::from_secs(5);
/// What is held of a connection of HTTP/1 on its way in, and on its way out; a header is no longer.
const BUFFER_BYTES: usize = 64 << 10;
/// What a client may send of one request of HTTP/2 before it is read, and of all requests of its connection: one that
/// is not read must not keep the others waiting.
const WINDOW_BYTES: (u32, u32) = (64 << 10, 192 << 10);
/// Requests of one connection of HTTP/2 at once.
const MAX_STREAMS: u32 = 100;
/// Places for connections where nothing but probes is answered.
const MAX_PROBING: usize = 64;
/// The interval at which what was recorded is sorted, whether or not anybody asks for it, and clients that read nothing
/// are left.
const UPKEEP: Duration = Duration::from_secs(5);
/// The interval at which it is seen whether the files of TLS have changed.
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
    let (metrics, places) = (state.metrics.clone(), state.max_connections);
    let closed = tls.as_ref().is_some_and(Tls::knows_clients);
    let router = app::router(state, closed, stopping.clone()).await;
    let connections = Connections::new(places);
    answer(Listening { listener, tls, router, connections, metrics }, stopping, shutdown).await;
}

/// Serves the probes of a process and nothing else, in the same manner.
pub async fn serve_probes(listener: TcpListener, probed: Probed, shutdown: impl Future<Output = ()>) {
    let metrics = probed.metrics.clone();
    let (router, connections) = (rest::probes(probed), Connections::new(MAX_PROBING));
    let listening = Listening { listener, tls: None, router, connections, metrics };
    answer(listening, CancellationToken::new(), shutdown).await;
}

/// The parts of a service that listens.
struct Listening {
    listener: TcpListener,
    tls: Option<Tls>,
    router: Router,
    connections: Connections,
    metrics: Metrics,
}

async fn answer(listening: Listening, stopping: CancellationToken, shutdown: impl Future<Output = ()>) {
    let Listening { listener, tls, router, connections: places, metrics } = listening;
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
                Ok((stream, peer)) => if let Some(place) = places.enter() {
                    connections.spawn(door.clone().welcome(stream, peer, place, graceful.watcher()));
                },
                Err(error) => pause_after(&error).await,
            },
            _ = upkeep.tick() => {
                metrics.upkeep();
                places.leave_stalled();
            }
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
    builder.http1().timer(TokioTimer::new()).header_read_timeout(HEADER_TIMEOUT).max_buf_size(BUFFER_BYTES);
    let mut http2 = builder.http2();
    http2.timer(TokioTimer::new()).keep_alive_interval(PING_INTERVAL).keep_alive_timeout(HEADER_TIMEOUT);
    http2.initial_stream_window_size(WINDOW_BYTES.0).initial_connection_window_size(WINDOW_BYTES.1);
    http2.max_concurrent_streams(MAX_STREAMS).max_send_buf_size(BUFFER_BYTES);
    builder
}

type Watcher = hyper_util::server::graceful::Watcher;

/// The way that every connection takes.
#[derive(Clone)]
struct Door {
    builder: auto::Builder<TokioExecutor>,
    router: Router,
    tls: Option<Tls>,
    stopping: CancellationToken,
}

impl Door {
    /// Answers a connection until its end, or until it is left.
    async fn welcome(self, stream: TcpStream, address: SocketAddr, place: Place, watcher: Watcher) {
        let taken = Taken(place.clone());
        tokio::select! {
            () = self.talk(stream, address, place, watcher) => {}
            () = taken.0.left() => {}
        }
    }

    async fn talk(self, stream: TcpStream, address: SocketAddr, place: Place, watcher: Watcher) {
        // Small answers must not wait for each other's acknowledgement.
        let _ = stream.set_nodelay(true);
        let stopping = self.stopping.clone();
        let Some(tls) = self.tls.clone() else {
            return self.attend(place.watch(stream), Peer(None), place, watcher).await;
        };
        let shaken = tokio::select! {
            shaken = shake_hands(&tls, stream, address) => shaken,
            () = stopping.cancelled() => None,
        };
        if let Some(stream) = shaken {
            let chain = stream.get_ref().1.peer_certificates().unwrap_or_default();
            let peer = Peer(ClientCertificate::new(chain, tls).map(Arc::new));
            self.attend(place.watch(stream), peer, place, watcher).await;
        }
    }

    async fn attend<S>(self, stream: S, peer: Peer, place: Place, watcher: Watcher)
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let mut stream = BufReader::new(stream);
        // The protocol is told by the first bytes, and no header time-out runs before it is known.
        let begun = tokio::select! {
            begun = timeout(HEADER_TIMEOUT, stream.fill_buf()) => matches!(begun, Ok(Ok(bytes)) if !bytes.is_empty()),
            () = self.stopping.cancelled() => false,
        };
        if !begun {
            return;
        }
        let router = self.router;
        let service = service_fn(move |request| respond(router.clone(), request, peer.clone(), place.clone()));
        let serving = self.builder.serve_connection(TokioIo::new(stream), service).into_owned();
        if let Err(error) = watcher.watch(serving).await {
            tracing::debug!(error, "a connection ended abnormally");
        }
    }
}

/// The answer to a request, if there is room for it; whoever keeps the service alive is always answered.
async fn respond(
    router: Router,
    request: Request<Incoming>,
    peer: Peer,
    place: Place,
) -> Result<Response<Outgoing>, Infallible> {
    let mut request = request.map(|body| Body::new(place.arriving(body)));
    request.extensions_mut().insert(peer);
    let grpc = is_grpc(request.headers());
    let mut ticket = place.request(is_probe(request.uri().path()));
    let mut response = match ticket.admitted {
        true => router.oneshot(request).await?,
        false => Refusal::Unavailable("too many requests are under way".to_owned()).answer(grpc),
    };
    if response.status() == StatusCode::NOT_MODIFIED {
        // It would be taken for the length of the answer that the caller has.
        response.headers_mut().remove(CONTENT_LENGTH);
    }
    let bytes = response.body().size_hint().exact().unwrap_or_default();
    if let Err(refusal) = ticket.hold(bytes as usize) {
        response = refusal.answer(grpc);
    }
    Ok(response.map(|body| Outgoing::new(body, ticket)))
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
