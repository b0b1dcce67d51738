//! What if a component flew otherwise.

use axum::{
    Json,
    extract::{Request, State as Extract},
};
use proto::{
    answer::WhatIfAnswer,
    json::{self, WhatIfBody},
};

use super::body::{JSON, media_type, read};
use crate::{
    auth::Caller,
    path::{Named, Place},
    problems::Asking,
    refusal::Refusal,
    state::Shared,
    what_if,
};

/// The remaining life at a position, if its tail flew more or less, harder or easier, warmer or colder.
///
/// Nothing is changed or kept. Load and temperature count where the RUL tells a `pace`; a question about them is refused
/// where it does not. `now` is the RUL as it is served, `assumed` the same under the assumption.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/positions/{position}/what-if", tag = "plans", operation_id = "postWhatIf",
    params(Place),
    request_body = WhatIfBody,
    responses((status = 200, description = "As it is, and as assumed", body = WhatIfAnswer), Asking)
)]
pub async fn post(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Place { tail, position }): Named<Place>,
    request: Request,
) -> Result<Json<WhatIfAnswer>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: WhatIfBody = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let assumption = body.checked((shared.state.clock)())?;
    Ok(Json(what_if::what_if(&shared, caller.operator(), (&tail, &position), &assumption).await?))
}
