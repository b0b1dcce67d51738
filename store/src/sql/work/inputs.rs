//! Inputs that a worker reads for a lease.

use std::collections::HashSet;

use domain::{Component, Plan, Timestamp, Upload};

use super::super::{
    Connection, Engine,
    ground::versions,
    lives::{
        generations,
        order::{self, Overhauls},
        waiting::{self, Waiting},
    },
    places::{plans, sensor_configurations, utilisation},
    queue::revisions,
    results::{
        estimates::{self, EstimateRange},
        states::{self, StateRange},
    },
    uploads::{received, retried},
};
use crate::{Lease, LifeInputs, Planned, StoreError};

impl Engine {
    pub(crate) async fn life_inputs(&self, lease: &Lease) -> Result<Vec<LifeInputs>, StoreError> {
        let component = &lease.component;
        let mut transaction = self.read(&component.operator).await?;
        let processed = revisions::processed_revision(&mut transaction, component).await?;
        let overhauls = order::of_component(&mut transaction, component).await?;
        let mut inputs = Vec::new();
        for life in waiting::since(&mut transaction, component, processed).await? {
            inputs.push(inputs_of(&mut transaction, component, life, &overhauls).await?);
        }
        Ok(inputs)
    }

    /// What the results of the life that a component is in rest on, in the generation that answers, without what waits.
    pub(crate) async fn present_life(&self, component: &Component) -> Result<Option<LifeInputs>, StoreError> {
        const EVER: i64 = -1;
        let mut transaction = self.read(&component.operator).await?;
        let Some(mut life) = waiting::since(&mut transaction, component, EVER).await?.pop() else { return Ok(None) };
        life.pointer.generation = life.answering;
        let overhauls = order::of_component(&mut transaction, component).await?;
        let inputs = inputs_of(&mut transaction, component, life, &overhauls).await?;
        Ok(Some(LifeInputs { unestimated: Vec::new(), ..inputs }))
    }

    pub(crate) async fn newer_input_waits(&self, lease: &Lease, overhaul_index: u32) -> Result<bool, StoreError> {
        let mut transaction = self.read(&lease.component.operator).await?;
        let waiting = waiting::since(&mut transaction, &lease.component, lease.input_revision).await?;
        Ok(waiting.iter().any(|life| life.pointer.overhaul_index == i64::from(overhaul_index)))
    }
}

async fn inputs_of(
    connection: &mut Connection,
    component: &Component,
    Waiting { pointer, answering }: Waiting,
    overhauls: &Overhauls,
) -> Result<LifeInputs, StoreError> {
    let estimates = estimates::of_life(connection, component, pointer, EstimateRange::ALL).await?;
    let mut unestimated: Vec<(Upload, Timestamp)> = if pointer.generation == answering {
        received::waiting(connection, component).await?
    } else {
        let estimated: HashSet<_> = estimates.iter().map(|estimate| &estimate.upload_id).collect();
        let mut all = received::not_voided(connection, component).await?;
        all.retain(|(upload, _)| !estimated.contains(&upload.upload_id));
        all
    };
    unestimated
        .retain(|(upload, _)| overhauls.life_at(upload.flight_hours, upload.recorded_at) == pointer.overhaul_index);
    let retried = retried::of_component(connection, component).await?;
    for (upload, received_at) in &mut unestimated {
        let retried_at = retried.get(upload.upload_id.as_str()).copied();
        *received_at = retried_at.map_or(*received_at, |retried_at| retried_at.max(*received_at));
    }
    Ok(LifeInputs {
        life: pointer.life(component)?,
        generation: generations::of_life(connection, component, pointer).await?,
        began_fh: overhauls.began_fh(pointer.overhaul_index),
        unestimated: sensor_configurations::in_force(connection, &component.operator, unestimated).await?,
        estimates,
        states: states::of_life(connection, component, pointer, StateRange::ALL).await?,
        planned: match pointer.overhaul_index == overhauls.newest_life() {
            true => planned(connection, component).await?,
            false => None,
        },
    })
}

/// What is planned for the tail that a component is on.
async fn planned(connection: &mut Connection, component: &Component) -> Result<Option<Planned>, StoreError> {
    let operator = &component.operator;
    let Some(tail) = plans::tail_of(connection, component).await? else { return Ok(None) };
    let newest = versions::newest::<Plan>(connection, operator, &tail).await?;
    let Some(newest) = newest.filter(|newest| !newest.noun.is_empty()) else { return Ok(None) };
    let utilisation_fh_per_day = utilisation::flown(connection, operator, &tail).await?.fh_per_day;
    Ok(Some(Planned { plan: newest.noun, utilisation_fh_per_day }))
}
