//! The worker between a real store and the bundle that ships.

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use domain::{Coordinate, Mask, OperatorId, Timestamp, Upload};
use pipeline::Model;
use store::{Options, Receipt, Store, UploadState};
use tokio_util::sync::CancellationToken;

const BUNDLE: &[u8] = include_bytes!("../../models/default.json");

fn now() -> Timestamp {
    "2026-03-01T00:00:00Z".parse().unwrap()
}

async fn store(folder: &tempfile::TempDir) -> (Store, Model) {
    let url = format!("sqlite:{}", folder.path().join("worker.sqlite").display());
    let store = Store::open(&url, Options::default()).await.unwrap();
    let model = Model::from_bytes(BUNDLE).unwrap();
    store.register_bundle(&model.summary(), BUNDLE, now()).await.unwrap();
    store.activate_bundle(&model.summary().hash, now()).await.unwrap();
    (store, model)
}

/// A healthy actuator, sampled without noise.
fn upload(model: &Model, mask: &Mask, index: u32) -> Upload {
    let flight_hours = 4.0 * f64::from(index);
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: format!("u{index}").parse().unwrap(),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
        flight_hours,
        flight_cycles: None,
        recorded_at: now().plus_hours(3.0 * flight_hours),
        mask_id: mask.id(),
        samples: vec![Some(model.summary().k_nom); mask.len()],
        load_ratio: None,
        sample_noise: None,
        strain: None,
        air_data: None,
        temperature_c: None,
        winding_temperature_c: None,
        on_ground: None,
    }
}

/// Runs a worker until nothing is pending.
async fn work(store: &Store) {
    let settings = worker::Settings {
        concurrency: NonZeroUsize::new(2).unwrap(),
        lease: Duration::from_secs(60),
        idle: Duration::from_millis(20),
        clock: Arc::new(now),
    };
    let stop = CancellationToken::new();
    let running = tokio::spawn(worker::run(store.clone(), settings, stop.clone()));
    while store.pending().await.unwrap() > 0 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    stop.cancel();
    running.await.unwrap();
}

#[tokio::test]
async fn uploads_become_estimates_states_and_a_prognosis() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let mask = &model.bundle().masks[0];
    for index in 0..20 {
        assert_eq!(store.accept(&operator, upload(&model, mask, index), now()).await.unwrap(), Receipt::Accepted);
    }
    work(&store).await;
    let record = store.upload(&operator, &"u7".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!(record.state, UploadState::Processed);
    let diagnosis = record.estimate.unwrap().usable().unwrap().clone();
    assert!(diagnosis.fault_vector.values()[0] < 0.02, "{diagnosis:?}");
    let component = upload(&model, mask, 0).component(&operator);
    let states = store.states(&component, None, None, None, 100).await.unwrap();
    assert_eq!(states.iter().map(|state| state.block).collect::<Vec<_>>(), [0, 1, 2]);
    let installed = store.installed(&operator, &"EC-MXA".parse().unwrap()).await.unwrap();
    let prognosis = installed[0].prognosis.clone().unwrap();
    assert_eq!(prognosis.as_of.flight_hours, 76.0);
    assert!(prognosis.forecast.unwrap().probability_failed < 0.01);
}

#[tokio::test]
async fn an_upload_that_cannot_be_estimated_is_set_aside_and_stops_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    // A mask of a bundle whose maps have another length: published, but not for this life's bundle.
    let foreign = Mask::new(Coordinate::ElectricalAngleRad, 180, (0..30).collect()).unwrap();
    let mut summary = model.summary();
    let body = b"a bundle of another kind of map";
    summary.hash = domain::ContentHash::of(body);
    summary.masks = vec![foreign.clone()];
    store.register_bundle(&summary, body, now()).await.unwrap();
    let mask = &model.bundle().masks[0];
    for index in 0..8 {
        let mask = if index == 3 { &foreign } else { mask };
        store.accept(&operator, upload(&model, mask, index), now()).await.unwrap();
    }
    work(&store).await;
    let state = |id: &str| {
        let (store, operator, id) = (store.clone(), operator.clone(), id.parse().unwrap());
        async move { store.upload(&operator, &id).await.unwrap().unwrap().state }
    };
    assert!(matches!(state("u3").await, UploadState::SetAside { detail, .. } if detail.contains("180")));
    assert_eq!(state("u2").await, UploadState::Processed);
    assert_eq!(state("u4").await, UploadState::Processed);
}
