//! The bundle that ships inside the binary; `models/README.md` has the command that made it.

use anyhow::{Context, Result};
use domain::{Actor, Timestamp};
use pipeline::Model;
use store::Store;

static BUNDLE: &[u8] = include_bytes!("../../models/default.json");

/// Registers the default bundle, and activates it where none is active yet.
pub async fn provide(store: &Store, now: Timestamp) -> Result<()> {
    let model = Model::from_bytes(BUNDLE).context("the bundle inside this binary")?;
    let summary = model.summary();
    store.register_bundle(&summary, BUNDLE, Actor::Service.at(now)).await?;
    if !store.bundles().await?.iter().any(|bundle| bundle.active) {
        store.activate_bundle(&summary.hash, Actor::Service.at(now)).await?;
    }
    Ok(())
}
