//! Inputs of operators: uploads, maintenance events, corrections, sensor configurations, plans, checks.

use std::{collections::BTreeMap, ops::RangeInclusive};

use domain::{
    Act, Checks, Component, EventId, MaintenanceEvent, OperatorId, Plan, Position, SensorConfiguration, SetAsideReason,
    TailNumber, Timestamp, Upload, UploadId, Warning,
};

use super::{Backend, Store, backend};
use crate::{
    Addition, EventReceipt, Planned, Receipt, Released, Retrial, StoreError, TailChecks, TailConfiguration, TailPlan,
    Voiding,
};

impl Store {
    /// Stores an upload; returns once it is durable. [`StoreError::Overloaded`] when too many wait.
    ///
    /// The first upload of a component enrols it and pins its life to the active bundle and to the newest
    /// prior that its operator has learned for it, or else to the bundle's own.
    pub async fn accept(
        &self,
        operator: &OperatorId,
        upload: Upload,
        received_at: Timestamp,
    ) -> Result<Receipt, StoreError> {
        backend!(self, accept(operator, upload, received_at))
    }

    /// Takes an upload back for ever: it and its name stay, nothing rests on it any longer. `None` for
    /// an unknown one. Idempotent.
    pub async fn void_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        backend!(self, void_upload(operator, id, act))
    }

    /// Lets a worker try again an upload that is set aside. `None` for an unknown one.
    pub async fn retry_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Retrial>, StoreError> {
        backend!(self, retry_upload(operator, id, act))
    }

    /// Sends uploads of a tail that are set aside, and were recorded at a time, back to be estimated again; a bounded
    /// number of them.
    pub async fn retry_uploads(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        recorded_at: RangeInclusive<Timestamp>,
        reason: Option<SetAsideReason>,
        act: Act,
    ) -> Result<Released, StoreError> {
        backend!(self, retry_uploads(operator, tail, recorded_at, reason, act))
    }

    /// Stores a maintenance event; returns once it is durable. An event of an unknown component enrols it.
    ///
    /// Installs and removals say where a component is, whatever uploads say. An overhaul begins a life: an
    /// upload or event belongs to the life whose number is that of the overhauls strictly before it, in the
    /// order of (flight_hours, time). The first finding `failed` of a life, in the order of (flight_hours,
    /// occurred_at, event_id), ends it. What an event changes of the lives is found anew by a worker.
    pub async fn record_event(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
        now: Timestamp,
    ) -> Result<EventReceipt, StoreError> {
        backend!(self, record_event(operator, event, now))
    }

    /// Takes an event back for ever: it and its name stay, but it counts no longer. `None` for an unknown
    /// one. Idempotent.
    pub async fn void_event(
        &self,
        operator: &OperatorId,
        id: &EventId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        backend!(self, void_event(operator, id, act))
    }

    /// Warns of what a stored event contradicts of what is known now, and what follows.
    pub async fn event_warnings(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
    ) -> Result<Vec<Warning>, StoreError> {
        backend!(self, event_warnings(operator, event))
    }

    /// Known names that differ in case only from those of a component and its position.
    pub async fn names_alike(
        &self,
        component: &Component,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Vec<Warning>, StoreError> {
        backend!(self, names_alike(component, tail, position))
    }

    /// Puts a sensor configuration in force on a tail from a time on, which may be past, until the time
    /// of the tail's next one. Uploads of that period wait to be estimated again.
    pub async fn add_sensor_configuration(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        effective_from: Timestamp,
        configuration: &SensorConfiguration,
        act: Act,
    ) -> Result<Addition, StoreError> {
        backend!(self, add_sensor_configuration(operator, tail, effective_from, configuration, act))
    }

    /// The sensor configurations of a tail, by the time from which they are in force.
    pub async fn sensor_configurations(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Vec<TailConfiguration>, StoreError> {
        backend!(self, sensor_configurations(operator, tail))
    }

    /// Sets the plan of a tail, unless the same is in force; returns the version that is in force then. What is on the tail
    /// now waits for a prognosis by it. A plan without stretches withdraws the one before.
    pub async fn set_plan(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        plan: &Plan,
        act: Act,
    ) -> Result<TailPlan, StoreError> {
        backend!(self, set_plan(operator, tail, plan, act))
    }

    /// The newest version of a tail's plan; `None` where none was ever set.
    pub async fn plan(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Option<TailPlan>, StoreError> {
        backend!(self, plan(operator, tail))
    }

    /// All versions of a tail's plan, the oldest first.
    pub async fn plans(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Vec<TailPlan>, StoreError> {
        backend!(self, plans(operator, tail))
    }

    /// Sets the checks of tails, together; tails of which the same are in force keep their version. Returns the versions that
    /// are in force then, in the order of the tails. Where there are none, those of before are withdrawn.
    pub async fn set_checks(
        &self,
        operator: &OperatorId,
        checks: &[(TailNumber, Checks)],
        act: Act,
    ) -> Result<Vec<TailChecks>, StoreError> {
        backend!(self, set_checks(operator, checks, act))
    }

    /// The newest version of a tail's checks; `None` where none were ever set.
    pub async fn checks(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Option<TailChecks>, StoreError> {
        backend!(self, checks(operator, tail))
    }

    /// How a tail flies.
    pub async fn planned(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Planned, StoreError> {
        backend!(self, planned(operator, tail))
    }

    /// How the tails behind `after` up to `last` fly, as far as anything is known of them.
    pub async fn fleet_planned(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        last: &TailNumber,
    ) -> Result<BTreeMap<TailNumber, Planned>, StoreError> {
        backend!(self, fleet_planned(operator, after, last))
    }

    /// A page of the tails that have checks, by tail, with the version in force.
    pub async fn fleet_checks(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<(TailNumber, TailChecks)>, StoreError> {
        backend!(self, fleet_checks(operator, after, limit))
    }
}
