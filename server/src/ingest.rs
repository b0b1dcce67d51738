//! Data Acquisition: an upload is checked against its mask, stored, and only then acknowledged.

use domain::{BundleSummary, Component, Invalid, OperatorId, Position, Reading, TailNumber, Upload, UploadId, Warning};
use proto::json::Ingested;
use store::Receipt;

use crate::{
    auth::Caller,
    refusal::Refusal,
    state::{Shared, State},
};

/// Uploads of one sequence that wait for the disk together: they share transactions.
pub const IN_FLIGHT: usize = 64;

/// The way on which an upload came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// One JSON body.
    Rest,
    /// A line of many.
    Ndjson,
    /// One message.
    Grpc,
    /// A message of a stream.
    GrpcStream,
    /// A body of frames.
    RestFrame,
    /// A message of frames.
    GrpcFrame,
}

impl Transport {
    fn as_str(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Ndjson => "ndjson",
            Self::Grpc => "grpc",
            Self::GrpcStream => "grpc_stream",
            Self::RestFrame => "rest_frame",
            Self::GrpcFrame => "grpc_frame",
        }
    }

    /// Counts what became of an upload.
    fn count(self, status: Ingested) {
        let outcome = match status {
            Ingested::Accepted => "accepted",
            Ingested::Duplicate => "duplicate",
            Ingested::Conflict => "conflict",
            Ingested::Invalid => "invalid",
            Ingested::Unavailable => "unavailable",
        };
        metrics::counter!(metric::UPLOADS.name, "transport" => self.as_str(), "outcome" => outcome).increment(1);
    }
}

/// Stores an upload; returns `Accepted` or `Duplicate` once it is durable, with what it contradicts.
pub async fn ingest(
    shared: &Shared,
    caller: &Caller,
    transport: Transport,
    upload: Result<Upload, Refusal>,
) -> Result<(Ingested, Vec<Warning>), Refusal> {
    let outcome = match upload {
        Ok(upload) => check(shared, caller, upload).await,
        Err(refusal) => Err(refusal),
    };
    let judged = Judged { number: 1, upload_id: None, outcome };
    let Kept { status, warnings, refusal, .. } = judged.keep(shared, transport).await;
    refusal.map_or(Ok((status, warnings)), Err)
}

/// An upload of a sequence that may be stored, or why it may not.
pub struct Judged {
    /// Its place in the sequence, from 1.
    pub number: u64,
    /// Its name, as far as it is one.
    pub upload_id: Option<UploadId>,
    /// Whether it may be stored.
    pub outcome: Result<Checked, Refusal>,
}

/// The result of an upload of a sequence.
pub struct Kept {
    /// Its place in the sequence, from 1.
    pub number: u64,
    /// Its name, as far as it is one.
    pub upload_id: Option<UploadId>,
    /// What became of it.
    pub status: Ingested,
    /// What it contradicts, though it was stored.
    pub warnings: Vec<Warning>,
    /// Why it was not stored.
    pub refusal: Option<Refusal>,
}

impl Judged {
    /// Stores it if it may be. It takes its place in the queue when this is first polled.
    pub async fn keep(self, shared: &Shared, transport: Transport) -> Kept {
        let outcome = match self.outcome {
            Ok(checked) => keep(shared, checked).await,
            Err(refusal) => Err(refusal),
        };
        let (status, warnings, refusal) = match outcome {
            Ok((status, warnings)) => (status, warnings, None),
            Err(refusal) => (refusal.ingested(), Vec::new(), Some(refusal)),
        };
        transport.count(status);
        Kept { number: self.number, upload_id: self.upload_id, status, warnings, refusal }
    }
}

/// An upload that may be stored, and for whom.
pub struct Checked {
    operator: OperatorId,
    upload: Upload,
}

/// Checks that an upload is its caller's to send, against its mask or the bundle in service, and against what is known
/// where uploads do not enrol.
pub async fn check(shared: &Shared, caller: &Caller, upload: Upload) -> Result<Checked, Refusal> {
    caller.must_reach(upload.tail.as_str())?;
    upload.check(violations(shared, &upload.reading).await?)?;
    if !shared.state.enrol {
        let component = upload.component(caller.operator());
        must_be_known(&shared.state, &component, &upload.tail, &upload.position).await?;
    }
    Ok(Checked { operator: caller.operator().clone(), upload })
}

/// What is wrong with samples by their mask, or with an own diagnosis by the bundle in service: by what was read of it a
/// moment ago, unless that refuses.
async fn violations(shared: &Shared, reading: &Reading) -> Result<Invalid, Refusal> {
    let store = &shared.state.store;
    let lately = shared.in_service.lately(store).await?;
    let found = by_bundle(shared, reading, lately.as_deref()).await?;
    if found.violations.is_empty() {
        return Ok(found);
    }
    let now = shared.in_service.now(store).await?;
    by_bundle(shared, reading, now.as_deref()).await
}

async fn by_bundle(shared: &Shared, reading: &Reading, bundle: Option<&BundleSummary>) -> Result<Invalid, Refusal> {
    match (reading, bundle) {
        (Reading::Samples(_), Some(bundle)) if bundle.measure.is_some() => {
            let known = bundle.faults.names.join(", ");
            let detail = format!("the bundle in service reads no maps: send an own diagnosis of {known} as `faults`");
            Ok(Invalid::one("#/samples", detail))
        }
        (Reading::Samples(samples), _) => match shared.masks.get(&shared.state.store, &samples.mask_id).await? {
            Some(published) => Ok(samples.violations(&published.mask, published.k_nom)),
            None => {
                let detail = format!("mask {} was never published: GET /v1/models names the masks", samples.mask_id);
                Ok(Invalid::one("#/mask_id", detail))
            }
        },
        (Reading::Own { faults }, Some(bundle)) => Ok(faults.violations(bundle)),
        (Reading::Own { .. }, None) => Err(Refusal::Unavailable("no model bundle is active".to_owned())),
    }
}

async fn keep(shared: &Shared, Checked { operator, upload }: Checked) -> Result<(Ingested, Vec<Warning>), Refusal> {
    let upload_id = upload.upload_id.clone();
    match shared.state.store.accept(&operator, upload, (shared.state.clock)()).await? {
        Receipt::Accepted => Ok((Ingested::Accepted, Vec::new())),
        Receipt::Doubted(warnings) => Ok((Ingested::Accepted, warnings)),
        Receipt::Duplicate => Ok((Ingested::Duplicate, Vec::new())),
        Receipt::Conflict => Err(Refusal::Conflict(upload_id)),
    }
}

/// Refuses a component or a position that was never heard of, where nothing is enrolled.
pub async fn must_be_known(
    state: &State,
    component: &Component,
    tail: &TailNumber,
    position: &Position,
) -> Result<(), Refusal> {
    let mut invalid = Invalid::default();
    if !state.store.knows_place(&component.operator, tail, position).await? {
        invalid.push("#/position", format!("{position} of {tail} is not known, and nothing is enrolled"));
    }
    if !state.store.knows_component(component).await? {
        let Component { part_number, serial_number, .. } = component;
        invalid.push("#/serial_number", format!("{part_number} {serial_number} is not known, and nothing is enrolled"));
    }
    Ok(invalid.into_result(Some(()))?)
}
