//! The due list, as JSON or as a table.

use axum::{
    Json,
    extract::State as Extract,
    http::{
        HeaderMap, HeaderName, HeaderValue,
        header::{ACCEPT, CONTENT_DISPOSITION, CONTENT_TYPE},
    },
    response::Response,
};
use domain::Day;
use proto::{
    answer::{DueAnswer, DueItem},
    json::FieldError,
};
use serde::{Deserialize, Deserializer};
use store::Scope;
use utoipa::{IntoParams, ToSchema};

use crate::{
    asked::Asked,
    auth::Caller,
    csv,
    due::{DueList, Place},
    encoding::varies_by,
    limits::DEFAULT_LIMIT,
    present::Present,
    problems::Listing,
    query::{self, Query},
    question::{self, Question, Sent},
    refusal::Refusal,
    state::Shared,
};

/// What a table is told as.
const TABLE: [(HeaderName, &str); 2] = [
    (CONTENT_TYPE, "text/csv; charset=utf-8; header=present"),
    (CONTENT_DISPOSITION, "attachment; filename=\"due.csv\""),
];
const COLUMNS: [&str; 29] = [
    "list",
    "tail",
    "position",
    "part_number",
    "serial_number",
    "life",
    "status",
    "dominant_fault",
    "within_fh",
    "risk",
    "p",
    "standard_error",
    "latest_safe_remaining_fh",
    "latest_safe_flight_hours",
    "latest_safe_date",
    "as_of_flight_hours",
    "as_of_recorded_at",
    "as_of_upload_id",
    "doubts",
    "reason",
    "utilisation_source",
    "urgency",
    "before_check",
    "before_date",
    "before_fh",
    "was_due_by",
    "data_age_days",
    "by",
    "check",
];

/// The meaning of due, and the form of the list.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct DueQuery {
    /// Flight hours from the newest data of each component; default: until the next check of its tail, and 500 where it has
    /// none to come
    #[serde(deserialize_with = "question::within")]
    #[param(minimum = 0, maximum = 10000)]
    within_fh: Option<f64>,
    /// A day to come in the operator's time zone, in the place of hours
    #[serde(deserialize_with = "query::text")]
    #[param(format = "date", example = "2027-03-01")]
    by: Option<String>,
    /// The name of a check of the tails, in the place of hours; `next` is the one that comes first
    #[serde(deserialize_with = "query::text")]
    #[param(example = "C-check")]
    check: Option<String>,
    /// Probability of failure until then, above which a component is due; as the operator has set it (0.1 unless set)
    #[serde(deserialize_with = "question::risk")]
    #[param(exclusive_minimum = 0, exclusive_maximum = 1)]
    risk: Option<f64>,
    /// How many items; default 50; not with CSV
    #[serde(deserialize_with = "query::optional_limit")]
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
    /// `next_cursor` of the page before, of the same question; not with CSV
    #[serde(deserialize_with = "cursor")]
    #[param(value_type = Option<String>)]
    cursor: Option<Place>,
    /// json or csv, before what `Accept` says
    #[serde(deserialize_with = "format")]
    #[param(inline)]
    format: Option<Format>,
}

/// The form of the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum Format {
    /// A page.
    Json,
    /// The whole table.
    Csv,
}

pub(super) fn format<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Format>, D::Error> {
    query::optional(given, "json or csv", |text| match text {
        "json" => Some(Format::Json),
        "csv" => Some(Format::Csv),
        _ => None,
    })
}

fn cursor<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Place>, D::Error> {
    query::optional(given, "a cursor of this collection", Place::from_cursor)
}

impl DueQuery {
    fn question(&self, present: &Present) -> Result<Question, Refusal> {
        let Self { by, check, within_fh, risk, .. } = self;
        Sent { by: by.clone(), check: check.clone(), within_fh: *within_fh, risk: *risk }.checked(present)
    }

    /// The page of a list that is asked for.
    fn page_of(&self, list: DueList) -> DueAnswer {
        list.page(self.cursor.as_ref(), self.limit.unwrap_or(DEFAULT_LIMIT))
    }

    /// Refuses what asks for a part of a table.
    fn must_be_whole(&self) -> Result<(), Refusal> {
        let given = [("limit", self.limit.is_some()), ("cursor", self.cursor.is_some())].into_iter();
        let refused = given.filter(|(_, is_given)| *is_given);
        let errors: Vec<_> = refused.map(|(name, _)| FieldError::parameter(name, "a CSV table comes whole")).collect();
        if errors.is_empty() { Ok(()) } else { Err(Refusal::Parameters(errors)) }
    }
}

/// The components that are due: failed, or more likely to fail before something than a risk allows: within some flight
/// hours, before a day, or before a check of their tails. Where nothing is asked about, that is the next check of each tail,
/// and those that are to be acted on now are due, too.
///
/// Worst first: failed ones, then by the probability of failure, then by the latest safe hours. Components
/// whose state is unknown (too little history, stale or contradictory data) are not healthy: those whose
/// last numbers exceed the risk are among the items, with their status; all others are listed as `unknown`,
/// behind the items. Both count towards `limit`. Everything is counted from the newest data of a component
/// (`as_of`): hours flown since then are not known and are to be subtracted.
///
/// As `text/csv` (by `Accept`, or by `format=csv`) the list comes whole, in one table; its first column
/// tells `due` from `unknown`.
#[utoipa::path(
    get, path = "/v1/fleet/due", tag = "fleet", operation_id = "listDue",
    params(DueQuery),
    responses(
        (status = 200, description = "One page, or the whole table", content((DueAnswer = "application/json"), (String = "text/csv"))),
        Listing,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    headers: HeaderMap,
    asked: Asked,
    Query(due): Query<DueQuery>,
) -> Result<Response, Refusal> {
    let as_csv = due.format.map_or_else(|| prefers_csv(&headers), |format| format == Format::Csv);
    if as_csv {
        due.must_be_whole()?;
    }
    let (state, operator) = (&shared.state, caller.operator());
    let list = async |present: &Present| DueList::read(state, present, operator, due.question(present)?).await;
    let mut response = match as_csv {
        false => {
            let page = async |present: &Present| Ok(Json(due.page_of(list(present).await?)));
            asked.tell(&shared, Scope::Fleet, page).await?
        }
        true => {
            let table = async |present: &Present| Ok((TABLE, table(&list(present).await?.whole())));
            asked.in_form("csv").tell(&shared, Scope::Fleet, table).await?
        }
    };
    varies_by(response.headers_mut(), HeaderValue::from_static("accept"));
    Ok(response)
}

/// Tells whether a caller names `text/csv` and does not like `application/json` more.
pub(super) fn prefers_csv(headers: &HeaderMap) -> bool {
    let accepted = || headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok()).flat_map(|v| v.split(','));
    let quality = |wanted: &str| {
        let mut ranges = accepted().map(|range| range.split(';').map(str::trim));
        let mut named = ranges.find(|range| range.clone().next().is_some_and(|it| it.eq_ignore_ascii_case(wanted)))?;
        Some(named.find_map(|it| it.strip_prefix("q=")?.parse::<f64>().ok()).unwrap_or(1.0))
    };
    quality("text/csv").is_some_and(|csv| csv > 0.0 && csv >= quality("application/json").unwrap_or(0.0))
}

fn table(body: &DueAnswer) -> String {
    let mut table = csv::line(COLUMNS.map(str::to_owned));
    for (list, items) in [("due", &body.items), ("unknown", &body.unknown)] {
        for item in items {
            table += &csv::line(row(list, body, item));
        }
    }
    table
}

fn row(list: &str, body: &DueAnswer, item: &DueItem) -> [String; 29] {
    let (safe, as_of) = (item.latest_safe.as_ref(), item.as_of.as_ref());
    let number = |number: Option<f64>| number.map(|number| number.to_string()).unwrap_or_default();
    let day = |day: Option<Day>| day.map(|day| day.to_string()).unwrap_or_default();
    let text = |text: Option<&String>| text.cloned().unwrap_or_default();
    let doubts: Vec<_> = item.doubts.iter().flatten().map(|doubt| doubt.kind.as_str()).collect();
    [
        list.to_owned(),
        text(item.tail.as_ref()),
        text(item.position.as_ref()),
        item.part_number.clone(),
        item.serial_number.clone(),
        item.life.to_string(),
        item.status.as_str().to_owned(),
        text(item.dominant_fault.as_ref()),
        number(body.within_fh),
        body.risk.to_string(),
        number(item.p),
        number(item.standard_error),
        number(safe.map(|safe| safe.remaining_fh)),
        number(safe.map(|safe| safe.flight_hours)),
        text(safe.and_then(|safe| safe.date.as_ref())),
        number(as_of.map(|as_of| as_of.flight_hours)),
        as_of.map(|as_of| as_of.recorded_at.to_string()).unwrap_or_default(),
        as_of.map(|as_of| as_of.upload_id.to_string()).unwrap_or_default(),
        doubts.join(";"),
        text(item.reason.as_ref()),
        safe.and_then(|safe| safe.utilisation_source).map(|source| source.as_str().to_owned()).unwrap_or_default(),
        item.urgency.as_str().to_owned(),
        text(item.before.check.as_ref()),
        day(item.before.date),
        number(item.before.within_fh),
        day(item.was_due_by),
        item.data_age_days.map(|days| days.to_string()).unwrap_or_default(),
        day(body.by),
        text(body.check.as_ref()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_for_those_who_ask_for_one() {
        let prefers = |accept: &str| prefers_csv(&HeaderMap::from_iter([(ACCEPT, accept.parse().unwrap())]));
        for accept in ["text/csv", "TEXT/CSV;q=0.9", "text/csv, */*", "application/json;q=0.5, text/csv;header=present"]
        {
            assert!(prefers(accept), "{accept}");
        }
        let browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";
        for accept in [browser, "*/*", "text/csv;q=0", "text/csv;q=0.5, application/json", "text/plain", ""] {
            assert!(!prefers(accept), "{accept}");
        }
    }
}
