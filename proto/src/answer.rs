//! Answers that both transports give, each described once: JSON writes it as it is, [`grpc`](crate::grpc) turns it into
//! its message.
//!
//! What only one transport tells stands beside that one.

mod before;
mod check;
mod due;
mod health;
mod model;
mod page;
mod plan;
mod rul;
mod settings;
mod tail;
mod what_if;

pub use before::Before;
pub use check::{ChangedCheck, CheckItem, CheckTerms, ChecksAnswer, ChecksChange, ChecksImport};
pub use due::{DueAnswer, DueItem, DueTotals, LatestSafe};
pub use health::{FaultEstimate, HealthItem, Outcome, StateItem};
pub use model::{MaskAnswer, ModelItem};
pub use page::Page;
pub use plan::{PlanAnswer, PlannedItem};
pub use rul::{EndOfLife, FailureProbability, Fault, FaultsByName, MonteCarlo, RulAnswer, RulQuantiles};
pub use settings::{FunctionItem, SettingsAnswer};
pub use tail::{DisplacedItem, PositionItem, TailAnswer, TailDisagreement, TailItem};
pub use what_if::{AskedProbability, WhatIfAnswer};
