//! The state of the server: what it is given, and what its handlers share.

use std::{ops::Deref, sync::Arc, time::Duration};

use domain::{OperatorId, Timestamp};
use proto::frame::InstallationKey;
use store::{Store, StoreError};
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use crate::{
    auth::{HostName, Origin},
    forecaster::Forecaster,
    in_service::InService,
    intake::Budget,
    kept::KeptAnswers,
    masks::Masks,
    present::Present,
    prometheus::Metrics,
    scorer::Scorer,
    units::Units,
};

/// Tells the present.
pub type Clock = Arc<dyn Fn() -> Timestamp + Send + Sync>;

/// The things that the server serves from.
#[derive(Clone)]
pub struct State {
    /// The database.
    pub store: Store,
    /// The present: of the machine, or of a simulated fleet.
    pub clock: Clock,
    /// Age of the newest data from which a prognosis is stale: unknown, not healthy.
    pub stale_after: Duration,
    /// Whether an upload enrols a tail, position or component that is not known yet.
    pub enrol: bool,
    /// The names by which the service is called where it asks who calls; none: by any.
    pub hosts: Vec<HostName>,
    /// The origins of pages elsewhere that may call it.
    pub origins: Vec<Origin>,
    /// Places for connections.
    pub max_connections: usize,
    /// Judges the forecasts of lives that have finished.
    pub scorer: Arc<dyn Scorer>,
    /// Forecasts what is only asked about.
    pub forecaster: Arc<dyn Forecaster>,
    /// The secret from which frame keys follow; without it no frames are taken.
    pub frame_key: Option<InstallationKey>,
    /// The figures on `/metrics`.
    pub metrics: Metrics,
}

impl State {
    /// The moment at which an answer to an operator begins to be made.
    pub async fn present(&self, operator: &OperatorId) -> Result<Present, StoreError> {
        Present::of(&self.store, operator, (self.clock)(), self.stale_after).await
    }
}

/// The things that all handlers share.
#[derive(Clone)]
pub struct Shared(Arc<Context>);

/// See [`Shared`].
pub struct Context {
    /// The state that is served from.
    pub state: State,
    /// The room for bodies that are still coming in.
    pub budget: Budget,
    /// Held while an item of a sequence is read: sequences take turns, so that however many come in at once, one of them at
    /// a time keeps others from a thread.
    pub turn: Semaphore,
    /// Places for forecasts that are only asked about.
    pub what_ifs: Arc<Semaphore>,
    /// Answers that were built before.
    pub kept: KeptAnswers,
    /// Masks that were read before.
    pub masks: Masks,
    /// The bundle by which new lives are judged.
    pub in_service: InService,
    /// Units by status, as they were counted for `/metrics`.
    pub units: Units,
    /// Cancelled when the service begins to stop: streams end then.
    pub stopping: CancellationToken,
}

impl Shared {
    /// Wraps what all handlers are to share.
    pub fn new(context: Context) -> Self {
        Self(Arc::new(context))
    }
}

impl Deref for Shared {
    type Target = Context;
    fn deref(&self) -> &Context {
        &self.0
    }
}
