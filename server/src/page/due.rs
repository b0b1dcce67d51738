//! The due list to print, for the hours and the risk that a planner asks for.

use askama::Template;
use axum::{
    extract::State as Extract,
    http::{StatusCode, Uri},
    response::{IntoResponse, Response},
};
use domain::{Timestamp, UtilisationSource};
use proto::answer::{DueAnswer, DueItem, LatestSafe};
use serde::Deserialize;

use super::{
    html,
    words::{Badge, day, grouped},
};
use crate::{
    auth::Caller,
    due::{self, DueList, Threshold},
    query::Query,
    refusal::Refusal,
    state::Shared,
};

/// Components on the page; the rest is told over REST.
const MAX_ROWS: u32 = 1000;

#[derive(Template)]
#[template(path = "due.html")]
struct DuePage {
    now: Timestamp,
    within_fh: f64,
    /// The hours as people read them.
    within_words: String,
    risk: f64,
    /// The risk in percent.
    risk_words: String,
    /// The reason why there is no list.
    refused: Option<String>,
    /// The same as a table.
    csv: String,
    components: u64,
    due: u64,
    unknown: u64,
    rows: Vec<Row>,
    unknown_rows: Vec<Row>,
    /// Whether there are more than fit the page.
    more: bool,
    advisory: &'static str,
}

struct Row {
    badge: Badge,
    /// `None` while nobody knows where it is.
    place: Option<(String, String)>,
    part_number: String,
    serial_number: String,
    p: String,
    safe_hours: String,
    safe_in: String,
    safe_date: String,
    dominant_fault: String,
    as_of: String,
    notes: Vec<String>,
}

/// The meaning of due.
#[derive(Deserialize)]
pub struct DueQuery {
    #[serde(deserialize_with = "due::within")]
    within_fh: Option<f64>,
    #[serde(deserialize_with = "due::risk")]
    risk: Option<f64>,
}

/// `GET /due`
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    uri: Uri,
    asked: Result<Query<DueQuery>, Refusal>,
) -> Result<Response, Refusal> {
    let present = shared.state.present();
    let now = present.now();
    let Query(DueQuery { within_fh, risk }) = match asked {
        Ok(asked) => asked,
        Err(refusal) => {
            let page = html(&DuePage::refused(now, refusal.to_string()))?;
            return Ok((StatusCode::UNPROCESSABLE_ENTITY, page).into_response());
        }
    };
    let threshold = Threshold::new(within_fh, risk);
    let body = DueList::read(&shared.state, &present, caller.operator(), threshold).await?.page(None, MAX_ROWS);
    let query = uri.query().filter(|query| !query.is_empty()).map(|query| format!("&{query}")).unwrap_or_default();
    html(&DuePage::new(now, body, format!("/v1/fleet/due?format=csv{query}")))
}

impl DuePage {
    fn new(now: Timestamp, body: DueAnswer, csv: String) -> Self {
        let rows = |items: Vec<DueItem>| items.into_iter().map(Row::new).collect();
        Self {
            now,
            within_fh: body.within_fh,
            within_words: grouped(body.within_fh),
            risk: body.risk,
            risk_words: risk_words(body.risk),
            refused: None,
            csv,
            components: body.totals.components,
            due: body.totals.due,
            unknown: body.totals.unknown,
            more: body.next_cursor.is_some(),
            rows: rows(body.items),
            unknown_rows: rows(body.unknown),
            advisory: domain::ADVISORY,
        }
    }

    fn refused(now: Timestamp, why: String) -> Self {
        let Threshold { within_fh, risk } = Threshold::new(None, None);
        let totals = proto::answer::DueTotals::default();
        let (items, unknown) = (Vec::new(), Vec::new());
        let advisory = domain::ADVISORY.to_owned();
        let body = DueAnswer { within_fh, risk, totals, items, unknown, next_cursor: None, advisory };
        Self { refused: Some(why), ..Self::new(now, body, String::new()) }
    }
}

/// The date until which it is safe, and whether a plan says so.
fn safe_date(safe: &LatestSafe) -> String {
    let date = safe.date.as_deref().unwrap_or("unknown");
    match safe.utilisation_source {
        Some(UtilisationSource::Plan) => format!("{date}, as planned"),
        _ => date.to_owned(),
    }
}

/// The risk in percent as it was asked for, however small: without the digits that the multiplication adds.
fn risk_words(risk: f64) -> String {
    format!("{} %", (1e11 * risk).round() / 1e9)
}

impl Row {
    fn new(item: DueItem) -> Self {
        let safe = item.latest_safe.as_ref();
        let none = || "none".to_owned();
        let hours = |hours: f64| format!("{} fh", grouped(hours));
        // The reason of a component that contradicts the model names its doubts already.
        let told = |detail: &String| item.reason.as_ref().is_some_and(|reason| reason.contains(detail));
        let doubts = item.doubts.iter().flatten().map(|doubt| &doubt.detail).filter(|detail| !told(detail));
        let notes = item.reason.iter().chain(doubts).cloned().collect();
        Self {
            badge: Badge::due(item.status, item.doubts.as_deref()),
            p: match item.p.zip(item.standard_error) {
                Some((p, error)) => format!("{:.1} % \u{b1} {:.1}", 100.0 * p, 100.0 * error),
                None => none(),
            },
            safe_hours: safe.map_or_else(none, |safe| hours(safe.flight_hours)),
            safe_in: safe.map_or_else(none, |safe| hours(safe.remaining_fh)),
            safe_date: safe.map_or_else(none, safe_date),
            dominant_fault: item.dominant_fault.unwrap_or_else(|| "unknown".to_owned()),
            as_of: item.as_of.map_or_else(
                || "nothing yet".to_owned(),
                |as_of| format!("{} fh, {}", grouped(as_of.flight_hours), day(as_of.recorded_at)),
            ),
            notes,
            place: item.tail.zip(item.position),
            part_number: item.part_number,
            serial_number: item.serial_number,
        }
    }
}
