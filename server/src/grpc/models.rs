//! `Models`: bundles and their masks.

use domain::{ContentHash, hash::InvalidHash};
use proto::v1::{self, models_server::Models};
use tonic::{Request, Response, Status};

use super::Service;
use crate::{answer, refusal::Refusal};

#[tonic::async_trait]
impl Models for Service {
    async fn list(&self, _: Request<v1::ListModelsRequest>) -> Result<Response<v1::ListModelsResponse>, Status> {
        Ok(Response::new(answer::models(&self.0.state).await?.into()))
    }

    async fn get_mask(&self, request: Request<v1::GetMaskRequest>) -> Result<Response<v1::Mask>, Status> {
        let hash: Option<ContentHash> = match request.into_inner().model.as_str() {
            "" => None,
            text => Some(text.parse().map_err(|error: InvalidHash| Refusal::parameter("model", error.to_string()))?),
        };
        Ok(Response::new(answer::mask(&self.0.state, hash.as_ref()).await?.into()))
    }
}
