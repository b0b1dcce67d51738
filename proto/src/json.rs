//! Bodies of the REST interface.

mod as_of;
mod component;
mod due;
mod explanation;
mod health;
mod load;
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

pub use as_of::AsOfBody;
pub use component::{
    ComponentBody, ContradictionItem, GenerationItem, GenerationState, InstallationItem, InstallationSource,
    LifeBeginning, LifeItem,
};
pub use due::{DueBody, DueItem, DueTotals, LatestSafe};
pub use explanation::{Doubt, DoubtKind, Driver, ExplanationBody, Growth, GrowthChange, Movement, Surprise};
pub use health::{FaultEstimate, HealthItem, Outcome, StateItem};
pub use load::{LoadBody, LoadSource};
pub use maintenance::{EventItem, FindingOutcome, MaintenanceAck, MaintenanceBody, MaintenanceKind, MaintenanceStatus};
pub use model::{MaskBody, ModelItem};
pub use page::Page;
pub use parse::{BodyError, parse};
pub use problem::{FieldError, Problem};
pub use rul::{
    EndOfLife, FailureProbability, Fault, FaultsByName, MonteCarlo, PropagationBody, RulBody, RulQuantiles, Status,
};
pub use scoreboard::ScoreboardBody;
pub use sensor_configuration::{
    SensorConfigurationAck, SensorConfigurationBody, SensorConfigurationItem, SensorConfigurationStatus,
    example as example_sensor_configuration,
};
pub use tail::{DisplacedItem, PositionItem, TailBody, TailItem};
pub use upload::{
    AirDataBody, Ingested, LineResult, LoadRatioBody, RetryAck, RetryBody, StrainBody, UploadAck, UploadBody,
    UploadState, UploadStatusBody,
};
pub use warning::WarningItem;
