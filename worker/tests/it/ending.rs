//! How a worker ends, and how it does not: a panic in a part of it ends nothing, and an analysis that takes
//! too long is handed back.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

use crate::common::{now, settings, store, upload, work};
use domain::OperatorId;
use store::Store;
use tokio_util::sync::CancellationToken;

async fn accept(store: &Store, model: &pipeline::Model, uploads: u32) {
    let mask = &model.bundle().masks()[0];
    for index in 0..uploads {
        store.accept(&OperatorId::default(), upload(model, mask, index), now()).await.unwrap();
    }
}

#[tokio::test]
async fn a_part_that_panics_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    accept(&store, &model, 8).await;
    // Results ask for the time; the first answer is a panic in the middle of a lease.
    let asked = Arc::new(AtomicU32::new(0));
    let times = asked.clone();
    let clock = move || {
        assert!(times.fetch_add(1, Ordering::Relaxed) > 0, "the first time is not told");
        now()
    };
    let settings = worker::Settings { clock: Arc::new(clock), lease: Duration::from_millis(500), ..settings() };
    let stop = CancellationToken::new();
    let running = tokio::spawn(worker::run(store.clone(), settings, stop.clone()));
    while store.pending().await.unwrap() > 0 {
        assert!(!running.is_finished(), "the worker ended");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert!(asked.load(Ordering::Relaxed) > 1, "the clock never told the time");
    stop.cancel();
    running.await.unwrap();
}

#[tokio::test]
async fn an_analysis_that_outlives_the_drain_is_handed_back() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    accept(&store, &model, 60).await;
    let settings = worker::Settings { drain: Duration::ZERO, ..settings() };
    let stop = CancellationToken::new();
    let running = tokio::spawn(worker::run(store.clone(), settings, stop.clone()));
    // Nothing else takes the component while it is leased.
    while store.lease(Duration::from_micros(1)).await.unwrap().is_some() {
        assert_eq!(store.pending().await.unwrap(), 60);
    }
    stop.cancel();
    running.await.unwrap();
    assert_eq!(store.pending().await.unwrap(), 60, "the analysis ended before the stop");
    let lease = store.lease(Duration::from_micros(1)).await.unwrap();
    assert!(lease.is_some(), "the component was not handed back");
    work(&store).await;
}
