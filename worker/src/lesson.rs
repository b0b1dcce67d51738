//! Learning priors from lives that are over, beside the analyses.
//!
//! A learned prior judges the lives that begin after it was learned; lives that go on keep theirs. It is
//! learned per operator and part number, from the bundle's own prior and all lives that ended: never from
//! those of another operator. One worker of all takes a lesson, by a claim on it.

use std::{sync::Arc, time::Duration};

use pipeline::PastLife;
use store::{FinishedLife, Lesson, PriorRecord, RemovedLife, Store};
use tokio::task::spawn_blocking;
use tokio_util::sync::CancellationToken;

use crate::{Analyst, Settings, WorkerError, models::Models, wait};

/// How often to ask whether there is something to learn.
const PAUSE: Duration = Duration::from_secs(10);
/// How long a lesson is one worker's at first: longer than one takes, and the pause after one that fails.
const CLAIM: Duration = Duration::from_secs(600);

/// Learns until `shutdown`.
pub async fn learn(store: Store, analyst: Arc<Analyst>, settings: Settings, shutdown: CancellationToken) {
    let settings = Settings { idle: PAUSE, ..settings };
    while !shutdown.is_cancelled() {
        match store.lessons().await {
            Ok(lessons) => {
                for lesson in lessons {
                    if !shutdown.is_cancelled() {
                        claim_and_take(&lesson, &store, &analyst.models, &settings, &shutdown).await;
                    }
                }
            }
            Err(error) if error.is_outage() => {}
            Err(error) => tracing::error!(%error, "cannot look for what there is to learn"),
        }
        wait(std::future::pending(), &settings, &shutdown).await;
    }
}

/// Takes a lesson unless another worker does; one that fails keeps no other waiting.
async fn claim_and_take(
    lesson: &Lesson,
    store: &Store,
    models: &Models,
    settings: &Settings,
    shutdown: &CancellationToken,
) {
    let taken = async {
        if store.claim_lesson(lesson, CLAIM).await? {
            tokio::select! {
                taken = take(lesson, store, models, settings) => taken?,
                // A lesson may take minutes. It is a function of what the store holds, so another worker takes it anew.
                () = shutdown.cancelled() => store.release_lesson(lesson).await?,
            }
        }
        Ok::<_, WorkerError>(())
    };
    if let Err(error) = taken.await
        && !error.is_outage()
    {
        let Lesson { operator, part_number, .. } = lesson;
        tracing::error!(%operator, %part_number, %error, "cannot learn from finished lives");
    }
}

async fn take(lesson: &Lesson, store: &Store, models: &Models, settings: &Settings) -> Result<(), WorkerError> {
    let Lesson { operator, part_number, model: hash, .. } = lesson;
    let finished = store.finished_lives(operator, part_number, hash).await?;
    let lives = finished.len() as u32;
    let failed = |FinishedLife { estimates, began_fh, failure_fh, .. }| {
        let failure_fh = Some(failure_fh);
        PastLife { estimates, began_fh, failure_fh }
    };
    let removed = |RemovedLife { estimates, began_fh, .. }| PastLife { estimates, began_fh, failure_fh: None };
    let mut past: Vec<PastLife> = finished.into_iter().map(failed).collect();
    past.extend(store.removed_lives(operator, part_number, hash).await?.into_iter().map(removed));
    let model = models.get(hash).await?;
    let teacher = model.clone();
    let prior = spawn_blocking(move || teacher.learn_prior(&past)).await??;
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
