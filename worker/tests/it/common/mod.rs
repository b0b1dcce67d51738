//! What the worker's tests share: a real store, the bundle that ships, a healthy actuator.

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use domain::{Actor, MapSamples, Mask, Reading, Timestamp, Upload};
use pipeline::Model;
use store::{Options, Store};
use tokio_util::sync::CancellationToken;

/// The bundle that ships.
pub const BUNDLE: &[u8] = include_bytes!("../../../../models/default.json");

/// When the first upload is recorded.
pub fn start() -> Timestamp {
    "2026-03-01T00:00:00Z".parse().unwrap()
}

/// When everything arrives: later than anything is recorded.
pub fn now() -> Timestamp {
    start().plus_hours(1000.0)
}

pub async fn store(folder: &tempfile::TempDir) -> (Store, Model) {
    let url = format!("sqlite:{}", folder.path().join("worker.sqlite").display());
    let store = Store::open(&url, Options::default()).await.unwrap();
    let model = Model::from_bytes(BUNDLE).unwrap();
    store.register_bundle(&model.summary(), BUNDLE, Actor::Cli.at(start())).await.unwrap();
    store.activate_bundle(&model.summary().hash, Actor::Cli.at(now())).await.unwrap();
    (store, model)
}

/// A healthy actuator, sampled without noise.
pub fn upload(model: &Model, mask: &Mask, index: u32) -> Upload {
    let flight_hours = 4.0 * f64::from(index);
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: format!("u{index}").parse().unwrap(),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
        flight_hours,
        flight_cycles: None,
        recorded_at: start().plus_hours(3.0 * flight_hours),
        reading: Reading::Samples(MapSamples {
            mask_id: mask.id(),
            samples: vec![Some(model.summary().k_nom); mask.len()],
            load_ratio: None,
            sample_noise: None,
        }),
        strain: None,
        air_data: None,
        temperature_c: None,
        winding_temperature_c: None,
        on_ground: None,
    }
}

/// How the worker runs.
pub fn settings() -> worker::Settings {
    worker::Settings {
        concurrency: NonZeroUsize::new(2).unwrap(),
        lease: Duration::from_secs(60),
        idle: Duration::from_millis(20),
        drain: Duration::from_secs(5),
        clock: Arc::new(now),
    }
}

/// Runs a worker until nothing is pending.
pub async fn work(store: &Store) {
    let stop = CancellationToken::new();
    let running = tokio::spawn(worker::run(store.clone(), settings(), stop.clone()));
    while store.pending().await.unwrap() > 0 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    stop.cancel();
    running.await.unwrap();
}
