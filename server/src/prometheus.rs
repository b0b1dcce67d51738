//! Figures of the service: `/metrics` in Prometheus' text format.
//!
//! Crates record through the `metrics` facade under the names of [`metric`](mod@metric); here they are
//! described, given buckets, and served. Labels never name a tail, a component or an operator.

use std::time::{Instant, SystemTime};

use axum::{
    extract::{MatchedPath, Request},
    http::Method,
    middleware::Next,
    response::Response,
};
use metric::{Metric, MetricKind};
use metrics::{Unit, describe_counter, describe_gauge, describe_histogram, gauge, histogram};
use metrics_exporter_prometheus::{BuildError, Matcher, PrometheusBuilder, PrometheusHandle};
use tonic::Code;

use crate::CODE_VERSION;

/// Upper ends of the buckets of every duration, s.
const BUCKETS_S: [f64; 15] =
    [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0];
/// Upper ends of the buckets of every number of things.
const BUCKETS: [f64; 10] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];
/// Figures that scripts and alerts of the release before ask for by another name.
const FORMER: [(&str, Metric); 2] =
    [("pending_uploads", metric::PENDING_UPLOADS), ("set_aside_total", metric::SET_ASIDE_UPLOADS)];

/// The recorder of the process.
#[derive(Clone)]
pub struct Metrics(PrometheusHandle);

/// The reason why nothing is recorded: the process has a recorder already.
#[derive(Debug, thiserror::Error)]
#[error("metrics: {0}")]
pub struct NoRecorder(#[from] BuildError);

impl Metrics {
    /// Makes this the recorder of the process; only the first call of a process succeeds.
    pub fn install() -> Result<Self, NoRecorder> {
        let mut builder = PrometheusBuilder::new().set_buckets(&BUCKETS_S)?;
        for metric in metric::ALL.iter().filter(|metric| metric.kind == MetricKind::Numbers) {
            builder = builder.set_buckets_for_metric(Matcher::Full(metric.name.to_owned()), &BUCKETS)?;
        }
        let handle = builder.install_recorder()?;
        for metric in metric::ALL {
            match metric.kind {
                MetricKind::Counter => describe_counter!(metric.name, metric.help),
                MetricKind::Gauge => describe_gauge!(metric.name, metric.help),
                MetricKind::Seconds => describe_histogram!(metric.name, Unit::Seconds, metric.help),
                MetricKind::Numbers => describe_histogram!(metric.name, Unit::Count, metric.help),
            }
        }
        gauge!(metric::BUILD_INFO.name, "version" => CODE_VERSION).set(1.0);
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        gauge!(metric::STARTED_AT_SECONDS.name).set(since_1970.as_secs_f64().floor());
        Ok(Self(handle))
    }

    /// The figures that were recorded, in Prometheus' text format.
    pub fn render(&self) -> String {
        let mut text = self.0.render();
        for (former, metric) in FORMER {
            let value = text.lines().find_map(|line| line.strip_prefix(metric.name)?.strip_prefix(' '));
            if let Some(value) = value.map(str::to_owned) {
                let name = metric.name;
                text += &format!(
                    "# HELP {former} Former name of {name}; it goes with the next release.\n{former} {value}\n"
                );
            }
        }
        text
    }

    /// Sorts what was recorded since the last time into buckets; until then it takes memory.
    pub fn upkeep(&self) {
        self.0.run_upkeep();
    }
}

/// Times a REST call or a page.
pub async fn time_http(request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let method = known_method(request.method());
    let begun = Instant::now();
    let response = next.run(request).await;
    let status = response.status().as_str().to_owned();
    histogram!(metric::HTTP_REQUEST_SECONDS.name, "route" => route, "method" => method, "status" => status)
        .record(begun.elapsed());
    response
}

/// A method as a label: callers may invent further ones.
fn known_method(method: &Method) -> &'static str {
    let known = [Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::PATCH, Method::DELETE, Method::OPTIONS];
    let names = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"];
    known.iter().zip(names).find(|(known, _)| *known == method).map_or("other", |(_, name)| name)
}

/// Times a gRPC call, until its answer begins.
pub async fn time_grpc(request: Request, next: Next) -> Response {
    let path = request.uri().path().trim_start_matches('/').to_owned();
    let begun = Instant::now();
    let response = next.run(request).await;
    // A refusal is told in the head of the answer, and so is every call that begins to be answered.
    let code = response.headers().get("grpc-status").map_or(Code::Ok, |code| Code::from_bytes(code.as_bytes()));
    // Callers may invent methods too.
    let method = if code == Code::Unimplemented { "unknown".to_owned() } else { path };
    histogram!(metric::GRPC_REQUEST_SECONDS.name, "method" => method, "code" => (code as i32).to_string())
        .record(begun.elapsed());
    response
}
