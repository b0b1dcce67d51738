//! Answers: uploads, events, components, places and histories.

use domain::{
    Component, Estimate, EventId, OperatorId, PartNumber, Position, SerialNumber, State, TailNumber, UploadId,
    UploadStateKind,
};

use super::{Backend, Store, backend};
use crate::{
    ComponentRecord, EventRecord, HistoryOf, Installation, Installed, InstalledTail, IssuedLife, LifeCursor,
    ListedUnit, Scope, StoreError, TailInShort, UnitsAsked, UploadRecord, Version,
};

impl Store {
    /// An upload and what became of it.
    pub async fn upload(&self, operator: &OperatorId, id: &UploadId) -> Result<Option<UploadRecord>, StoreError> {
        backend!(self, upload(operator, id))
    }

    /// Uploads of an operator in one state, by component and then by (recorded_at, upload_id), from the
    /// first one after `after` (the last one of the page before; an unknown name gives an empty page).
    pub async fn uploads(
        &self,
        operator: &OperatorId,
        state: UploadStateKind,
        after: Option<&UploadId>,
        limit: u32,
    ) -> Result<Vec<UploadRecord>, StoreError> {
        backend!(self, uploads(operator, state, after, limit))
    }

    /// An event, voided or not.
    pub async fn event(&self, operator: &OperatorId, id: &EventId) -> Result<Option<EventRecord>, StoreError> {
        backend!(self, event(operator, id))
    }

    /// The events of a component, voided ones too, in the order of (flight_hours, occurred_at, event_id).
    pub async fn events(&self, component: &Component) -> Result<Vec<EventRecord>, StoreError> {
        backend!(self, events(component))
    }

    /// A component with its lives and installations; `None` for an unknown one.
    pub async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        backend!(self, component(component))
    }

    /// Tells whether any upload or event of a component was ever stored.
    pub async fn knows_component(&self, component: &Component) -> Result<bool, StoreError> {
        backend!(self, knows_component(component))
    }

    /// Installations of a component, in the order of time.
    pub async fn installations(&self, component: &Component) -> Result<Vec<Installation>, StoreError> {
        backend!(self, installations(component))
    }

    /// Tells whether any upload, install or removal at a position was ever stored.
    pub async fn knows_place(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<bool, StoreError> {
        backend!(self, knows_place(operator, tail, position))
    }

    /// Tails of an operator in alphabetical order, from the first one after `after`.
    pub async fn tails(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<TailNumber>, StoreError> {
        backend!(self, tails(operator, after, limit))
    }

    /// Tells whether anything was ever received of a tail, though everything on it may have moved on.
    pub async fn knows_tail(&self, operator: &OperatorId, tail: &TailNumber) -> Result<bool, StoreError> {
        backend!(self, knows_tail(operator, tail))
    }

    /// The components installed on a tail, by position; empty for an unknown tail.
    pub async fn installed(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Vec<Installed>, StoreError> {
        backend!(self, installed(operator, tail))
    }

    /// The component installed at one position of a tail.
    pub async fn installed_at(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Option<Installed>, StoreError> {
        backend!(self, installed_at(operator, tail, position))
    }

    /// Tails of an operator in alphabetical order, from the first one after `after`, each with what is
    /// installed on it (nothing, where everything has moved on).
    pub async fn installed_fleet(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<InstalledTail>, StoreError> {
        backend!(self, installed_fleet(operator, after, limit))
    }

    /// Components of an operator that lost their places to others, and that nobody removed: each where it was last.
    pub async fn displaced(&self, operator: &OperatorId) -> Result<Vec<Installed>, StoreError> {
        backend!(self, displaced(operator))
    }

    /// The version of what [`Self::installed`], [`Self::installed_at`], [`Self::installed_fleet`] and
    /// [`Self::displaced`] tell of a scope.
    pub async fn version(&self, operator: &OperatorId, scope: Scope<'_>) -> Result<Version, StoreError> {
        backend!(self, version(operator, scope))
    }

    /// Tails of an operator in alphabetical order, from the first one after `after`, in short.
    pub async fn tails_in_short(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<TailInShort>, StoreError> {
        backend!(self, tails_in_short(operator, after, limit))
    }

    /// The components of an operator that are asked for, in short: by tail and position, and behind them those without a
    /// place. Those with a forecast for which `draws` says so come with its draws.
    pub async fn units(
        &self,
        operator: &OperatorId,
        asked: UnitsAsked<'_>,
        draws: impl Fn(&ListedUnit) -> bool + Send + Sync,
    ) -> Result<Vec<ListedUnit>, StoreError> {
        backend!(self, units(operator, asked, draws))
    }

    /// Those of some components that have a place or lost it, in no order.
    pub async fn installed_units(
        &self,
        operator: &OperatorId,
        components: &[(PartNumber, SerialNumber)],
    ) -> Result<Vec<Installed>, StoreError> {
        backend!(self, installed_units(operator, components))
    }

    /// Estimates that count in a life of a component (the newest one unless it is named) with `from_fh <= flight_hours
    /// < to_fh`, in the order of the life, from the first one after `after`.
    pub async fn estimates(
        &self,
        component: &Component,
        of: impl Into<HistoryOf>,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<&LifeCursor>,
        limit: u32,
    ) -> Result<Vec<Estimate>, StoreError> {
        backend!(self, estimates(component, of.into(), from_fh, to_fh, after, limit))
    }

    /// States of a life of a component (the newest one unless it is named) with `from_fh <= as_of.flight_hours <
    /// to_fh`, by block, from the first one after block `after`.
    pub async fn states(
        &self,
        component: &Component,
        of: impl Into<HistoryOf>,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<u64>,
        limit: u32,
    ) -> Result<Vec<State>, StoreError> {
        backend!(self, states(component, of.into(), from_fh, to_fh, after, limit))
    }

    /// The finished lives of an operator that failed last, the newest failure first; of each the first
    /// prognosis with a forecast that was issued in every stretch of `every_fh` hours before the failure, by
    /// whatever generation answered then. Stretches begin at multiples of `every_fh`, which is positive.
    pub async fn issued_on_finished_lives(
        &self,
        operator: &OperatorId,
        every_fh: f64,
        limit: u32,
    ) -> Result<Vec<IssuedLife>, StoreError> {
        backend!(self, issued_on_finished_lives(operator, every_fh, limit))
    }
}
