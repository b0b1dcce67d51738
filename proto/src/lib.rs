//! The wire of both transports, REST (JSON) and gRPC (protobuf), and the way from there to the nouns.
//!
//! - [`answer`]: what both transports tell, described once;
//! - [`json`]: the other bodies of the REST interface, used by the server and by its clients alike;
//! - [`v1`]: messages and services generated from `actuary/v1/*.proto`;
//! - [`grpc`]: protobuf to domain and back;
//! - [`frame`]: an upload in one block of ACARS.
//!
//! What comes in is parsed or refused here, once; a refusal names the field as a JSON pointer, or
//! as a protobuf field path. The same upload gives the same [`domain::Upload`], hence the same
//! content hash, whichever transport it took.

pub mod answer;
mod brought;
pub mod frame;
pub mod grpc;
pub mod json;

/// Generated from `actuary/v1/*.proto`.
#[allow(missing_docs, clippy::all)]
pub mod v1 {
    tonic::include_proto!("actuary.v1");
}

/// The encoded `FileDescriptorSet` of [`v1`], for reflection.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/actuary.v1.bin"));
