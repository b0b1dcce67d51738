//! What the service counts and times of itself: names and meanings in one place, because several
//! crates record them (through the `metrics` facade) and one serves them.

/// A figure that the service tells of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Its name; units last, base units only.
    pub name: &'static str,
    /// How it behaves.
    pub kind: MetricKind,
    /// What it means, and its labels.
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

const fn metric(name: &'static str, kind: MetricKind, help: &'static str) -> Metric {
    Metric { name, kind, help }
}

/// Time to answer over HTTP; labels `route` (its template), `method`, `status`.
pub const HTTP_REQUEST_SECONDS: Metric = metric(
    "http_request_duration_seconds",
    MetricKind::Seconds,
    "Time until an HTTP answer begins, by route, method and status.",
);
/// Time to answer over gRPC; labels `method`, `code`.
pub const GRPC_REQUEST_SECONDS: Metric = metric(
    "grpc_request_duration_seconds",
    MetricKind::Seconds,
    "Time until a gRPC answer begins, by method and status code.",
);
/// Uploads that came in; labels `transport`, `outcome`.
pub const UPLOADS: Metric =
    metric("uploads_total", MetricKind::Counter, "Uploads that came in, by transport and outcome.");
/// Uploads that wait for a worker.
pub const PENDING_UPLOADS: Metric = metric("pending_uploads", MetricKind::Gauge, "Uploads that wait for a worker.");
/// Age of the upload that has waited longest.
pub const OLDEST_PENDING_SECONDS: Metric = metric(
    "oldest_pending_seconds",
    MetricKind::Gauge,
    "How long the upload that has waited longest has waited; 0 when none waits.",
);
/// Uploads that are set aside. A gauge in spite of its name: a retried upload leaves it again.
pub const SET_ASIDE: Metric =
    metric("set_aside_total", MetricKind::Gauge, "Uploads that are set aside: kept, not used, each with its reason.");
/// Uploads that lie in no partition of their month; counted up to a thousand.
pub const UPLOADS_WITHOUT_PARTITION: Metric = metric(
    "uploads_without_partition",
    MetricKind::Gauge,
    "Uploads that lie in the default partition of a Postgres database, up to 1000; it should be 0.",
);
/// Time of a durable transaction.
pub const COMMIT_SECONDS: Metric =
    metric("commit_seconds", MetricKind::Seconds, "Time to write one group of uploads or results durably.");
/// Writes that one transaction held.
pub const COMMIT_WRITES: Metric =
    metric("commit_writes", MetricKind::Numbers, "Uploads and results that one transaction held.");
/// Transactions that failed and were tried again in halves.
pub const COMMITS_HALVED: Metric = metric(
    "commits_halved_total",
    MetricKind::Counter,
    "Transactions that failed and were tried again in halves, to find the write at fault.",
);
/// Writes that failed for good.
pub const COMMIT_FAILURES: Metric =
    metric("commit_failures_total", MetricKind::Counter, "Transactions that failed for good.");
/// Uploads that wait for the writer.
pub const UPLOAD_QUEUE: Metric =
    metric("upload_queue_waiting", MetricKind::Gauge, "Uploads in memory that wait for the disk, unacknowledged.");
/// Leases that ended; label `outcome`: `done`, `fenced` (another worker took over), `failed`, `returned` (the worker
/// stopped first).
pub const LEASES: Metric = metric("leases_total", MetricKind::Counter, "Leases of components that ended, by outcome.");
/// Time to analyse one component.
pub const ANALYSIS_SECONDS: Metric =
    metric("analysis_seconds", MetricKind::Seconds, "Time to analyse one component: estimates, states, prognosis.");

/// Parts of the worker that ended abnormally and were started again.
pub const WORKER_RESTARTS: Metric = metric(
    "worker_restarts_total",
    MetricKind::Counter,
    "Parts of the worker that ended abnormally and were started again.",
);

/// Connections that are open.
pub const CONNECTIONS: Metric = metric("connections_open", MetricKind::Gauge, "Connections that are open.");
/// Connections that the service left by itself; label `reason`: `idle` (made room for another one), `full` (all others
/// waited for the service), `stalled` (took nothing of its answers).
pub const CONNECTIONS_LEFT: Metric =
    metric("connections_left_total", MetricKind::Counter, "Connections that the service left by itself, by reason.");
/// Requests that were refused because too many were under way.
pub const REQUESTS_REFUSED: Metric = metric(
    "requests_refused_total",
    MetricKind::Counter,
    "Requests that were refused because too many were under way.",
);

/// Every figure.
pub const ALL: [Metric; 18] = [
    CONNECTIONS,
    CONNECTIONS_LEFT,
    REQUESTS_REFUSED,
    HTTP_REQUEST_SECONDS,
    GRPC_REQUEST_SECONDS,
    UPLOADS,
    PENDING_UPLOADS,
    OLDEST_PENDING_SECONDS,
    SET_ASIDE,
    UPLOADS_WITHOUT_PARTITION,
    COMMIT_SECONDS,
    COMMIT_WRITES,
    COMMITS_HALVED,
    COMMIT_FAILURES,
    UPLOAD_QUEUE,
    LEASES,
    ANALYSIS_SECONDS,
    WORKER_RESTARTS,
];
