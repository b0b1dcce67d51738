//! What the service counts and times of itself: names and meanings in one place, because several
//! crates record them (through the `metrics` facade) and one serves them. `dashboards/fleet.json` shows them.

/// A figure that the service tells of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Its name; units last, base units only.
    pub name: &'static str,
    /// How it behaves.
    pub kind: MetricKind,
    /// The names of its labels.
    pub labels: &'static [&'static str],
    /// What it means.
    pub help: &'static str,
}

/// How a figure behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricKind {
    /// It only grows.
    Counter,
    /// It goes up and down.
    Gauge,
    /// Durations in seconds, counted in buckets.
    Seconds,
    /// Numbers of things, counted in buckets.
    Numbers,
}

const fn metric(name: &'static str, kind: MetricKind, labels: &'static [&'static str], help: &'static str) -> Metric {
    Metric { name, kind, labels, help }
}

/// The build that runs: always 1.
pub const BUILD_INFO: Metric =
    metric("actuary_build_info", MetricKind::Gauge, &["version"], "The build that runs, by version; always 1.");
/// When the process began.
pub const STARTED_AT_SECONDS: Metric = metric(
    "actuary_started_at_seconds",
    MetricKind::Gauge,
    &[],
    "When the process began, seconds since 1970: it changes with each restart.",
);
/// Time to answer over HTTP; `route` is its template.
pub const HTTP_REQUEST_SECONDS: Metric = metric(
    "actuary_http_request_duration_seconds",
    MetricKind::Seconds,
    &["route", "method", "status"],
    "Time until an HTTP answer begins, by route, method and status.",
);
/// Time to answer over gRPC.
pub const GRPC_REQUEST_SECONDS: Metric = metric(
    "actuary_grpc_request_duration_seconds",
    MetricKind::Seconds,
    &["method", "code"],
    "Time until a gRPC answer begins, by method and status code.",
);
/// Uploads that came in.
pub const UPLOADS: Metric = metric(
    "actuary_uploads_total",
    MetricKind::Counter,
    &["transport", "outcome"],
    "Uploads that came in, by transport and outcome.",
);
/// Uploads that wait for a worker.
pub const PENDING_UPLOADS: Metric =
    metric("actuary_pending_uploads", MetricKind::Gauge, &[], "Uploads that wait for a worker.");
/// Age of the upload that has waited longest.
pub const OLDEST_PENDING_SECONDS: Metric = metric(
    "actuary_oldest_pending_seconds",
    MetricKind::Gauge,
    &[],
    "How long the upload that has waited longest has waited; 0 when none waits.",
);
/// Uploads that are set aside.
pub const SET_ASIDE_UPLOADS: Metric = metric(
    "actuary_set_aside_uploads",
    MetricKind::Gauge,
    &[],
    "Uploads that are set aside: kept, not used, each with its reason.",
);
/// Uploads that lie in no partition of their month; counted up to a thousand.
pub const UPLOADS_WITHOUT_PARTITION: Metric = metric(
    "actuary_uploads_without_partition",
    MetricKind::Gauge,
    &[],
    "Uploads that lie in the default partition of a Postgres database, up to 1000; it should be 0.",
);
/// Components that are installed or whose place is unknown, of all operators.
pub const UNITS: Metric = metric(
    "actuary_units",
    MetricKind::Gauge,
    &["status"],
    "Components that are installed or whose place is unknown, over all operators, by the status of their prognosis; \
     told by what answers callers.",
);
/// Time of a durable transaction.
pub const COMMIT_SECONDS: Metric = metric(
    "actuary_commit_seconds",
    MetricKind::Seconds,
    &[],
    "Time to write one group of uploads or results durably.",
);
/// Writes that one transaction held.
pub const COMMIT_WRITES: Metric =
    metric("actuary_commit_writes", MetricKind::Numbers, &[], "Uploads and results that one transaction held.");
/// Transactions that failed and were tried again in halves.
pub const COMMITS_HALVED: Metric = metric(
    "actuary_commits_halved_total",
    MetricKind::Counter,
    &[],
    "Transactions that failed and were tried again in halves, to find the write at fault.",
);
/// Writes that failed for good.
pub const COMMIT_FAILURES: Metric =
    metric("actuary_commit_failures_total", MetricKind::Counter, &[], "Transactions that failed for good.");
/// Uploads that wait for the writer.
pub const UPLOAD_QUEUE: Metric = metric(
    "actuary_upload_queue_waiting",
    MetricKind::Gauge,
    &[],
    "Uploads in memory that wait for the disk, unacknowledged.",
);
/// Leases that ended; `outcome` is `done`, `fenced` (another worker took over), `failed` or `returned` (the worker
/// stopped first).
pub const LEASES: Metric =
    metric("actuary_leases_total", MetricKind::Counter, &["outcome"], "Leases of components that ended, by outcome.");
/// Time to analyse one component.
pub const ANALYSIS_SECONDS: Metric = metric(
    "actuary_analysis_seconds",
    MetricKind::Seconds,
    &[],
    "Time to analyse one component: estimates, states, prognosis.",
);
/// Parts of the worker that ended abnormally and were started again.
pub const WORKER_RESTARTS: Metric = metric(
    "actuary_worker_restarts_total",
    MetricKind::Counter,
    &[],
    "Parts of the worker that ended abnormally and were started again.",
);
/// Connections that are open.
pub const CONNECTIONS: Metric =
    metric("actuary_connections_open", MetricKind::Gauge, &[], "Connections that are open.");
/// Connections that the service left by itself; `reason` is `idle` (made room for another one), `full` (all others
/// waited for the service) or `stalled` (took nothing of its answers).
pub const CONNECTIONS_LEFT: Metric = metric(
    "actuary_connections_left_total",
    MetricKind::Counter,
    &["reason"],
    "Connections that the service left by itself, by reason.",
);
/// Requests that were refused because too many were under way.
pub const REQUESTS_REFUSED: Metric = metric(
    "actuary_requests_refused_total",
    MetricKind::Counter,
    &[],
    "Requests that were refused because too many were under way.",
);

/// Every figure.
pub const ALL: [Metric; 21] = [
    BUILD_INFO,
    STARTED_AT_SECONDS,
    CONNECTIONS,
    CONNECTIONS_LEFT,
    REQUESTS_REFUSED,
    HTTP_REQUEST_SECONDS,
    GRPC_REQUEST_SECONDS,
    UPLOADS,
    PENDING_UPLOADS,
    OLDEST_PENDING_SECONDS,
    SET_ASIDE_UPLOADS,
    UPLOADS_WITHOUT_PARTITION,
    UNITS,
    COMMIT_SECONDS,
    COMMIT_WRITES,
    COMMITS_HALVED,
    COMMIT_FAILURES,
    UPLOAD_QUEUE,
    LEASES,
    ANALYSIS_SECONDS,
    WORKER_RESTARTS,
];
