//! The uplink of a simulated fleet: uploads as JSON, or as frames by keys that are made as aircraft need them.

use std::sync::Arc;

use anyhow::{Context, Result};
use clap::ValueEnum;
use domain::{Actor, FrameKeyId, FrameSubject, OperatorId};
use proto::frame::{InstallationKey, KeyCard};
use simulator::{Fetched, FrameKeys};
use store::{FrameKeyRecord, Store};
use tokio::sync::Mutex;

use crate::clock::Clock;

/// How uploads come down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Uplink {
    /// As JSON.
    #[default]
    Json,
    /// As frames, one ACARS block each.
    Frame,
}

/// Hands out keys of frames; those that are not there yet it makes.
pub struct KeyMaker {
    store: Store,
    installation: InstallationKey,
    operator: OperatorId,
    clock: Clock,
    known: Mutex<Vec<FrameKeyRecord>>,
}

impl std::fmt::Debug for KeyMaker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("KeyMaker")
    }
}

impl KeyMaker {
    /// Makes keys of an operator in a database.
    pub async fn of(
        store: Store,
        installation: InstallationKey,
        operator: OperatorId,
        clock: Clock,
    ) -> Result<Arc<dyn FrameKeys>> {
        let known = Mutex::new(store.frame_keys(&operator).await?);
        Ok(Arc::new(Self { store, installation, operator, clock, known }))
    }

    async fn record(&self, subject: &FrameSubject) -> Result<FrameKeyRecord> {
        let mut known = self.known.lock().await;
        let found = known.iter().find(|key| key.subject == *subject && key.revoked_at.is_none());
        if let Some(found) = found {
            return Ok(found.clone());
        }
        let bundle = match subject {
            FrameSubject::Actuator { mask_id, .. } => self.store.mask(mask_id).await?.map(|mask| mask.model),
            FrameSubject::Strain { .. } => None,
        };
        let (subject, operator, made_at) = (subject.clone(), self.operator.clone(), (self.clock)());
        let key = FrameKeyRecord { id: new_id()?, operator, subject, bundle, made_at, revoked_at: None };
        self.store.create_frame_key(&key, Actor::Cli).await?;
        known.push(key.clone());
        Ok(key)
    }
}

impl FrameKeys for KeyMaker {
    fn card<'a>(&'a self, subject: &'a FrameSubject) -> Fetched<'a> {
        Box::pin(async move {
            let FrameKeyRecord { id, operator, subject, .. } =
                self.record(subject).await.map_err(|error| format!("no frame key: {error:#}"))?;
            Ok(KeyCard { key: self.installation.derive(id, &operator, &subject), operator, subject })
        })
    }
}

/// The name of a new key.
pub fn new_id() -> Result<FrameKeyId> {
    let mut bytes = [0; 8];
    getrandom::fill(&mut bytes).context("the system gives no random numbers")?;
    Ok(FrameKeyId::new(bytes))
}
