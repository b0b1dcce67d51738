//! Model bundles and their masks.

use axum::{Json, extract::State as Extract};
use domain::ContentHash;
use proto::answer::{MaskAnswer, ModelItem, Page};
use serde::Deserialize;
use utoipa::IntoParams;

use crate::{
    answer,
    path::Named,
    problems::{Listing, Lookup},
    refusal::Refusal,
    state::Shared,
};

/// A bundle in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct One {
    /// SHA-256 of the bundle
    #[param(value_type = String)]
    hash: ContentHash,
}

/// All model bundles, the oldest first.
#[utoipa::path(
    get, path = "/v1/models", tag = "models", operation_id = "listModels",
    responses(
        (status = 200, description = "All bundles", body = Page<ModelItem>),
        Listing,
    )
)]
pub async fn list(Extract(shared): Extract<Shared>) -> Result<Json<Page<ModelItem>>, Refusal> {
    Ok(Json(answer::models(&shared.state).await?))
}

/// One model bundle.
#[utoipa::path(
    get, path = "/v1/models/{hash}", tag = "models", operation_id = "getModel",
    params(One),
    responses(
        (status = 200, description = "The bundle", body = ModelItem),
        Lookup,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    Named(One { hash }): Named<One>,
) -> Result<Json<ModelItem>, Refusal> {
    let bundle = answer::bundle(&shared.state, &hash).await?;
    Ok(Json(ModelItem::new(&bundle.summary, bundle.active)))
}

/// The mask by which to sample for a model bundle.
#[utoipa::path(
    get, path = "/v1/models/{hash}/mask", tag = "models", operation_id = "getMask",
    params(One),
    responses(
        (status = 200, description = "The mask", body = MaskAnswer),
        Lookup,
    )
)]
pub async fn mask(
    Extract(shared): Extract<Shared>,
    Named(One { hash }): Named<One>,
) -> Result<Json<MaskAnswer>, Refusal> {
    Ok(Json(answer::mask(&shared.state, Some(&hash)).await?))
}
