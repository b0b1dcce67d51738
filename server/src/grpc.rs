//! gRPC: the same functions in protobuf's words, with health and reflection.

mod fleet_health;
mod ingest;
mod models;

use axum::Router;
use proto::v1::{fleet_health_server::FleetHealthServer, ingest_server::IngestServer, models_server::ModelsServer};
use tonic::service::Routes;

use crate::{limits::MAX_UPLOAD_BYTES, state::Shared};

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

/// All services: what they share is what they serve from.
struct Service(Shared);
