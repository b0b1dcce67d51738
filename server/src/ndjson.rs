//! Many uploads in one body, one per line: answered line by line, in their order, while the body is
//! still coming in.

use std::convert::Infallible;

use axum::body::{Body, Bytes};
use domain::TailNumber;
use futures_util::{StreamExt, stream};
use proto::json::{self, LineResult, UploadBody, WarningItem};

use crate::{
    auth::{Caller, admitted},
    ingest::{IN_FLIGHT, Judged, Kept, Transport, check},
    intake::Intake,
    lines::{Line, Lines},
    state::Shared,
};

/// The results of every line of `body`, one JSON object per line.
///
/// Lines are checked one after the other and queued in their order, so that of two lines with the
/// same upload_id the first one counts; only the wait for the disk is shared. A caller that is admitted no longer
/// is told so on a last line.
pub fn results(shared: Shared, caller: Caller, tail: TailNumber, body: Body) -> Body {
    let reader = Lines::new(Intake::new(body, &shared.budget));
    let lines = stream::unfold(reader, |mut reader| async move { Some((reader.next().await?, reader)) });
    let lines = admitted(caller.clone(), lines).scan(0, |last, line| {
        let line = line.unwrap_or_else(|refusal| Line { number: *last + 1, text: Err(refusal) });
        *last = line.number;
        std::future::ready(Some(line))
    });
    let checker = shared.clone();
    let checked = lines.then(move |line| {
        let (shared, caller, tail) = (checker.clone(), caller.clone(), tail.clone());
        async move { judge(&shared, &caller, tail, line).await }
    });
    let results = checked.map(move |judged| {
        let shared = shared.clone();
        async move { Ok::<_, Infallible>(encode(&result(judged.keep(&shared, Transport::Ndjson).await))) }
    });
    Body::from_stream(results.buffered(IN_FLIGHT))
}

fn encode(result: &LineResult) -> Bytes {
    let mut line = serde_json::to_vec(result).expect("results have text keys only");
    line.push(b'\n');
    line.into()
}

async fn judge(shared: &Shared, caller: &Caller, tail: TailNumber, line: Line) -> Judged {
    let refused = |refusal| Judged { number: line.number, upload_id: None, outcome: Err(refusal) };
    let _turn = shared.turn.acquire().await;
    let body: UploadBody = match line.text.and_then(|text| Ok(json::parse(&text)?)) {
        Ok(body) => body,
        Err(refusal) => return refused(refusal),
    };
    let upload_id = body.upload_id.parse().ok();
    let outcome = match body.into_upload(tail) {
        Ok(upload) => check(shared, caller, upload).await,
        Err(invalid) => Err(invalid.into()),
    };
    Judged { number: line.number, upload_id, outcome }
}

fn result(kept: Kept) -> LineResult {
    LineResult {
        line: kept.number,
        upload_id: kept.upload_id.map(String::from),
        status: kept.status,
        warnings: kept.warnings.into_iter().map(WarningItem::from).collect(),
        error: kept.refusal.map(|refusal| refusal.problem()),
    }
}
