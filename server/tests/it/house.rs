//! A server on a free port with a database in a temporary folder, and what a worker would write.

use std::{
    sync::{
        Arc, LazyLock,
        atomic::{AtomicI64, AtomicU64, Ordering},
    },
    time::Duration,
};

use domain::{
    Actor, Ahead, AsOf, BundleSummary, Component, ContentHash, Coordinate, Diagnosis, Disagreement, DisagreementKind,
    Doubt, DoubtKind, Ensemble, Estimate, Explanation, FaultModel, FaultTrend, FaultVector, HingeLoad, LoadAgreement,
    LoadSource, MapFit, MapSamples, Mask, NUMERICS_VERSION, Outcome, PastCoverage, Prognosis, Propagation,
    RulDistribution, Scope, SetAside, Timestamp, Token, Upload,
    ahead::{LoadAhead, TemperatureAhead},
    explanation::{Driver, Growth, GrowthChange, Shift, Surprise},
    load_agreement::LoadsTold,
    prognosis::{Forecast, InsufficientHistory},
    scoreboard::{AtRul, Coverage, Horizons, LifeHorizons, RulBin, Scoreboard},
    state::State as Block,
};
use proto::{frame::InstallationKey, grpc::from_upload, json::UploadBody, v1};
use reqwest::{Client, Response, StatusCode};
use serde_json::{Value, json};
use server::{Forecaster, Forecasting, Metrics, Scorer, Tls, TlsFiles};
use store::{Completion, IssuedLife, LifeInputs, LifeResults, Options, Revocation, Store, TokenRecord};
use tempfile::TempDir;
use tokio::{
    net::{TcpListener, TcpStream},
    sync::oneshot,
    task::JoinHandle,
};
use tonic::transport::{Channel, Endpoint};

pub const START: &str = "2026-03-01T12:00:00Z";
pub const PROBLEM: &str = "application/problem+json";

/// One recorder for all houses of the process.
static METRICS: LazyLock<Metrics> = LazyLock::new(|| Metrics::install().unwrap());

pub struct House {
    pub url: String,
    pub store: Store,
    pub client: Client,
    pub mask_id: String,
    pub model: String,
    pub tls: Option<Tls>,
    now: Arc<AtomicI64>,
    stop: Option<oneshot::Sender<()>>,
    serving: JoinHandle<()>,
    _folder: TempDir,
}

/// A temperature of which it takes half a second to think, K above that of now.
pub const SLOW_K: f64 = 77.0;

/// Forecasts that remaining life goes with the inverse of the load in the first stretch ahead; the numerics have tests of
/// their own.
struct Inverse(Store);

impl Forecaster for Inverse {
    fn what_if(&self, component: Component, ahead: Ahead) -> Forecasting {
        let store = self.0.clone();
        Box::pin(async move {
            let first = ahead.stretches[0];
            if first.temperature == Some(TemperatureAhead::Above(SLOW_K)) {
                tokio::time::sleep(Duration::from_millis(500)).await;
            }
            let fleet = store.installed_fleet(&component.operator, None, 100).await?;
            let mut installed = fleet.into_iter().flat_map(|tail| tail.installed);
            let Some(mut prognosis) =
                installed.find(|one| one.serial_number == component.serial_number).and_then(|one| one.prognosis)
            else {
                return Ok(None);
            };
            let forecast = prognosis.forecast.as_mut().unwrap();
            let times = match (first.load, &forecast.pace) {
                (Some(LoadAhead::Times(times)), _) => times,
                (Some(LoadAhead::Ratio(ratio)), Some(pace)) => ratio / pace.load,
                _ => 1.0,
            };
            let ends: Vec<_> = (0..100).map(|i| (i < 80).then_some(40.0 * f64::from(i + 1) / times)).collect();
            forecast.rul = RulDistribution::from_draws(&ends, 10_000.0);
            Ok(Some(prognosis))
        })
    }
}

/// Counts what it is given to judge; the numerics have tests of their own.
struct Counter;

impl Scorer for Counter {
    fn score(&self, lives: &[IssuedLife]) -> Scoreboard {
        let prognoses = || lives.iter().flat_map(|life| &life.prognoses);
        let coverage = Coverage { level_80: Some(0.75), level_95: Some(0.9) };
        let at_rul = |rul_fh| AtRul { rul_fh, runs: lives.len(), relative_error: Some(-0.123) };
        Scoreboard {
            runs: lives.len(),
            predictions: prognoses().count(),
            crps_fh: Some(prognoses().map(|prognosis| prognosis.as_of.flight_hours).sum()),
            coverage,
            coverage_below_1000_fh: Coverage { level_80: None, level_95: None },
            pit: None,
            undecided: Some(0.25),
            by_rul: vec![RulBin { from_fh: 0.0, to_fh: Some(500.0), runs: 1, predictions: 2, crps_fh: None, coverage }],
            at_rul: vec![at_rul(1500.0), at_rul(500.0)],
            alpha_lambda: Vec::new(),
            prognostic_horizon: Horizons {
                alpha: 0.25,
                beta: 0.5,
                met: None,
                median_fh: None,
                sustained_median_fh: None,
            },
            life_horizon: LifeHorizons { share_of_life: 0.1, median_fh: None, sustained_median_fh: None },
            cumulative_relative_accuracy: None,
            cumulative_event_accuracy: None,
        }
    }
}

/// A client that trusts nobody, for services without TLS.
pub fn client() -> Client {
    // Whoever is first installs it.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Client::builder().tls_certs_only([]).build().unwrap()
}

pub fn time(text: &str) -> Timestamp {
    text.parse().unwrap()
}

pub fn mask() -> Mask {
    Mask::new(Coordinate::ElectricalAngleRad, 360, vec![5, 100, 200, 300]).unwrap()
}

impl House {
    pub async fn open() -> Self {
        Self::with_enrolment(true).await
    }

    pub async fn with_enrolment(enrol: bool) -> Self {
        Self::with(enrol, Options::default()).await
    }

    pub async fn with(enrol: bool, options: Options) -> Self {
        Self::behind(enrol, options, None).await
    }

    /// A house behind TLS.
    pub async fn with_tls(files: TlsFiles) -> Self {
        Self::behind(true, Options::default(), Some(files)).await
    }

    /// A house that is called by names of its own.
    pub async fn called(hosts: &[&str]) -> Self {
        Self::furnish(true, Options::default(), None, (hosts, &[]), server::MAX_CONNECTIONS).await
    }

    /// A house that pages of other origins may call.
    pub async fn called_from(origins: &[&str]) -> Self {
        Self::furnish(true, Options::default(), None, (&[], origins), server::MAX_CONNECTIONS).await
    }

    /// A house with so many places for connections.
    pub async fn with_places(places: usize) -> Self {
        Self::furnish(true, Options::default(), None, (&[], &[]), places).await
    }

    async fn behind(enrol: bool, options: Options, files: Option<TlsFiles>) -> Self {
        Self::furnish(enrol, options, files, (&[], &[]), server::MAX_CONNECTIONS).await
    }

    async fn furnish(
        enrol: bool,
        options: Options,
        files: Option<TlsFiles>,
        (hosts, origins): (&[&str], &[&str]),
        max_connections: usize,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let url = format!("sqlite:{}", folder.path().join("actuary.db").display());
        let store = Store::open(&url, options).await.unwrap();
        let body = b"a bundle";
        let summary = BundleSummary {
            hash: ContentHash::of(body),
            prior: ContentHash::of(b"a prior"),
            faults: FaultModel::electrical(),
            masks: vec![mask()],
            k_nom: 0.0752,
            min_samples: 2,
            measure: None,
        };
        store.register_bundle(&summary, body, Actor::Cli.at(time(START))).await.unwrap();
        store.activate_bundle(&summary.hash, Actor::Cli.at(time(START))).await.unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let scheme = if files.is_some() { "https" } else { "http" };
        let url = format!("{scheme}://{}", listener.local_addr().unwrap());
        let now = Arc::new(AtomicI64::new(time(START).micros()));
        let hand = now.clone();
        let clock: server::Clock = Arc::new(move || Timestamp::from_micros(hand.load(Ordering::Relaxed)));
        let tls = files.map(|files| Tls::load(files, clock.clone()).unwrap());
        let state = server::State {
            store: store.clone(),
            clock,
            stale_after: Duration::from_secs(30 * 86_400),
            enrol,
            hosts: hosts.iter().map(|host| host.parse().unwrap()).collect(),
            origins: origins.iter().map(|origin| origin.parse().unwrap()).collect(),
            max_connections,
            scorer: Arc::new(Counter),
            forecaster: Arc::new(Inverse(store.clone())),
            frame_key: Some(InstallationKey::new([7; 32])),
            metrics: METRICS.clone(),
        };
        let (stop, stopped) = oneshot::channel();
        let stopped = async { stopped.await.unwrap_or_default() };
        let serving = match tls.clone() {
            None => tokio::spawn(server::serve(listener, state, stopped)),
            Some(tls) => tokio::spawn(server::serve_tls(listener, tls, state, stopped)),
        };
        Self {
            url,
            store,
            client: client(),
            mask_id: mask().id().to_string(),
            model: summary.hash.to_string(),
            tls,
            now,
            stop: Some(stop),
            serving,
            _folder: folder,
        }
    }

    /// Lets days pass.
    pub fn wait_days(&self, days: f64) {
        self.now.fetch_add((days * 8.64e10) as i64, Ordering::Relaxed);
    }

    /// Lets milliseconds pass.
    pub fn wait_ms(&self, ms: i64) {
        self.now.fetch_add(1000 * ms, Ordering::Relaxed);
    }

    /// A new token, good for a day.
    pub async fn token(&self, operator: &str, scope: Scope) -> Token {
        static ISSUED: AtomicU64 = AtomicU64::new(1);
        let random = ContentHash::of(&ISSUED.fetch_add(1, Ordering::Relaxed).to_le_bytes());
        let token = Token::issue(*random.bytes());
        let now = Timestamp::from_micros(self.now.load(Ordering::Relaxed));
        let record = TokenRecord {
            id: token.id,
            operator: operator.parse().unwrap(),
            scope,
            name: None,
            secret: token.secret.hash(),
            created_at: now,
            expires_at: Some(now.plus_hours(24.0)),
            revoked_at: None,
        };
        self.store.create_token(&record, Actor::Cli).await.unwrap();
        token
    }

    /// Revokes a token.
    pub async fn revoke(&self, operator: &str, token: &Token) {
        let act = Actor::Cli.at(Timestamp::from_micros(self.now.load(Ordering::Relaxed)));
        let revoked = self.store.revoke_token(&operator.parse().unwrap(), &token.id, act).await.unwrap();
        assert_eq!(revoked, Some(Revocation::Revoked));
    }

    /// Stops the server; returns when it has ended.
    pub async fn stop(mut self) {
        self.stop.take().unwrap().send(()).unwrap();
        self.serving.await.unwrap();
    }

    /// A connection on which nothing was said.
    pub async fn dial(&self) -> TcpStream {
        TcpStream::connect(self.url.split_once("://").unwrap().1).await.unwrap()
    }

    pub async fn channel(&self) -> Channel {
        Endpoint::new(self.url.clone()).unwrap().connect().await.unwrap()
    }

    pub async fn get(&self, path: &str) -> Response {
        self.client.get(format!("{}{path}", self.url)).send().await.unwrap()
    }

    /// The body of a GET that succeeds.
    pub async fn read(&self, path: &str) -> Value {
        let response = self.get(path).await;
        assert_eq!(response.status(), StatusCode::OK, "{path}");
        response.json().await.unwrap()
    }

    /// The problem document of a GET that is refused with `status`.
    pub async fn refused(&self, path: &str, status: u16) -> Value {
        problem(self.get(path).await, status).await
    }

    pub async fn post(&self, tail: &str, content_type: &str, body: impl Into<reqwest::Body>) -> Response {
        let post = self.client.post(format!("{}/v1/tails/{tail}/uploads", self.url));
        post.header("content-type", content_type).body(body).send().await.unwrap()
    }

    /// A POST without a body.
    pub async fn act(&self, path: &str) -> Response {
        self.client.post(format!("{}{path}", self.url)).send().await.unwrap()
    }

    /// A gRPC request that carries a good upload.
    pub fn request(&self, upload_id: &str, flight_hours: f64) -> v1::UploadRequest {
        let body: UploadBody = serde_json::from_value(self.body(upload_id, flight_hours)).unwrap();
        from_upload(body.into_upload("EC-MXA".parse().unwrap()).unwrap())
    }

    pub async fn upload(&self, tail: &str, body: &Value) -> Response {
        self.post(tail, "application/json", body.to_string()).await
    }

    /// A good upload at some flight hours.
    pub fn body(&self, upload_id: &str, flight_hours: f64) -> Value {
        let recorded_at = time("2026-02-01T00:00:00Z").plus_hours(3.0 * flight_hours).to_string();
        json!({
            "upload_id": upload_id, "position": "AIL-L", "part_number": "EMA-500", "serial_number": "SN 1",
            "flight_hours": flight_hours, "recorded_at": recorded_at, "mask_id": self.mask_id,
            "samples": [0.07, 0.075, null, 0.08], "load_ratio": [0.1, -0.1, null, 0.2], "sample_noise": 0.01,
        })
    }

    /// Does what a worker does with the component that waits, giving it `forecast`.
    pub async fn work(&self, forecast: Result<Forecast, InsufficientHistory>) {
        let lease = self.store.lease(Duration::from_secs(60)).await.unwrap().expect("something waits");
        let inputs = self.store.life_inputs(&lease).await.unwrap().remove(0);
        let results = results(&inputs, forecast, &[], time(START));
        assert_eq!(self.store.complete(&lease, vec![results]).await.unwrap(), Completion::Done);
    }

    /// Does what a worker does that cannot estimate some of the waiting uploads.
    pub async fn set_aside(&self, set_aside: &[SetAside]) {
        let lease = self.store.lease(Duration::from_secs(60)).await.unwrap().expect("something waits");
        let inputs = self.store.life_inputs(&lease).await.unwrap().remove(0);
        let missing = InsufficientHistory { missing: "one closed block".to_owned() };
        let results = results(&inputs, Err(missing), set_aside, time(START));
        assert_eq!(self.store.complete(&lease, vec![results]).await.unwrap(), Completion::Done);
    }
}

/// The problem document of a response that must have `status`.
pub async fn problem(response: Response, status: u16) -> Value {
    let url = response.url().to_string();
    assert_eq!(response.status().as_u16(), status, "{url}");
    assert_eq!(response.headers()["content-type"], PROBLEM, "{url}");
    let problem: Value = response.json().await.unwrap();
    assert_eq!(problem["status"], status);
    assert!(problem["title"].as_str().is_some_and(|title| !title.is_empty()));
    assert!(problem["detail"].as_str().is_some_and(|detail| !detail.is_empty()));
    problem
}

/// A transmission that has lost efficiency since 40 fh.
pub fn agreement() -> LoadAgreement {
    let lost = Disagreement {
        kind: DisagreementKind::Efficiency,
        since_fh: 40.0,
        since: time(START),
        size: -0.15,
        sigma: 0.01,
        grating: None,
        detail: "since 40 fh the motor works 17.6 +- 1.4 % more for every moment of its surface".to_owned(),
    };
    let told = |flight_hours| LoadsTold { flight_hours, wing: 1.0, motor: 1.125 };
    LoadAgreement {
        flights: 6,
        efficiency: 0.85,
        efficiency_sigma: 0.01,
        friction: 0.02,
        friction_sigma: 0.01,
        disagreements: vec![lost],
        course: vec![told(0.0), told(200.0)],
    }
}

fn results(
    inputs: &LifeInputs,
    forecast: Result<Forecast, InsufficientHistory>,
    set_aside: &[SetAside],
    now: Timestamp,
) -> LifeResults {
    let waiting = inputs.unestimated.iter().map(|one| &one.upload);
    let estimable = waiting.filter(|upload| set_aside.iter().all(|aside| aside.upload_id != upload.upload_id));
    let estimates: Vec<Estimate> = estimable.map(|upload| estimate(upload, inputs)).collect();
    let states = forecast.as_ref().map(|forecast| blocks(&estimates, forecast)).unwrap_or_default();
    let forecast_agreement = forecast.is_ok().then(agreement);
    let prognosis = estimates.last().map(|newest| Prognosis {
        as_of: AsOf {
            flight_hours: newest.flight_hours,
            recorded_at: newest.recorded_at,
            upload_id: newest.upload_id.clone(),
        },
        forecast,
        load: estimates.iter().rev().find_map(|estimate| estimate.load.clone()),
        load_agreement: forecast_agreement,
        mask_id: newest.mask_id,
        model: inputs.generation.model,
        prior: inputs.generation.prior,
        generation: inputs.generation.number,
        numerics_version: NUMERICS_VERSION,
        inputs_digest: ContentHash::of(b"inputs"),
    });
    LifeResults {
        overhaul_index: inputs.life.overhaul_index,
        generation: inputs.generation.number,
        estimates,
        set_aside: set_aside.to_vec(),
        excluded: Vec::new(),
        states_from: Some(0),
        states,
        checkpoints: Vec::new(),
        prognosis,
        now,
    }
}

fn estimate(upload: &Upload, inputs: &LifeInputs) -> Estimate {
    let outcome = match upload.reading.samples().map(MapSamples::valid) {
        Some(valid_samples @ 0..2) => Outcome::Undiagnosable { valid_samples, needed: 2 },
        samples => Outcome::Diagnosed(Diagnosis {
            fault_vector: FaultVector(vec![0.01, 0.02, 0.03, 0.52, 0.49]),
            sigma: vec![0.001; 5],
            fit: samples.map(|_| MapFit {
                plausible: true,
                chi_square: 1.5,
                degrees_of_freedom: 2,
                load_invariant: true,
            }),
        }),
    };
    Estimate {
        upload_id: upload.upload_id.clone(),
        flight_hours: upload.flight_hours,
        recorded_at: upload.recorded_at,
        mask_id: upload.reading.mask_id(),
        model: inputs.generation.model,
        numerics_version: NUMERICS_VERSION,
        measurement: None,
        outcome,
        load: upload.air_data.as_ref().map(|_| load()),
        temperature: None,
        load_ratio: None,
        on_ground: false,
    }
}

/// What a worker would tell of an upload with strain and air data.
fn load() -> HingeLoad {
    HingeLoad {
        hinge_moment_nm: -412.5,
        sigma_nm: 3.25,
        ratio: 0.55,
        source: LoadSource::StrainAndAirData,
        excluded_sensors: vec![7, 2],
        sensor_configuration: ContentHash::of(b"a sensor configuration"),
    }
}

/// One block per estimate.
fn blocks(estimates: &[Estimate], forecast: &Forecast) -> Vec<Block> {
    let block = |estimate: &Estimate| Block {
        block: (estimate.flight_hours / 20.0) as u64,
        from_fh: estimate.flight_hours,
        as_of: AsOf {
            flight_hours: estimate.flight_hours,
            recorded_at: estimate.recorded_at,
            upload_id: estimate.upload_id.clone(),
        },
        observations: 1,
        faults: forecast.faults.clone(),
        propagation: forecast.propagation.clone(),
        rul_quantiles_fh: forecast.rul.quantiles_fh(),
        rul_mean_fh: forecast.rul.mean_fh(),
        censored_fraction: forecast.rul.censored_fraction(),
        horizon_fh: forecast.rul.horizon_fh(),
        growth: forecast.explanation.growth.clone(),
        shift: forecast.explanation.shift.clone(),
        doubts: forecast.doubts.clone(),
        digest: ContentHash::of(b"block"),
    };
    estimates.iter().map(block).collect()
}

/// Three members, as fifteen finished lives taught.
fn ensemble() -> Ensemble {
    let weights = [("climatology", 0.125), ("growth", 0.625), ("similarity", 0.25)];
    Ensemble {
        weights: weights.map(|(name, weight)| (name.to_owned(), weight)).into(),
        coverage_of_past_forecasts: Some(PastCoverage { lives: 15, forecasts: 210, level_80: 0.78, level_95: 0.96 }),
    }
}

/// A forecast whose draws end every 40 flight hours from 40 to 4,000, or never.
pub fn forecast(ending: usize) -> Forecast {
    let ends: Vec<Option<f64>> = (0..100).map(|i| (i < ending).then_some(40.0 * (i + 1) as f64)).collect();
    let names = FaultModel::electrical().names;
    let trend = |name: String| FaultTrend { name, value: 0.1, sigma: 0.01, trend_per_1000_fh: 0.02 };
    Forecast {
        faults: names.into_iter().map(trend).collect(),
        dominant_fault: "k2".to_owned(),
        propagation: Propagation {
            state_matrix: vec![vec![1e-4; 5]; 5],
            state_matrix_sigma: vec![vec![1e-5; 5]; 5],
            control_matrix: vec![vec![1e-6; 3]; 5],
            control_matrix_sigma: vec![vec![0.0; 3]; 5],
            estimator: "rbg".to_owned(),
            observations: 12,
        },
        rul: RulDistribution::from_draws(&ends, 10_000.0),
        p10_error_fh: Some(12.5),
        median_error_fh: None,
        probability_failed: 0.0,
        seed: u64::MAX,
        pace: None,
        ensemble: Some(ensemble()),
        explanation: Explanation::default(),
        doubts: Vec::new(),
        gap: None,
    }
}

/// The reasons of a forecast whose growth changed, and that moved since.
pub fn explanation() -> Explanation {
    let surprise = |fault: &str, z: f64| Surprise { fault: fault.to_owned(), expected: 0.1, seen: 0.1 + 0.01 * z, z };
    let driver = |faults: &[&str], share: f64| Driver { faults: faults.iter().map(|&f| f.to_owned()).collect(), share };
    Explanation {
        drivers: vec![driver(&["k2"], 0.75), driver(&["k4", "k5"], 0.25)],
        growth: Some(Growth {
            multiplier: 1.4,
            sigma: 0.2,
            changed_probability: 0.93,
            latest_change: Some(GrowthChange {
                from_fh: 3120.0,
                to_fh: 3280.0,
                factor: 1.5,
                factor_p10: 1.2,
                factor_p90: 1.9,
            }),
        }),
        shift: Some(Shift {
            since: AsOf {
                flight_hours: 4820.0,
                recorded_at: time("2026-02-20T00:00:00Z"),
                upload_id: "before".parse().unwrap(),
            },
            passed_fh: 20.0,
            median_before_fh: Some(2105.0),
            moved_fh: Some(-85.0),
            standard_error_fh: Some(12.0),
            surprises: vec![surprise("k2", 3.4), surprise("k1", -0.3)],
        }),
    }
}

/// A forecast that contradicts what its own model leads one to expect.
pub fn doubtful(ending: usize) -> Forecast {
    let doubt = |kind, detail: &str| Doubt { kind, detail: detail.to_owned() };
    Forecast {
        doubts: vec![
            doubt(DoubtKind::Inconsistent, "the last 3 blocks are 5.2 standard deviations away"),
            doubt(DoubtKind::OutsideTraining, "42 % of the ends of life lie outside"),
        ],
        explanation: explanation(),
        ..forecast(ending)
    }
}
