//! The due list, as JSON or as a table.

use axum::{
    Json,
    extract::State as Extract,
    http::{
        HeaderMap, HeaderName,
        header::{ACCEPT, CONTENT_DISPOSITION, CONTENT_TYPE, VARY},
    },
    response::{IntoResponse, Response},
};
use proto::json::{DueBody, DueItem};

use crate::{
    auth::Caller,
    csv,
    due::{DueList, Place, Threshold},
    parameters::Pairs,
    problems::Listing,
    refusal::Refusal,
    state::Shared,
};

const COLUMNS: [&str; 20] = [
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
];

/// The components that are due: failed, or more likely to fail within some flight hours than a risk allows.
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
    params(
        ("within_fh" = Option<f64>, Query, description = "Flight hours from the newest data of each component, 0 to 10000; default 500"),
        ("risk" = Option<f64>, Query, description = "Probability of failure within them, above which a component is due, between 0 and 1; default 0.1"),
        ("limit" = Option<u32>, Query, description = "1 to 1000, default 50; not with CSV"),
        ("cursor" = Option<String>, Query, description = "`next_cursor` of the page before, of the same hours and risk; not with CSV"),
        ("format" = Option<String>, Query, description = "json or csv, before what `Accept` says"),
    ),
    responses(
        (status = 200, description = "One page, or the whole table", content((DueBody = "application/json"), (String = "text/csv"))),
        Listing,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    headers: HeaderMap,
    pairs: Pairs,
) -> Result<Response, Refusal> {
    let mut parameters = pairs.read(&["within_fh", "risk", "limit", "cursor", "format"]);
    let threshold = Threshold::read(&mut parameters);
    let asked = parameters.parsed("format", "json or csv", |text| match text {
        "json" => Some(false),
        "csv" => Some(true),
        _ => None,
    });
    let as_csv = asked.unwrap_or_else(|| prefers_csv(&headers));
    if as_csv {
        parameters.without(&["limit", "cursor"], "a CSV table comes whole");
    }
    let limit = parameters.limit();
    let after = parameters.parsed("cursor", "a cursor of this collection", Place::from_cursor);
    parameters.finish()?;
    let list = DueList::read(&shared.state, caller.operator(), threshold).await?;
    let varies = (VARY, ACCEPT.as_str());
    if !as_csv {
        return Ok(([varies], Json(list.page(after.as_ref(), limit))).into_response());
    }
    let described: [(HeaderName, &str); 3] = [
        varies,
        (CONTENT_TYPE, "text/csv; charset=utf-8; header=present"),
        (CONTENT_DISPOSITION, "attachment; filename=\"due.csv\""),
    ];
    Ok((described, table(&list.whole())).into_response())
}

/// Whether a caller names `text/csv` and does not like `application/json` more.
fn prefers_csv(headers: &HeaderMap) -> bool {
    let accepted = || headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok()).flat_map(|v| v.split(','));
    let quality = |wanted: &str| {
        let mut ranges = accepted().map(|range| range.split(';').map(str::trim));
        let mut named = ranges.find(|range| range.clone().next().is_some_and(|it| it.eq_ignore_ascii_case(wanted)))?;
        Some(named.find_map(|it| it.strip_prefix("q=")?.parse::<f64>().ok()).unwrap_or(1.0))
    };
    quality("text/csv").is_some_and(|csv| csv > 0.0 && csv >= quality("application/json").unwrap_or(0.0))
}

fn table(body: &DueBody) -> String {
    let mut table = csv::line(COLUMNS.map(str::to_owned));
    for (list, items) in [("due", &body.items), ("unknown", &body.unknown)] {
        for item in items {
            table += &csv::line(row(list, body, item));
        }
    }
    table
}

fn row(list: &str, body: &DueBody, item: &DueItem) -> [String; 20] {
    let (safe, as_of) = (item.latest_safe.as_ref(), item.as_of.as_ref());
    let number = |number: Option<f64>| number.map(|number| number.to_string()).unwrap_or_default();
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
        body.within_fh.to_string(),
        body.risk.to_string(),
        number(item.p),
        number(item.standard_error),
        number(safe.map(|safe| safe.remaining_fh)),
        number(safe.map(|safe| safe.flight_hours)),
        text(safe.and_then(|safe| safe.date.as_ref())),
        number(as_of.map(|as_of| as_of.flight_hours)),
        text(as_of.map(|as_of| &as_of.recorded_at)),
        text(as_of.map(|as_of| &as_of.upload_id)),
        doubts.join(";"),
        text(item.reason.as_ref()),
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
