//! Checks of tails: of one, and of many in a table.

use axum::{
    Json,
    extract::{Request, State as Extract},
    http::{
        HeaderMap, HeaderName,
        header::{CONTENT_DISPOSITION, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
};
use domain::TailNumber;
use proto::{
    answer::{ChecksAnswer, ChecksImport, Page},
    json::{self, CheckBody, FieldError},
};
use serde::{Deserialize, Deserializer};
use utoipa::IntoParams;

use super::{
    body::{CSV, JSON, media_type, read, read_up_to},
    due::{Format, format, prefers_csv},
};
use crate::{
    auth::Caller,
    check_table, checks,
    limits::{DEFAULT_LIMIT, MAX_LIMIT, MAX_TABLE_BYTES},
    path::{Named, Tail},
    problems::{Importing, Listing, Lookup, Scheduling},
    query::{self, Query},
    refusal::Refusal,
    state::Shared,
};

/// What a table is told as.
const TABLE: [(HeaderName, &str); 2] = [
    (CONTENT_TYPE, "text/csv; charset=utf-8; header=present"),
    (CONTENT_DISPOSITION, "attachment; filename=\"checks.csv\""),
];

/// The checks of a tail: when it is in the hangar.
///
/// Each with the day on which it comes, by the tail's plan or by how much it flew of late.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/checks", tag = "checks", operation_id = "getChecks",
    params(Tail),
    responses((status = 200, description = "The checks in force", body = ChecksAnswer), Lookup)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Json<ChecksAnswer>, Refusal> {
    Ok(Json(checks::get(&shared.state, caller.operator(), &tail).await?))
}

/// Set the checks of a tail, in the place of those of before; at most 20, and an empty list withdraws them.
///
/// A check is on a day, or comes when so many airframe hours are flown. Days are those of the operator's time zone. Who set
/// what, and when, is kept. Sending the same again changes nothing.
#[utoipa::path(
    put, path = "/v1/tails/{tail}/checks", tag = "checks", operation_id = "putChecks",
    params(Tail),
    request_body = Vec<CheckBody>,
    responses((status = 200, description = "In force, durable", body = ChecksAnswer), Scheduling)
)]
pub async fn put(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Json<ChecksAnswer>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let bodies: Vec<CheckBody> = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let (state, operator) = (&shared.state, caller.operator());
    let present = state.present(operator).await?;
    let checks = CheckBody::checked(&bodies, present.today())?;
    let act = caller.at((state.clock)());
    Ok(Json(checks::set(state, operator, &tail, checks, (&present, act)).await?))
}

/// A page of tails, or all of them as a table.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Listed {
    /// How many items; default 50; not with CSV
    #[serde(deserialize_with = "query::optional_limit")]
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
    /// `next_cursor` of the page before; not with CSV
    #[serde(deserialize_with = "query::cursor")]
    #[param(value_type = Option<String>)]
    cursor: Option<TailNumber>,
    /// json or csv, before what `Accept` says
    #[serde(deserialize_with = "format")]
    #[param(inline)]
    format: Option<Format>,
}

/// The tails that have checks, in alphabetical order, each with its checks.
///
/// As `text/csv` (by `Accept`, or by `format=csv`) they come whole, in a table of the columns that an import takes: one row a
/// check, without those that are over.
#[utoipa::path(
    get, path = "/v1/checks", tag = "checks", operation_id = "listChecks",
    params(Listed),
    responses(
        (status = 200, description = "One page, or the whole table",
            content((Page<ChecksAnswer> = "application/json"), (String = "text/csv"))),
        Listing,
    )
)]
pub async fn list(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    headers: HeaderMap,
    Query(Listed { limit, cursor, format }): Query<Listed>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    if !format.map_or_else(|| prefers_csv(&headers), |format| format == Format::Csv) {
        let page = checks::page(state, operator, cursor.as_ref(), limit.unwrap_or(DEFAULT_LIMIT)).await?;
        return Ok(Json(page).into_response());
    }
    let given = [("limit", limit.is_some()), ("cursor", cursor.is_some())].into_iter().filter(|(_, given)| *given);
    let errors: Vec<_> = given.map(|(name, _)| FieldError::parameter(name, "a CSV table comes whole")).collect();
    if !errors.is_empty() {
        return Err(Refusal::Parameters(errors));
    }
    let (mut table, mut after) = (check_table::head(), None);
    loop {
        let page = checks::page(state, operator, after.as_ref(), MAX_LIMIT).await?;
        table.extend(page.items.iter().map(check_table::rows));
        after = page.next_cursor.and_then(|tail| tail.parse().ok());
        if after.is_none() {
            return Ok((TABLE, table).into_response());
        }
    }
}

/// Whether an import is only tried.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Import {
    /// true: tell what would change, and change nothing; default false
    #[serde(deserialize_with = "preview")]
    #[param(value_type = Option<bool>)]
    preview: bool,
}

fn preview<'de, D: Deserializer<'de>>(given: D) -> Result<bool, D::Error> {
    let given = query::optional(given, "true or false", |text| text.parse().ok())?;
    Ok(given.unwrap_or(false))
}

/// Set the checks of all tails that a table names, together, each in the place of those of before; other tails keep theirs.
///
/// The columns are `tail,name,date,remaining_fh,as_of`, one row a check, at most 10,000. Where anything is wrong nothing is
/// changed, and each error names its row (the head is row 1) and column: `#/3/date`. The answer tells what changed.
#[utoipa::path(
    put, path = "/v1/checks", tag = "checks", operation_id = "importChecks",
    params(Import),
    request_body(
        content = String, content_type = "text/csv",
        example = "tail,name,date,remaining_fh,as_of\r\nEC-MXA,C-check,2026-10-01,,\r\nEC-MXA,A-check,,412.5,2026-02-20\r\n"
    ),
    responses((status = 200, description = "In force, durable; or what would be", body = ChecksImport), Importing)
)]
pub async fn import(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Query(Import { preview }): Query<Import>,
    request: Request,
) -> Result<Json<ChecksImport>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[CSV], CSV)?;
    let bytes = read_up_to(&shared, &parts.headers, body, MAX_TABLE_BYTES).await?;
    let (state, operator) = (&shared.state, caller.operator());
    let present = state.present(operator).await?;
    let checks = check_table::read(&bytes, &checks::tails(state, operator).await?, present.today())?;
    let act = (!preview).then(|| caller.at((state.clock)()));
    Ok(Json(checks::import(state, operator, &checks, act).await?))
}
