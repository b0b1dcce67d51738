//! Settings of operators.

use axum::{
    Json,
    extract::{Request, State as Extract},
};
use proto::{
    answer::SettingsAnswer,
    json::{self, SettingsBody},
};

use super::body::{JSON, media_type, read};
use crate::{
    auth::Caller,
    problems::{Listing, Setting},
    query::{Nothing, Query},
    refusal::Refusal,
    settings,
    state::Shared,
};

/// How the caller's operator reads its forecasts.
#[utoipa::path(
    get, path = "/v1/settings", tag = "settings", operation_id = "getSettings",
    responses((status = 200, description = "The settings in force", body = SettingsAnswer), Listing)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    _: Query<Nothing>,
) -> Result<Json<SettingsAnswer>, Refusal> {
    Ok(Json(settings::get(&shared.state, caller.operator()).await?))
}

/// Set how the caller's operator reads its forecasts.
///
/// What is left out has its default. Who set what, and when, is kept. Sending the same again changes nothing.
#[utoipa::path(
    put, path = "/v1/settings", tag = "settings", operation_id = "putSettings",
    request_body = SettingsBody,
    responses((status = 200, description = "In force, durable", body = SettingsAnswer), Setting)
)]
pub async fn put(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    request: Request,
) -> Result<Json<SettingsAnswer>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: SettingsBody = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let settings = body.checked()?;
    let act = caller.at((shared.state.clock)());
    Ok(Json(settings::set(&shared.state, caller.operator(), &settings, act).await?))
}
