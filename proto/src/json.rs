//! Bodies of the REST interface.

mod component;
mod due;
mod health;
mod maintenance;
mod model;
mod page;
mod parse;
mod problem;
mod rul;
mod scoreboard;
mod sensor_configuration;
mod tail;
mod upload;
mod warning;

pub use component::{
    ComponentBody, ContradictionItem, GenerationItem, GenerationState, InstallationItem, InstallationSource,
    LifeBeginning, LifeItem,
};
pub use due::{DueBody, DueItem, DueTotals, LatestSafe};
pub use health::{FaultEstimate, HealthItem, Outcome, StateItem};
pub use maintenance::{EventItem, MaintenanceAck, MaintenanceBody, MaintenanceKind, MaintenanceStatus};
pub use model::{MaskBody, ModelItem};
pub use page::Page;
pub use parse::{BodyError, parse};
pub use problem::{FieldError, Problem};
pub use rul::{EndOfLife, FailureProbability, Fault, FaultsByName, MonteCarlo, RulBody, RulQuantiles};
pub use scoreboard::ScoreboardBody;
pub use sensor_configuration::{
    SensorConfigurationAck, SensorConfigurationBody, SensorConfigurationItem, SensorConfigurationStatus,
    example as example_sensor_configuration,
};
pub use tail::{DisplacedItem, PositionItem, TailBody, TailItem};
pub use upload::{Ingested, LineResult, RetryAck, RetryBody, UploadAck, UploadBody, UploadState, UploadStatusBody};
pub use warning::WarningItem;
