//! gRPC: the same functions in protobuf's words, with health and reflection.

use axum::Router;
use domain::{ContentHash, Position, TailNumber};
use proto::{
    grpc::into_upload,
    json::Ingested,
    v1::{
        self,
        fleet_health_server::{FleetHealth, FleetHealthServer},
        ingest_server::{Ingest, IngestServer},
        models_server::{Models, ModelsServer},
    },
};
use tonic::{Request, Response, Status, service::Routes};

use crate::{
    answer,
    app::Shared,
    ingest::ingest,
    parameters::{grpc_limit, grpc_within},
    refusal::Refusal,
    rest::MAX_UPLOAD_BYTES,
};

/// The services as routes.
pub async fn routes(shared: &Shared) -> Router {
    let (health, health_service) = tonic_health::server::health_reporter();
    health.set_serving::<IngestServer<Service>>().await;
    health.set_serving::<FleetHealthServer<Service>>().await;
    health.set_serving::<ModelsServer<Service>>().await;
    let service = || Service(shared.clone());
    let mut routes = Routes::builder();
    routes
        .add_service(IngestServer::new(service()).max_decoding_message_size(MAX_UPLOAD_BYTES))
        .add_service(FleetHealthServer::new(service()))
        .add_service(ModelsServer::new(service()))
        .add_service(health_service)
        .add_service(reflection().build_v1().expect("the descriptors were compiled with this build"))
        .add_service(reflection().build_v1alpha().expect("the descriptors were compiled with this build"));
    routes.routes().into_axum_router().reset_fallback()
}

fn reflection() -> tonic_reflection::server::Builder<'static> {
    tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(proto::FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
}

struct Service(Shared);

#[tonic::async_trait]
impl Ingest for Service {
    async fn upload(&self, request: Request<v1::UploadRequest>) -> Result<Response<v1::UploadResponse>, Status> {
        let upload = into_upload(request.into_inner()).map_err(Refusal::from)?;
        let upload_id = upload.upload_id.to_string();
        let status = match ingest(&self.0, upload).await? {
            Ingested::Duplicate => v1::UploadStatus::Duplicate,
            _ => v1::UploadStatus::Accepted,
        };
        Ok(Response::new(v1::UploadResponse { upload_id, status: status.into() }))
    }
}

#[tonic::async_trait]
impl FleetHealth for Service {
    async fn list_tails(
        &self,
        request: Request<v1::ListTailsRequest>,
    ) -> Result<Response<v1::ListTailsResponse>, Status> {
        let v1::ListTailsRequest { limit, cursor } = request.into_inner();
        let limit = grpc_limit(limit)?;
        let after: Option<TailNumber> = match cursor.as_str() {
            "" => None,
            text => Some(text.parse().map_err(|_| Refusal::parameter("cursor", "must be a cursor of this call"))?),
        };
        Ok(Response::new(answer::tails(&self.0.state, after.as_ref(), limit).await?.into()))
    }

    async fn get_rul(&self, request: Request<v1::GetRulRequest>) -> Result<Response<v1::Rul>, Status> {
        let v1::GetRulRequest { tail, position, within_fh } = request.into_inner();
        let mut invalid = domain::Invalid::default();
        let tail = invalid.check("#/tail", tail.parse::<TailNumber>());
        let position = invalid.check("#/position", position.parse::<Position>());
        let place = invalid.into_result(tail.zip(position)).map_err(Refusal::from)?;
        let within_fh = grpc_within(within_fh)?;
        let installed = answer::installed_at(&self.0.state, &place.0, &place.1).await?;
        Ok(Response::new(answer::rul(&self.0.state, &installed, within_fh.as_deref()).into()))
    }
}

#[tonic::async_trait]
impl Models for Service {
    async fn get_mask(&self, request: Request<v1::GetMaskRequest>) -> Result<Response<v1::Mask>, Status> {
        let hash: Option<ContentHash> = match request.into_inner().model.as_str() {
            "" => None,
            text => Some(
                text.parse()
                    .map_err(|error: domain::hash::InvalidHash| Refusal::parameter("model", error.to_string()))?,
            ),
        };
        Ok(Response::new(answer::mask(&self.0.state, hash.as_ref()).await?.into()))
    }
}
