//! Results that a worker writes for a lease: one transaction, refused when fenced.

use std::collections::HashMap;

use domain::{ContentHash, SetAside, Timestamp};

use super::super::{
    Connection, Engine,
    board::following::{self, Flown},
    ground::{
        key::LifePointer,
        row::encode,
        write::{Reach, Write},
    },
    lives::life,
    queue::revisions,
    results::{
        checkpoints, estimates, prognoses,
        states::{self, BlockEnd},
    },
    uploads::{aside, inbox, keys},
};
use crate::{Completion, Lease, LifeCursor, LifeResults, StoreError};

impl Engine {
    pub(crate) async fn complete(&self, lease: &Lease, results: Vec<LifeResults>) -> Result<Completion, StoreError> {
        let lives = results.into_iter().map(|one| LifeDraft::of(lease, one)).collect::<Result<_, _>>()?;
        self.write(Complete { lease: lease.clone(), lives }).await
    }
}

struct Complete {
    lease: Lease,
    lives: Vec<LifeDraft>,
}

impl Write for Complete {
    type Output = Completion;

    fn reach(&self) -> Reach<'_> {
        Reach::Component(&self.lease.component)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Completion, StoreError> {
        if !revisions::finish(connection, &self.lease, now).await? {
            return Ok(Completion::Fenced);
        }
        let mut flown = self.flown();
        for life in &self.lives {
            if life.write(connection, &self.lease).await? {
                flown = Flown::Otherwise;
            }
        }
        following::follow(connection, &self.lease.component, flown).await?;
        Ok(Completion::Done)
    }
}

impl Complete {
    /// When the uploads were recorded that it estimates.
    fn flown(&self) -> Flown {
        let recorded_at = self.lives.iter().flat_map(|life| &life.estimates).map(|(at, _)| at.recorded_at.micros());
        let ends = recorded_at.clone().min().zip(recorded_at.max());
        ends.map_or(Flown::Unchanged, |(first, last)| Flown::More(first..=last))
    }
}

/// Results as rows: encoded by the caller, so that the writer only writes.
struct LifeDraft {
    pointer: LifePointer,
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

impl LifeDraft {
    fn of(lease: &Lease, results: LifeResults) -> Result<Self, StoreError> {
        let pointer =
            LifePointer { overhaul_index: results.overhaul_index.into(), generation: results.generation.into() };
        let LifeResults { estimates, set_aside, excluded, states_from, states, checkpoints, prognosis, now, .. } =
            results;
        let first = states.iter().map(|state| state.block).min();
        assert!(first.is_none_or(|first| states_from.is_some_and(|from| from <= first)), "states before states_from");
        let estimates = estimates.iter().map(|e| Ok((LifeCursor::from(e), encode("estimate", e)?)));
        let digests = states.iter().map(|state| (state.block.cast_signed(), state.digest)).collect();
        let checkpoints = checkpoints.into_iter().map(|one| checkpoints::Draft::new(&lease.component, one));
        let states = states.iter().map(|state| {
            let end = BlockEnd { block: state.block.cast_signed(), flight_hours: state.as_of.flight_hours };
            Ok((end, encode("state", state)?))
        });
        Ok(Self {
            pointer,
            estimates: estimates.collect::<Result<_, StoreError>>()?,
            set_aside,
            excluded,
            states_from: states_from.map(u64::cast_signed),
            states: states.collect::<Result<_, StoreError>>()?,
            digests,
            checkpoints: checkpoints.collect(),
            prognosis: prognosis.as_ref().map(prognoses::Draft::from_prognosis).transpose()?,
            now,
        })
    }

    /// Writes them; tells whether other uploads count than before, but for those that are estimated now.
    async fn write(&self, connection: &mut Connection, lease: &Lease) -> Result<bool, StoreError> {
        let (component, pointer) = (&lease.component, self.pointer);
        let replaced = life::let_answer(connection, component, pointer).await?;
        for (at, body) in &self.estimates {
            estimates::insert(connection, component, pointer, at, body).await?;
            let key = keys::known_key(connection, component, &at.upload_id).await?;
            inbox::leave_inbox(connection, &key).await?;
            if replaced {
                aside::readmit(connection, &key).await?;
            }
        }
        for one in &self.set_aside {
            aside::set_aside(connection, component, one, self.now).await?;
        }
        let excluded_others = aside::exclude(connection, component, pointer, &self.excluded).await?;
        if let Some(from) = self.states_from {
            states::delete_from(connection, component, pointer, from).await?;
            checkpoints::delete_outdated(connection, component, pointer, from, &self.digests).await?;
        }
        for (at, body) in &self.states {
            states::insert(connection, component, pointer, *at, body).await?;
        }
        checkpoints::keep(connection, component, pointer, &self.checkpoints).await?;
        self.serve(connection, lease).await?;
        Ok(replaced || excluded_others || !self.set_aside.is_empty())
    }

    /// Serves the new prognosis; without one the previous stays, as long as any estimate counts. Nothing is
    /// forecast any longer of a life that an overhaul has ended.
    async fn serve(&self, connection: &mut Connection, lease: &Lease) -> Result<(), StoreError> {
        let (component, pointer) = (&lease.component, self.pointer);
        let newest = life::newest(connection, component).await?;
        if newest.is_some_and(|newest| newest.overhaul_index > pointer.overhaul_index) {
            return Ok(());
        }
        if let Some(draft) = &self.prognosis {
            prognoses::issue(connection, lease, pointer, self.now, draft).await?;
            life::serve_prognosis(connection, component, pointer, Some(lease.fence)).await
        } else if estimates::has_counting_estimate(connection, component, pointer).await? {
            Ok(())
        } else {
            life::serve_prognosis(connection, component, pointer, None).await
        }
    }
}
