//! Protobuf to domain and back.

mod answer;
mod due;
mod explanation;
mod field_path;
mod history;
mod upload;
mod warning;

pub use field_path::field_path;
pub use upload::{from_upload, into_upload};
