//! The service in this process: a store, and the router over it; no socket.

use std::{
    sync::{Arc, LazyLock},
    time::Duration,
};

use axum::{
    Router,
    body::{Body, Bytes},
    http::{HeaderMap, HeaderValue, Request, StatusCode, header::HOST},
    middleware::map_request,
};
use domain::{Actor, Scoreboard};
use http_body_util::BodyExt;
use pipeline::Model;
use proto::frame::InstallationKey;
use server::{Forecaster, Forecasting, Metrics, Scorer};
use store::{IssuedLife, Options, Store, StoreError};
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use super::clock::Clock;

/// One recorder for all services of the process.
static METRICS: LazyLock<Metrics> = LazyLock::new(|| Metrics::install().expect("the first recorder"));

/// The secret from which frame keys follow.
pub static FRAME_KEY: LazyLock<InstallationKey> = LazyLock::new(|| InstallationKey::new([3; 32]));

/// The bundle that ships, and another one of the same numbers that tells of another provenance.
static BUNDLES: LazyLock<[Bundle; 2]> = LazyLock::new(|| {
    let shipped = include_str!("../../../../models/default.json");
    let other = shipped.replacen("\"seed\":1,", "\"seed\":2,", 1);
    [Bundle::new(shipped.to_owned()), Bundle::new(other)]
});

/// Data of an aircraft is stale after so many days.
pub const STALE_AFTER_DAYS: u64 = 30;

/// A model bundle and its bytes.
pub struct Bundle {
    /// As published.
    pub body: String,
    /// As used.
    pub model: Model,
}

impl Bundle {
    fn new(body: String) -> Self {
        let model = Model::from_bytes(body.as_bytes()).expect("a bundle");
        Self { body, model }
    }

    /// All bundles of the simulation; the first one is active at first.
    pub fn all() -> &'static [Self; 2] {
        &BUNDLES
    }
}

/// Requests of this process name the machine, as every client does.
async fn call_locally(mut request: Request<Body>) -> Request<Body> {
    request.headers_mut().entry(HOST).or_insert(HeaderValue::from_static("localhost"));
    request
}

/// A service on a database.
pub struct Service {
    /// `None` only while it is away.
    running: Option<Running>,
}

struct Running {
    store: Store,
    router: Router,
}

/// An answer that has come to its end.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Its status.
    pub status: StatusCode,
    /// Its headers, and its trailers.
    pub headers: HeaderMap,
    /// Its body.
    pub body: Bytes,
}

impl Answer {
    /// Whether what was asked for was done.
    pub fn is_success(&self) -> bool {
        self.status.is_success() && self.headers.get("grpc-status").is_none_or(|status| status == "0")
    }
}

impl Service {
    /// Opens a database, and waits where another service has not left it yet.
    pub async fn open(url: &str, clock: &Clock) -> Self {
        let store = loop {
            let options = Options {
                clock: Some(clock.of_store()),
                read_connections: 2,
                write_connections: 1,
                ..Options::default()
            };
            match Store::open(url, options).await {
                Ok(store) => break store,
                Err(StoreError::Locked { .. }) => tokio::time::sleep(Duration::from_millis(1)).await,
                Err(error) => panic!("{url}: {error}"),
            }
        };
        let state = server::State {
            store: store.clone(),
            clock: clock.asked(),
            stale_after: Duration::from_secs(STALE_AFTER_DAYS * 86_400),
            enrol: true,
            hosts: Vec::new(),
            origins: Vec::new(),
            max_connections: server::MAX_CONNECTIONS,
            scorer: Arc::new(Unjudged),
            forecaster: Arc::new(Unforeseen),
            frame_key: Some(FRAME_KEY.clone()),
            metrics: METRICS.clone(),
        };
        let router = server::router(state, false, CancellationToken::new()).await.layer(map_request(call_locally));
        Self { running: Some(Running { store, router }) }
    }

    fn running(&self) -> &Running {
        self.running.as_ref().expect("it is back")
    }

    /// Its database.
    pub fn store(&self) -> &Store {
        &self.running().store
    }

    /// What it serves.
    pub fn router(&self) -> Router {
        self.running().router.clone()
    }

    /// Stops in order and comes back. Nobody else may hold on to its store.
    pub async fn restart(&mut self, url: &str, clock: &Clock) {
        self.running().store.close().await;
        *self = Self::open(url, clock).await;
    }

    /// Ends without a word, nothing closed, and comes back. Nobody else may hold on to its store.
    pub async fn die_and_come_back(&mut self, url: &str, clock: &Clock) {
        self.running = None;
        *self = Self::open(url, clock).await;
    }

    /// Registers all bundles and activates the first.
    pub async fn provide(&self, clock: &Clock) {
        for bundle in Bundle::all() {
            let summary = bundle.model.summary();
            let registered =
                self.store().register_bundle(&summary, bundle.body.as_bytes(), Actor::Cli.at(clock.now())).await;
            registered.expect("a good bundle");
        }
        self.activate(0, false, clock).await;
    }

    /// Lets the lives that begin from now on be judged by a bundle, or all lives.
    pub async fn activate(&self, bundle: usize, all_lives: bool, clock: &Clock) {
        let hash = Bundle::all()[bundle].model.summary().hash;
        self.store().activate_bundle(&hash, Actor::Cli.at(clock.now())).await.expect("a known bundle");
        if all_lives {
            self.store().judge_all_lives_by(&hash).await.expect("a known bundle");
        }
    }

    /// Answers one request to its end.
    pub async fn answer(&self, request: Request<Body>) -> Answer {
        let (parts, body) = self.router().oneshot(request).await.expect("a router never fails").into_parts();
        let collected = body.collect().await.expect("an answer in this process");
        let mut headers = parts.headers;
        headers.extend(collected.trailers().cloned().unwrap_or_default());
        // Each request has a name of its own, which says nothing.
        headers.remove("x-request-id");
        Answer { status: parts.status, headers, body: collected.to_bytes() }
    }

    /// Begins to answer a request whose client is gone after so many turns of the other tasks.
    pub async fn hang_up(&self, request: Request<Body>, turns: usize) {
        let patience = async {
            for _ in 0..turns {
                tokio::task::yield_now().await;
            }
        };
        tokio::select! {
            biased;
            _ = self.router().oneshot(request) => {}
            () = patience => {}
        }
        self.settle().await;
    }

    /// Returns once all that was queued before is written.
    async fn settle(&self) {
        let nobody = store::Lease {
            component: domain::Component {
                operator: "nobody".parse().expect("a name"),
                part_number: "none".parse().expect("a name"),
                serial_number: "none".parse().expect("a name"),
            },
            input_revision: 0,
            fence: 0,
            attempts: 0,
        };
        self.store().abandon(&nobody, Duration::ZERO).await.expect("a write without effect");
    }

    /// Stops in order.
    pub async fn stop(self) {
        self.store().close().await;
    }
}

/// Forecasts nothing: what is only asked about has tests of its own.
struct Unforeseen;

impl Forecaster for Unforeseen {
    fn what_if(&self, _: domain::Component, _: domain::Ahead) -> Forecasting {
        Box::pin(async { Ok(None) })
    }
}

/// Judges nothing: scoreboards have tests of their own.
struct Unjudged;

impl Scorer for Unjudged {
    fn score(&self, lives: &[IssuedLife]) -> Scoreboard {
        let coverage = domain::scoreboard::Coverage { level_80: None, level_95: None };
        let horizons = domain::scoreboard::Horizons {
            alpha: 0.25,
            beta: 0.5,
            met: None,
            median_fh: None,
            sustained_median_fh: None,
        };
        Scoreboard {
            runs: lives.len(),
            predictions: lives.iter().map(|life| life.prognoses.len()).sum(),
            crps_fh: None,
            coverage,
            coverage_below_1000_fh: coverage,
            pit: None,
            undecided: None,
            by_rul: Vec::new(),
            at_rul: Vec::new(),
            alpha_lambda: Vec::new(),
            prognostic_horizon: horizons,
            life_horizon: domain::scoreboard::LifeHorizons {
                share_of_life: 0.1,
                median_fh: None,
                sustained_median_fh: None,
            },
            cumulative_relative_accuracy: None,
            cumulative_event_accuracy: None,
        }
    }
}
