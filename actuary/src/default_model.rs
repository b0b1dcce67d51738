//! The bundle that ships inside the binary; `models/README.md` has the command that made it.

use anyhow::{Context, Result};
use domain::{Actor, Timestamp};
use pipeline::Model;
use prognosis::{Coefficient, PaceLaw};
use store::Store;

use crate::command::model::pace;

static BUNDLE: &[u8] = include_bytes!("../../models/default.json");

/// Engineering values of a fleet of missions: wear by about the square of the load, and a third more for 20 K.
const EXPONENT: Coefficient = Coefficient { mean: 2.0, sd: 0.3 };
const TEMPERATURE: Coefficient = Coefficient { mean: 0.3, sd: 0.1 };

/// The default bundle, ready for use.
pub fn model() -> Result<Model> {
    Model::from_bytes(BUNDLE).context("the bundle inside this binary")
}

/// Registers the default bundle, and activates it where none is active yet.
pub async fn provide(store: &Store, now: Timestamp) -> Result<()> {
    provide_file(store, BUNDLE, now).await
}

/// The same of the default bundle with engineering values of the pace of wear.
pub async fn provide_paced(store: &Store, now: Timestamp) -> Result<()> {
    provide_file(store, &pace::told(model()?.bundle(), PaceLaw::told(EXPONENT, TEMPERATURE)), now).await
}

async fn provide_file(store: &Store, bytes: &[u8], now: Timestamp) -> Result<()> {
    let model = Model::from_bytes(bytes).context("the bundle inside this binary")?;
    let summary = model.summary();
    store.register_bundle(&summary, bytes, Actor::Service.at(now)).await?;
    if !store.bundles().await?.iter().any(|bundle| bundle.active) {
        store.activate_bundle(&summary.hash, Actor::Service.at(now)).await?;
    }
    Ok(())
}
