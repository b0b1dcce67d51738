//! Prognostic Assessment: from the history of fault vectors to remaining useful life with uncertainty.
//!
//! Observations of a life are condensed into closed [`Block`]s, a [`Filter`] follows the fault
//! growth through them, starting from what a [`FleetPrior`] knows, and [`forecast`](forecast())
//! carries its [`Posterior`] to the [`Boundary`] of the assessment by Monte Carlo.
//! [`fit_prior`] learns the prior from earlier lives.
//!
//! Everything but the learning is bit-reproducible: `libm` only, plain loops, fixed order.
//!
//! ```
//! use domain::{FaultModel, FaultVector, RulDistribution};
//! use numerics::Stream;
//! use prognosis::{Boundary, Filter, FleetPrior, ForecastSettings, Observation, blocks, forecast};
//!
//! /// Faulty once the first short exceeds an eighth.
//! struct Eighth;
//! impl Boundary for Eighth {
//!     fn margin(&self, k: &[f64]) -> f64 {
//!         1.0 - 8.0 * k[0]
//!     }
//! }
//!
//! // The first short grows by 5e-5 an hour, seen every 2 h with little error.
//! let seen = |i: u32| Observation {
//!     t_fh: 2.0 * f64::from(i),
//!     fault_vector: FaultVector(vec![1e-4 * f64::from(i), 0.0, 0.0, 0.5, 0.5]),
//!     sigma: vec![1e-3; 5],
//!     load: None,
//!     temperature: None,
//! };
//! let life: Vec<Observation> = (0..500).map(seen).collect();
//! let prior = FleetPrior::vague();
//! let mut filter = Filter::new(&FaultModel::electrical(), &prior);
//! blocks(&life, &prior.clock).iter().for_each(|block| filter.update(block));
//! let settings = ForecastSettings::default();
//! let stream = Stream::new(1, &["front page"]);
//! let ends_fh = forecast(&filter.posterior(), 0.0, &Eighth, None, &settings, &stream).ends_fh;
//! let rul = RulDistribution::from_draws(&ends_fh, settings.horizon_fh);
//! // Straight on, the boundary is 1,500 h away; wear that feeds on itself gets there sooner.
//! assert!(rul.quantile_fh(0.5).is_some_and(|median_fh| (700.0..1700.0).contains(&median_fh)));
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod bank;
pub mod block;
pub mod boundary;
pub mod checkpoint;
pub mod clipping;
pub mod clock;
pub mod companions;
mod consistency;
mod consistency_fit;
pub mod coordinate;
pub mod ended;
pub mod estimator;
pub mod failure_time;
pub mod filter;
pub mod fit;
pub mod forecast;
pub mod growth_changes;
pub mod growth_laws;
mod growth_summary;
mod held_out;
pub mod hierarchy;
pub mod itinerary;
mod kalman;
pub mod lesson;
mod level;
pub mod life;
pub mod life_forecast;
pub mod life_prior;
mod limits;
pub mod load_agreement;
pub mod missions;
mod mixture;
mod moments;
pub mod motor_load;
pub mod noise;
pub mod pace;
mod pace_fit;
mod particle;
mod pool;
pub mod posterior;
pub mod prior;
mod recalibration;
pub mod residual_noise;
pub mod scale;
pub mod stacking;
mod surprise;
pub mod surrogate;
pub mod survival;
mod taught;
pub mod wear_clock;

pub use block::{Block, Observation, OpenBlock, blocks, unclosed};
pub use boundary::{Boundary, Limits, Margin};
pub use checkpoint::CheckpointError;
pub use clipping::ClippedMean;
pub use clock::Clock;
pub use companions::Companions;
pub use consistency_fit::fit_consistency;
pub use coordinate::Coordinate;
pub use ended::{EndedLife, Ending};
pub use estimator::{
    Climatology, Estimator, Follower, Growth, LevelLives, Paced, Planned, PredictionSettings, Rbg, RulEstimate,
    Similarity,
};
pub use failure_time::{FinishedLife, fit_failure_time_error};
pub use filter::Filter;
pub use fit::{FitSettings, NoHistory, fit_growth_changes, fit_prior, fit_prior_from};
pub use forecast::{Draws, Forecast, ForecastSettings, Precision, forecast};
pub use growth_changes::GrowthChanges;
pub use growth_laws::{GrowthLaw, GrowthLaws, LawsWithout};
pub use held_out::{HeldOutSettings, Members};
pub use hierarchy::learn_from_ended;
pub use itinerary::{Change, MissionToCome, Told};
pub use kalman::robust_log_likelihood;
pub use lesson::{Lesson, NoLesson};
pub use life::{Expectation, Known, LifeFilter, MeasuredLife};
pub use life_forecast::Now;
pub use life_prior::LifePrior;
pub use limits::ConsistencyLimits;
pub use load_agreement::{JointFlight, LoadAgreement};
pub use missions::Missions;
pub use mixture::Mixture;
pub use moments::Moments;
pub use motor_load::{LoadPair, MotorCalibration};
pub use noise::{NoNoise, fit_noise};
pub use pace::{Basis, Coefficient, PaceLaw};
pub use pace_fit::PaceLesson;
pub use posterior::{EntryEstimate, Posterior};
pub use prior::{BiasPrior, FailureTimeError, FleetPrior, GroupPrior, START_SD, StartPrior};
pub use recalibration::Recalibration;
pub use residual_noise::{NoResiduals, fit_residual_noise};
pub use scale::{REFERENCE_LIFE_FH, REFERENCE_LIMIT, Scale};
pub use stacking::{StackSettings, Stacked, stack};
pub use survival::{NoFailure, Weibull};
pub use wear_clock::{Flight, WearClock};
