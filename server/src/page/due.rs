//! The due list to print, for the hours and the risk that a planner asks for.

use askama::Template;
use axum::{
    extract::State as Extract,
    http::{StatusCode, Uri},
    response::{IntoResponse, Response},
};
use domain::{Day, Timestamp, Urgency, UtilisationSource, check::NEXT};
use proto::answer::{DueAnswer, DueItem, LatestSafe};
use serde::{Deserialize, Deserializer};

use super::{
    dots, html,
    rung::{self, Rung},
    words::{day, grouped},
};
use crate::{
    auth::Caller,
    due::{DueList, Ends},
    query::{self, Query},
    question::{self, Sent},
    refusal::Refusal,
    state::Shared,
};

/// Components on the page; the rest is told over REST.
const MAX_ROWS: u32 = 500;

#[derive(Template)]
#[template(path = "due.html")]
struct DuePage {
    now: Timestamp,
    /// What was asked about, as it was typed.
    typed: Typed,
    /// What units have to last for, in words.
    period: String,
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
    rung: Rung,
    /// Why its data are not to be relied on.
    data: Option<String>,
    /// By which day it was due, by data that are not to be relied on.
    was_due_by: Option<String>,
    /// `None` while nobody knows where it is.
    place: Option<(String, String)>,
    part_number: String,
    serial_number: String,
    p: String,
    /// Ends of life against what it has to last for.
    dots: Option<String>,
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
    #[serde(deserialize_with = "query::text")]
    by: Option<String>,
    #[serde(deserialize_with = "query::text")]
    check: Option<String>,
    #[serde(deserialize_with = "typed_hours")]
    within_fh: Option<f64>,
    #[serde(deserialize_with = "question::risk")]
    risk: Option<f64>,
}

/// Hours that can be asked about, unless the field was left empty.
fn typed_hours<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    let hours = query::optional(given, question::WITHIN_RULE, |text| match text {
        "" => Some(None),
        text => text.parse().ok().filter(|hours| question::is_within(*hours)).map(Some),
    });
    hours.map(Option::flatten)
}

/// What was typed; what is empty was not.
#[derive(Default)]
struct Typed {
    by: String,
    check: String,
    within_fh: String,
}

impl DueQuery {
    fn typed(&self) -> Typed {
        Typed {
            by: self.by.clone().unwrap_or_default(),
            check: self.check.clone().unwrap_or_default(),
            within_fh: self.within_fh.map(|hours| hours.to_string()).unwrap_or_default(),
        }
    }

    /// The question; fields of a form that were left empty ask nothing.
    fn sent(self) -> Sent {
        let given = |text: Option<String>| text.filter(|text| !text.trim().is_empty());
        Sent { by: given(self.by), check: given(self.check), within_fh: self.within_fh, risk: self.risk }
    }
}

/// `GET /due`
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    uri: Uri,
    asked: Result<Query<DueQuery>, Refusal>,
) -> Result<Response, Refusal> {
    let present = shared.state.present(caller.operator()).await?;
    let (now, today) = (present.now(), present.today());
    let refused = |typed: Typed, refusal: &Refusal| {
        let page = html(&DuePage::refused(now, today, present.settings().risk, typed, refusal.to_string()))?;
        Ok((StatusCode::UNPROCESSABLE_ENTITY, page).into_response())
    };
    let query = match asked {
        Ok(Query(query)) => query,
        Err(refusal) => return refused(Typed::default(), &refusal),
    };
    let typed = query.typed();
    let question = match query.sent().checked(&present) {
        Ok(question) => question,
        Err(refusal) => return refused(typed, &refusal),
    };
    let body = DueList::read(&shared.state, &present, caller.operator(), question).await?;
    let (body, ends) = body.page_with_ends(None, MAX_ROWS);
    let query = uri.query().filter(|query| !query.is_empty()).map(|query| format!("&{query}")).unwrap_or_default();
    html(&DuePage::new(now, today, typed, (body, ends), format!("/v1/fleet/due?format=csv{query}")))
}

impl DuePage {
    fn new(
        now: Timestamp,
        today: Day,
        typed: Typed,
        (body, ends): (DueAnswer, Vec<Option<Ends>>),
        csv: String,
    ) -> Self {
        let period = period(&body);
        let mut due: Vec<_> = body.items.into_iter().zip(ends).collect();
        due.sort_by_cached_key(|(item, _)| by_date(item));
        Self {
            now,
            typed,
            period,
            risk: body.risk,
            risk_words: risk_words(body.risk),
            refused: None,
            csv,
            components: body.totals.components,
            due: body.totals.due,
            unknown: body.totals.unknown,
            more: body.next_cursor.is_some(),
            rows: due.into_iter().map(|(item, ends)| Row::new(item, ends, today)).collect(),
            unknown_rows: body.unknown.into_iter().map(|item| Row::new(item, None, today)).collect(),
            advisory: domain::ADVISORY,
        }
    }

    fn refused(now: Timestamp, today: Day, risk: f64, typed: Typed, why: String) -> Self {
        let totals = proto::answer::DueTotals::default();
        let (items, unknown) = (Vec::new(), Vec::new());
        let advisory = domain::ADVISORY.to_owned();
        let (within_fh, by, check) = (None, None, None);
        let body = DueAnswer { within_fh, by, check, risk, totals, items, unknown, next_cursor: None, advisory };
        Self { refused: Some(why), ..Self::new(now, today, typed, (body, Vec::new()), String::new()) }
    }
}

/// What units have to last for, in words.
fn period(body: &DueAnswer) -> String {
    match (body.by, body.check.as_deref(), body.within_fh) {
        (Some(day), ..) => format!("before {day}"),
        (_, Some(NEXT), _) => "before the next check of their tail".to_owned(),
        (_, Some(name), _) => format!("before the check {name} of their tail"),
        (.., Some(hours)) => format!("within {} flight hours of their newest data", grouped(hours)),
        _ => String::new(),
    }
}

/// The order of the page: failed ones, those whose day nobody knows, which may be the first, then by the day until which they
/// are safe; each by the hours.
fn by_date(item: &DueItem) -> (bool, String, i64) {
    let safe = item.latest_safe.as_ref();
    let date = safe.and_then(|safe| safe.date.clone()).unwrap_or_default();
    (item.urgency != Urgency::Failed, date, safe.map_or(0, |safe| safe.remaining_fh as i64))
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
    fn new(item: DueItem, ends: Option<Ends>, today: Day) -> Self {
        let safe = item.latest_safe.as_ref();
        let none = || "none".to_owned();
        let hours = |hours: f64| format!("{} fh", grouped(hours));
        // The reason of a component that contradicts the model names its doubts already.
        let told = |detail: &String| item.reason.as_ref().is_some_and(|reason| reason.contains(detail));
        let doubts = item.doubts.iter().flatten().map(|doubt| &doubt.detail).filter(|detail| !told(detail));
        let notes = item.reason.iter().chain(doubts).cloned().collect();
        Self {
            rung: Rung::new(item.urgency, &rung::until(&item.before, today)),
            data: rung::data(item.status, item.data_age_days),
            was_due_by: item.was_due_by.map(|day| rung::short(day, today)),
            p: match item.p.zip(item.standard_error) {
                Some((p, error)) => format!("{} \u{b1} {:.1}", rung::percent(p), 100.0 * error),
                None => none(),
            },
            dots: ends
                .filter(|_| item.urgency != Urgency::Failed)
                .zip(item.before.within_fh)
                .map(|(ends, within_fh)| dots::plot(&ends, within_fh)),
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
