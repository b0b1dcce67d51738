//! Protobuf to domain and back.

mod agreement;
mod answer;
mod check;
mod due;
mod explanation;
mod field_path;
mod history;
mod plan;
mod settings;
mod upload;
mod warning;
mod what_if;

pub use check::into_checks;
pub use field_path::field_path;
pub use plan::{from_plan, into_plan};
pub use settings::into_settings;
pub use upload::{from_upload, into_upload};
pub use what_if::into_assumption;
