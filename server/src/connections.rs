//! The connections of the service and the requests on them: so many and no more, and none that stands still for ever.
//!
//! Where all places are taken, a new connection takes the place of the one on which nothing has come to an end for the
//! longest time: no request, no line, no message. One that waits for the service keeps its place; where all do, a new
//! one is left at once. A client that does not read what it has asked for is left after a while: what waits for it
//! would be held for ever.

use std::{
    collections::HashMap,
    io,
    pin::Pin,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
    task::{Context, Poll},
    time::{Duration, Instant},
};

use axum::body::{Bytes, HttpBody};
use hyper::body::{Frame, Incoming, SizeHint};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_util::sync::CancellationToken;

use crate::{
    intake::{Budget, Room},
    refusal::Refusal,
};

/// A client that takes nothing of what is ready for it is left after that.
const STALLED: Duration = Duration::from_secs(30);
/// Requests under way per place for a connection, on all connections together.
const REQUESTS_PER_PLACE: usize = 4;
/// So many requests of one connection are let in even where half of all that may be under way are.
const FAIR: usize = 4;

/// All connections of a listener. Clones share them.
#[derive(Clone)]
pub struct Connections(Arc<Shared>);

struct Shared {
    places: usize,
    open: Mutex<HashMap<u64, Arc<Connection>>>,
    numbers: AtomicU64,
    requests: AtomicUsize,
    answers: Budget,
    /// Whether the log knows that there is no place.
    told: AtomicBool,
}

/// One connection.
struct Connection {
    end: CancellationToken,
    state: Mutex<State>,
}

struct State {
    requests: usize,
    /// Requests of which not all has come.
    unfinished: usize,
    /// When something was asked for, or came to its end.
    progressed_at: Instant,
    /// Since when the system has taken nothing of what was written.
    blocked_since: Option<Instant>,
    /// Since when no more was taken of answers of which something was handed over, by request.
    handed_over: HashMap<u64, Instant>,
}

impl State {
    fn new() -> Self {
        let now = Instant::now();
        Self { requests: 0, unfinished: 0, progressed_at: now, blocked_since: None, handed_over: HashMap::new() }
    }
}

impl Connection {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().expect("no holder panics")
    }

    fn leave(&self, reason: &'static str) {
        metrics::counter!(metric::CONNECTIONS_LEFT.name, "reason" => reason).increment(1);
        self.end.cancel();
    }
}

impl Connections {
    /// Places for so many connections.
    pub fn new(places: usize) -> Self {
        Self(Arc::new(Shared {
            places,
            open: Mutex::default(),
            numbers: AtomicU64::new(0),
            requests: AtomicUsize::new(0),
            answers: Budget::default(),
            told: AtomicBool::new(false),
        }))
    }

    /// A place for a new connection, if there is one.
    pub fn enter(&self) -> Option<Place> {
        let mut open = self.0.open.lock().expect("no holder panics");
        if open.len() >= self.0.places {
            self.tell();
            let idle = open.iter().filter_map(|(number, connection)| {
                let state = connection.state();
                (state.requests == state.unfinished).then_some((state.progressed_at, *number))
            });
            let Some((_, number)) = idle.min() else {
                metrics::counter!(metric::CONNECTIONS_LEFT.name, "reason" => "full").increment(1);
                return None;
            };
            open.remove(&number).iter().for_each(|connection| connection.leave("idle"));
        }
        let number = self.0.numbers.fetch_add(1, Ordering::Relaxed);
        let connection = Arc::new(Connection { end: CancellationToken::new(), state: Mutex::new(State::new()) });
        open.insert(number, connection.clone());
        metrics::gauge!(metric::CONNECTIONS.name).increment(1.0);
        Some(Place { all: self.clone(), number, connection })
    }

    /// Says once that there is no place, until there was one again.
    fn tell(&self) {
        if !self.0.told.swap(true, Ordering::Relaxed) {
            let places = self.0.places;
            tracing::warn!(places, "all places for connections are taken: idle connections make room for new ones");
        }
    }

    /// Leaves the clients that have taken nothing of what is ready for them for too long.
    pub fn leave_stalled(&self) {
        let open = self.0.open.lock().expect("no holder panics");
        if open.len() < self.0.places {
            self.0.told.store(false, Ordering::Relaxed);
        }
        for connection in open.values() {
            let state = connection.state();
            let mut since = state.handed_over.values().chain(&state.blocked_since);
            if since.any(|since| since.elapsed() > STALLED) {
                connection.leave("stalled");
            }
        }
    }
}

/// The place of a connection, as long as it is not dropped.
#[derive(Clone)]
pub struct Place {
    all: Connections,
    number: u64,
    connection: Arc<Connection>,
}

/// Gives a place back when it is dropped.
pub struct Taken(pub Place);

impl Drop for Taken {
    fn drop(&mut self) {
        self.0.all.0.open.lock().expect("no holder panics").remove(&self.0.number);
        metrics::gauge!(metric::CONNECTIONS.name).decrement(1.0);
    }
}

impl Place {
    /// Completes when the connection is to be left.
    pub async fn left(&self) {
        self.connection.end.cancelled().await;
    }

    /// A stream of this connection that is seen to stand still.
    pub fn watch<S>(&self, stream: S) -> Watched<S> {
        Watched { stream, connection: self.connection.clone() }
    }

    /// The body of a request of this connection that is seen to come to its end.
    pub fn arriving(&self, body: Incoming) -> Arriving {
        let unfinished = (!body.is_end_stream()).then(|| Unfinished::new(self.connection.clone()));
        Arriving { body, unfinished }
    }

    /// A request, let in unless too many are under way. One that `must` be answered is always let in.
    pub fn request(&self, must: bool) -> Ticket {
        let (limit, all) = (REQUESTS_PER_PLACE * self.all.0.places, &self.all.0.requests);
        let before = all.fetch_add(1, Ordering::Relaxed);
        let mut state = self.connection.state();
        let admitted = must || (before < limit && (2 * before < limit || state.requests < FAIR));
        state.requests += 1;
        state.progressed_at = Instant::now();
        drop(state);
        if !admitted {
            metrics::counter!(metric::REQUESTS_REFUSED.name).increment(1);
        }
        let number = self.all.0.numbers.fetch_add(1, Ordering::Relaxed);
        Ticket { place: self.clone(), number, room: self.all.0.answers.room(), admitted }
    }
}

/// A request under way, until its answer was taken.
pub struct Ticket {
    place: Place,
    number: u64,
    room: Room,
    /// Whether there was room for it.
    pub admitted: bool,
}

impl Ticket {
    /// Takes room for an answer that waits to be taken.
    pub fn hold(&mut self, bytes: usize) -> Result<(), Refusal> {
        self.room.hold(bytes)
    }

    /// Says that the client has to take something of the answer.
    pub fn handed_over(&self) {
        let (mut state, now) = (self.place.connection.state(), Instant::now());
        state.progressed_at = now;
        state.handed_over.insert(self.number, now);
    }

    /// Says that the client has taken what was handed over.
    pub fn taken(&self) {
        self.place.connection.state().handed_over.remove(&self.number);
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        self.place.all.0.requests.fetch_sub(1, Ordering::Relaxed);
        let mut state = self.place.connection.state();
        state.requests -= 1;
        state.progressed_at = Instant::now();
        state.handed_over.remove(&self.number);
    }
}

/// A request of which not all has come.
struct Unfinished(Arc<Connection>);

impl Unfinished {
    fn new(connection: Arc<Connection>) -> Self {
        connection.state().unfinished += 1;
        Self(connection)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.unfinished -= 1;
        state.progressed_at = Instant::now();
    }
}

/// The body of a request on its way in.
pub struct Arriving {
    body: Incoming,
    unfinished: Option<Unfinished>,
}

impl HttpBody for Arriving {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        if self.body.is_end_stream() || matches!(polled, Poll::Ready(None | Some(Err(_)))) {
            self.unfinished = None;
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A stream of which it is known since when it takes nothing.
pub struct Watched<S> {
    stream: S,
    connection: Arc<Connection>,
}

impl<S> Watched<S> {
    fn note<T>(&self, polled: Poll<T>) -> Poll<T> {
        let since = &mut self.connection.state().blocked_since;
        match polled {
            Poll::Pending => drop(since.get_or_insert_with(Instant::now)),
            Poll::Ready(_) => *since = None,
        }
        polled
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Watched<S> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, to: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, to)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Watched<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.note(polled)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write_vectored(cx, slices);
        self.note(polled)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.stream).poll_flush(cx);
        self.note(polled)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.stream).poll_shutdown(cx);
        self.note(polled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_left(place: &Taken) -> bool {
        place.0.connection.end.is_cancelled()
    }

    #[test]
    fn who_has_ended_nothing_longest_makes_room() {
        let all = Connections::new(3);
        let [idle, dripping, working] = [(); 3].map(|()| Taken(all.enter().unwrap()));
        let _half = (dripping.0.request(false), Unfinished::new(dripping.0.connection.clone()));
        let _whole = working.0.request(false);
        idle.0.request(false);
        let first = Taken(all.enter().unwrap());
        assert!(is_left(&dripping) && !is_left(&idle) && !is_left(&working), "half a request ends nothing");
        let second = Taken(all.enter().unwrap());
        assert!(is_left(&idle) && !is_left(&first) && !is_left(&working));
        let (_one, _another) = (first.0.request(false), second.0.request(false));
        assert!(all.enter().is_none(), "everybody waits for the service");
        drop(working);
        assert!(all.enter().is_some());
    }

    #[test]
    fn one_connection_does_not_take_all_that_may_be_under_way() {
        let all = Connections::new(4);
        let (greedy, modest) = (all.enter().unwrap(), all.enter().unwrap());
        let held: Vec<_> = (0..8).map(|_| greedy.request(false)).collect();
        assert!(held.iter().all(|ticket| ticket.admitted));
        assert!(!greedy.request(false).admitted && greedy.request(true).admitted && modest.request(false).admitted);
        drop(held);
        assert!(greedy.request(false).admitted);
    }

    #[test]
    fn a_client_that_takes_nothing_for_long_is_left() {
        let all = Connections::new(3);
        let [deaf, stuck, reading] = [(); 3].map(|()| Taken(all.enter().unwrap()));
        let (unread, read) = (deaf.0.request(false), reading.0.request(false));
        unread.handed_over();
        read.handed_over();
        read.taken();
        let long_ago = Instant::now().checked_sub(2 * STALLED).unwrap();
        for place in [&deaf, &reading] {
            place.0.connection.state().handed_over.values_mut().for_each(|since| *since = long_ago);
        }
        stuck.0.connection.state().blocked_since = Some(long_ago);
        all.leave_stalled();
        assert!(is_left(&deaf) && is_left(&stuck) && !is_left(&reading));
    }
}
