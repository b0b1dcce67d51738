//! Forecasts of what is only asked about, for the server: by an analyst that leases nothing and writes nothing.

use std::sync::Arc;

use domain::{Ahead, Component};
use server::{ForecastError, Forecaster, Forecasting};
use store::Store;
use worker::{Analyst, Clock, WorkerError};

/// Computes a prognosis as a worker would.
pub struct WhatIf(Arc<Analyst>);

impl WhatIf {
    /// Over a database.
    pub fn new(store: Store, clock: Clock) -> Self {
        Self(Arc::new(Analyst::new(store, clock)))
    }
}

impl Forecaster for WhatIf {
    fn what_if(&self, component: Component, ahead: Ahead) -> Forecasting {
        let analyst = self.0.clone();
        Box::pin(async move {
            analyst.what_if(&component, ahead).await.map_err(|error| match error {
                WorkerError::Store(error) => ForecastError::Store(error),
                other => ForecastError::Analysis(other.to_string()),
            })
        })
    }
}
