//! The forecaster of what is only asked about.

use std::pin::Pin;

use domain::{Ahead, Component, Prognosis};
use store::StoreError;

/// A prognosis to come; `None` where nothing is known of the component.
pub type Forecasting = Pin<Box<dyn Future<Output = Result<Option<Prognosis>, ForecastError>> + Send>>;

/// Forecasts what nobody will be served again: the numerics that this shell does not have.
pub trait Forecaster: Send + Sync {
    /// The prognosis of the life that a component is in, if these flights were ahead. Nothing is written.
    fn what_if(&self, component: Component, ahead: Ahead) -> Forecasting;
}

/// Why there is no forecast.
#[derive(Debug, thiserror::Error)]
pub enum ForecastError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The analysis failed.
    #[error("{0}")]
    Analysis(String),
}
