//! How good forecasts of remaining life are: estimators that only judge, backtests, metrics, reports.
//!
//! What: recorded lives are fed to estimators as if they were being lived ([`replay_all`]), what they said is scored against
//! the true failures ([`backtest`], [`metrics`]), and told as figures ([`Metrics`]) and as a page of charts ([`report`]).
//! Forecasts that were issued are judged by the same metrics ([`issued`]). Offline; pure, results do not depend on threads.

pub mod backtest;
pub mod chart;
mod contest;
mod estimator;
pub mod issued;
mod judgement;
mod knowledge;
pub mod metrics;
mod recorded;
pub mod report;

pub use contest::{Contestant, Judged, Replays, replay_all};
pub use estimator::{Law, Linear, Oracle, Ridge, Thesis};
pub use judgement::Metrics;
pub use knowledge::{Knowledge, Unteachable};
pub use recorded::{CONSTANT_GROWTH, Recorded};
