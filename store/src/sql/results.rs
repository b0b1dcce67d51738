//! What a worker reads for a lease and what it writes: one transaction, refused when fenced.

use std::collections::HashMap;

use domain::{Component, ContentHash, SetAside, Timestamp};

use super::{
    Connection, Engine, aside, checkpoints,
    history::{self, BlockEnd, EstimateRange, StateRange},
    lives::{self, LifePointer},
    prognoses, queue,
    row::{corrupt, encode},
    sensor_configurations, uploads,
    write::{Reach, Write},
};
use crate::{Completion, Lease, LifeCursor, LifeInputs, LifeResults, StoreError};

impl Engine {
    pub(crate) async fn life_inputs(&self, lease: &Lease) -> Result<LifeInputs, StoreError> {
        let component = &lease.component;
        let mut transaction = self.read(&component.operator).await?;
        let pointer = pointer(&mut transaction, component).await?;
        let waiting = uploads::waiting(&mut transaction, component).await?;
        Ok(LifeInputs {
            life: pointer.life(component)?,
            generation: lives::generation(&mut transaction, component, pointer).await?,
            unestimated: sensor_configurations::in_force(&mut transaction, &component.operator, waiting).await?,
            estimates: history::estimates(&mut transaction, component, pointer, EstimateRange::ALL).await?,
            states: history::states(&mut transaction, component, pointer, StateRange::ALL).await?,
        })
    }

    pub(crate) async fn complete(&self, lease: &Lease, results: LifeResults) -> Result<Completion, StoreError> {
        self.write(Complete::new(lease, results)?).await
    }
}

async fn pointer(connection: &mut Connection, component: &Component) -> Result<LifePointer, StoreError> {
    let newest = lives::newest(connection, component).await?;
    newest.ok_or_else(|| corrupt(&("lives", component), "a component in the queue has no life"))
}

/// Results as rows: encoded by the caller, so that the writer only writes.
struct Complete {
    lease: Lease,
    estimates: Vec<(LifeCursor, String)>,
    set_aside: Vec<SetAside>,
    excluded: Vec<SetAside>,
    states_from: Option<i64>,
    states: Vec<(BlockEnd, String)>,
    /// The digest of each of the states.
    digests: HashMap<i64, ContentHash>,
    checkpoints: Vec<checkpoints::Draft>,
    prognosis: Option<prognoses::Draft>,
    now: Timestamp,
}

impl Complete {
    fn new(lease: &Lease, results: LifeResults) -> Result<Self, StoreError> {
        let LifeResults { estimates, set_aside, excluded, states_from, states, checkpoints, prognosis, now } = results;
        let first = states.iter().map(|state| state.block).min();
        assert!(first.is_none_or(|first| states_from.is_some_and(|from| from <= first)), "states before states_from");
        let estimates = estimates.iter().map(|e| Ok((LifeCursor::from(e), encode("estimate", e)?)));
        let digests = states.iter().map(|state| (state.block.cast_signed(), state.digest)).collect();
        let checkpoints = checkpoints.into_iter().map(|one| checkpoints::Draft::of(&lease.component, one));
        let states = states.iter().map(|state| {
            let end = BlockEnd { block: state.block.cast_signed(), flight_hours: state.as_of.flight_hours };
            Ok((end, encode("state", state)?))
        });
        Ok(Self {
            lease: lease.clone(),
            estimates: estimates.collect::<Result<_, StoreError>>()?,
            set_aside,
            excluded,
            states_from: states_from.map(u64::cast_signed),
            states: states.collect::<Result<_, StoreError>>()?,
            digests,
            checkpoints: checkpoints.collect(),
            prognosis: prognosis.as_ref().map(prognoses::Draft::of).transpose()?,
            now,
        })
    }
}

impl Write for Complete {
    type Output = Completion;

    fn reach(&self) -> Reach<'_> {
        Reach::Component(&self.lease.component)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Completion, StoreError> {
        if !queue::finish(connection, &self.lease, now).await? {
            return Ok(Completion::Fenced);
        }
        let component = &self.lease.component;
        let pointer = pointer(connection, component).await?;
        for (at, body) in &self.estimates {
            history::insert_estimate(connection, component, pointer, at, body).await?;
            let key = uploads::known_key(connection, component, &at.upload_id).await?;
            uploads::leave_inbox(connection, &key).await?;
        }
        for one in &self.set_aside {
            aside::set_aside(connection, component, one, self.now).await?;
        }
        aside::exclude(connection, component, pointer, &self.excluded).await?;
        if let Some(from) = self.states_from {
            history::delete_states(connection, component, pointer, from).await?;
            checkpoints::delete_outdated(connection, component, pointer, from, &self.digests).await?;
        }
        for (at, body) in &self.states {
            history::insert_state(connection, component, pointer, *at, body).await?;
        }
        checkpoints::keep(connection, component, pointer, &self.checkpoints).await?;
        self.serve(connection, pointer).await?;
        Ok(Completion::Done)
    }
}

impl Complete {
    /// Serves the new prognosis; without one the previous stays, as long as any estimate counts.
    async fn serve(&self, connection: &mut Connection, pointer: LifePointer) -> Result<(), StoreError> {
        let component = &self.lease.component;
        if let Some(draft) = &self.prognosis {
            prognoses::issue(connection, &self.lease, pointer, self.now, draft).await?;
            lives::serve_prognosis(connection, component, pointer, Some(self.lease.fence)).await
        } else if history::has_counting_estimate(connection, component, pointer).await? {
            Ok(())
        } else {
            lives::serve_prognosis(connection, component, pointer, None).await
        }
    }
}
