//! Bodies of the REST interface: what is sent to it, and what it alone tells.

mod check;
mod component;
mod maintenance;
mod parse;
mod plan;
mod problem;
mod scoreboard;
mod sensor_configuration;
mod settings;
mod upload;
mod warning;
mod what_if;

pub use check::CheckBody;
pub use component::{ComponentBody, ContradictionItem, GenerationItem, InstallationItem, LifeBeginning, LifeItem};
pub use maintenance::{EventItem, MaintenanceAck, MaintenanceBody, MaintenanceKind, MaintenanceStatus};
pub use parse::{BodyError, parse};
pub use plan::{PlanBody, StretchBody};
pub use problem::{FieldError, Problem};
pub use scoreboard::ScoreboardBody;
pub use sensor_configuration::{
    SensorConfigurationAck, SensorConfigurationBody, SensorConfigurationItem, SensorConfigurationStatus,
    example as example_sensor_configuration,
};
pub use settings::{FunctionBody, SettingsBody};
pub use upload::{Ingested, LineResult, RetryAck, RetryBody, UploadAck, UploadBody, UploadStatusBody};
pub use warning::WarningItem;
pub use what_if::WhatIfBody;
