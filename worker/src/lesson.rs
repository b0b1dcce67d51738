//! Learning fleet priors from lives that ended in failure, beside the analyses.
//!
//! A learned prior judges the lives that begin after it was learned; lives that go on keep theirs. It is
//! learned per operator and part number, from the bundle's own prior and all finished lives: never from
//! those of another operator.

use std::{sync::Arc, time::Duration};

use pipeline::{PastLife, Prior};
use store::{FinishedLife, Lesson, PriorRecord, Store};
use tokio::task::spawn_blocking;
use tokio_util::sync::CancellationToken;

use crate::{Analyst, Settings, WorkerError, models::Models, wait};

/// How often to ask whether there is something to learn.
const PAUSE: Duration = Duration::from_secs(10);

/// Learns until `shutdown`.
pub async fn learn(store: Store, analyst: Arc<Analyst>, settings: Settings, shutdown: CancellationToken) {
    let settings = Settings { idle: PAUSE, ..settings };
    while !shutdown.is_cancelled() {
        match store.lessons().await {
            // A lesson may take minutes. It is a function of what the store holds, so one that is left is taken again.
            Ok(lessons) => tokio::select! {
                () = take_all(lessons, &store, &analyst.models, &settings) => {}
                () = shutdown.cancelled() => {}
            },
            Err(error) => tracing::error!(%error, "cannot look for what there is to learn"),
        }
        wait(std::future::pending(), &settings, &shutdown).await;
    }
}

/// Takes one lesson after the other; one that fails keeps no other waiting.
async fn take_all(lessons: Vec<Lesson>, store: &Store, models: &Models, settings: &Settings) {
    for lesson in lessons {
        if let Err(error) = take(&lesson, store, models, settings).await {
            let Lesson { operator, part_number, .. } = &lesson;
            tracing::error!(%operator, %part_number, %error, "cannot learn from finished lives");
        }
    }
}

async fn take(lesson: &Lesson, store: &Store, models: &Models, settings: &Settings) -> Result<(), WorkerError> {
    let Lesson { operator, part_number, model: hash, .. } = lesson;
    let finished = store.finished_lives(operator, part_number, hash).await?;
    let lives = finished.len() as u32;
    let past = |FinishedLife { estimates, began_fh, failure_fh, .. }| PastLife { estimates, began_fh, failure_fh };
    let past = finished.into_iter().map(past);
    let (past, model): (Vec<PastLife>, _) = (past.collect(), models.get(hash).await?);
    let teacher = model.clone();
    let learned = spawn_blocking(move || teacher.learn_prior(&past)).await?;
    // Lives of which nothing was ever seen leave the bundle's own: that is what they taught.
    let prior = learned.unwrap_or_else(|_| Prior::clone(model.prior()));
    let record = PriorRecord {
        part_number: part_number.clone(),
        hash: prior.hash,
        model: *hash,
        parent: model.prior().hash,
        lives,
        learned_at: (settings.clock)(),
    };
    store.add_prior(operator, &record, &prior.to_bytes()).await?;
    tracing::info!(%operator, %part_number, prior = %record.hash, lives, "learned a prior");
    Ok(())
}
