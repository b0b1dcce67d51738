//! How good forecasts of remaining life are: estimators that only judge, backtests, metrics, reports.
//!
//! What: recorded lives are fed to estimators as if they were being lived ([`replay_all`]), what they said is scored
//! against the true failures ([`backtest`], [`metrics`]), and told as figures ([`Metrics`]) and as a page of charts
//! ([`report`]). Forecasts that were issued are judged by the same metrics ([`issued`]).
//! Requirements: offline; pure, and results do not depend on the number of threads.
//!
//! ```
//! use domain::FaultVector;
//! use evaluation::backtest::{ReplaySettings, Run, replay, scoreboard};
//! use prognosis::{Climatology, Observation, PredictionSettings};
//!
//! // A life of 3,000 h, predicted by how long earlier lives went on.
//! let seen = |i: u32| Observation {
//!     t_fh: 100.0 * f64::from(i),
//!     fault_vector: FaultVector(vec![0.0]),
//!     sigma: vec![0.01],
//!     load: None,
//!     temperature: None,
//! };
//! let run = Run { id: "one".to_owned(), observations: (0..30).map(seen).collect(), failure_fh: Some(3000.0) };
//! let fleet = Climatology::of_failures(&[2500.0, 2900.0, 3100.0, 3500.0]).expect("failures");
//! let prediction = PredictionSettings { draws: 100, horizon_fh: 8000.0 };
//! let replayed = replay(&run, &fleet, &ReplaySettings { every_fh: 200.0, prediction, seed: 1 });
//! let score = replayed.score.expect("the failure is known");
//! let board = scoreboard(&[&score]);
//! assert!(board.crps_fh.is_some_and(|crps_fh| crps_fh < 300.0));
//! ```

pub mod backtest;
pub mod chart;
mod contest;
mod digest;
mod estimator;
pub mod issued;
mod judgement;
mod knowledge;
pub mod metrics;
mod recorded;
mod records;
pub mod report;
mod terms;

pub use contest::{Contestant, Judged, Replays, replay_all};
pub use digest::Digest;
pub use estimator::{Law, Linear, MixedBrownian, MixedEffects, Oracle, Ridge, Thesis};
pub use judgement::Metrics;
pub use knowledge::{Knowledge, Unteachable};
pub use recorded::{CONSTANT_GROWTH, Recorded};
pub use records::{RecordedEnd, RecordedLife, Records};
pub use terms::{Terms, Unit};
