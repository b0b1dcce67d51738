//! Lives that end in failure teach the prior of the lives that begin after them, and of no others.

use std::time::Duration;

use crate::common::{self, now, start, store, upload, work};
use domain::{Diagnosis, Estimate, EventKind, FaultVector, Finding, MaintenanceEvent, OperatorId, Outcome, Upload};
use pipeline::{Model, PastLife, Prior};
use store::{Completion, Lesson, LifeResults, Store};

/// Uploads of one life, hours between them.
const UPLOADS: u32 = 60;
const EVERY_FH: f64 = 10.0;

/// The `index`-th upload of a unit.
fn of_unit(model: &Model, unit: u32, index: u32) -> Upload {
    let mask = &model.bundle().masks()[0];
    let flight_hours = EVERY_FH * f64::from(index + 1);
    Upload {
        upload_id: format!("unit{unit}.{index}").parse().unwrap(),
        tail: format!("EC-{unit:03}").parse().unwrap(),
        serial_number: format!("{unit}").parse().unwrap(),
        flight_hours,
        recorded_at: start().plus_hours(flight_hours),
        ..upload(model, mask, 0)
    }
}

/// What a diagnosis of so many faults makes of it: a short that grows fast.
fn diagnosed(model: &Model, upload: &Upload, faults: usize) -> Estimate {
    let k1 = 0.002 * (upload.flight_hours / 120.0).exp();
    Estimate {
        upload_id: upload.upload_id.clone(),
        flight_hours: upload.flight_hours,
        recorded_at: upload.recorded_at,
        mask_id: upload.reading.mask_id(),
        model: model.summary().hash,
        numerics_version: domain::NUMERICS_VERSION,
        measurement: None,
        outcome: Outcome::Diagnosed(Diagnosis {
            fault_vector: FaultVector([k1, 0.0, 0.0, 0.5, 0.5][..faults].into()),
            sigma: [0.0075, 0.0075, 0.0075, 0.02, 0.02][..faults].into(),
            fit: None,
        }),
        load: None,
        temperature: None,
        load_ratio: None,
        on_ground: false,
    }
}

/// A unit of a part that was flown to its failure, its estimates of so many faults stored as a worker would have.
async fn live_and_fail(store: &Store, model: &Model, part: &str, unit: u32, faults: usize) {
    let operator = OperatorId::default();
    let of_part = |upload| Upload { part_number: part.parse().unwrap(), ..upload };
    let uploads: Vec<Upload> = (0..UPLOADS).map(|index| of_part(of_unit(model, unit, index))).collect();
    for upload in &uploads {
        store.accept(&operator, upload.clone(), now()).await.unwrap();
    }
    let lease = store.lease(Duration::from_secs(60)).await.unwrap().unwrap();
    let results = LifeResults {
        overhaul_index: 0,
        generation: 1,
        estimates: uploads.iter().map(|upload| diagnosed(model, upload, faults)).collect(),
        set_aside: Vec::new(),
        excluded: Vec::new(),
        states_from: None,
        states: Vec::new(),
        prognosis: None,
        checkpoints: Vec::new(),
        now: now(),
    };
    assert_eq!(store.complete(&lease, vec![results]).await.unwrap(), Completion::Done);
    let last = &uploads[uploads.len() - 1];
    let event = MaintenanceEvent {
        event_id: format!("unit{unit}.failed").parse().unwrap(),
        tail: last.tail.clone(),
        position: last.position.clone(),
        part_number: last.part_number.clone(),
        serial_number: last.serial_number.clone(),
        kind: EventKind::Finding(Finding::Failed),
        occurred_at: last.recorded_at,
        flight_hours: last.flight_hours,
        note: None,
    };
    store.record_event(&operator, &event, now()).await.unwrap();
}

#[tokio::test]
async fn finished_lives_teach_the_prior_of_later_ones() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let part = of_unit(&model, 0, 0).part_number;
    for unit in 0..Lesson::MIN_LIVES {
        live_and_fail(&store, &model, part.as_str(), unit, 5).await;
        // Nothing can be learned from these; their lesson comes first, and the other does not wait for it.
        live_and_fail(&store, &model, "A-1", 100 + unit, 1).await;
    }
    work(&store).await;
    learn(&store).await;
    assert_eq!(store.lessons().await.unwrap(), [], "the one that failed is left alone for a while");
    let learned = store.priors(&operator).await.unwrap().remove(0);
    assert_eq!(learned.part_number, part);
    assert_eq!((learned.lives, learned.parent), (Lesson::MIN_LIVES, model.summary().prior));
    let prior = Prior::from_bytes(&store.prior_body(&operator, &learned.hash).await.unwrap().unwrap()).unwrap();
    assert_eq!(prior.hash, learned.hash);
    let mean_rate = |prior: &Prior| -> f64 {
        prior
            .body
            .first()
            .rates_per_h
            .iter()
            .zip(&prior.body.first().one_sided.rate_weights)
            .map(|(rate, weight)| rate * weight)
            .sum()
    };
    assert!(mean_rate(&prior) > mean_rate(model.prior()), "these lives grow faster than the bundle's fleet");

    for index in 0..8 {
        store.accept(&operator, of_unit(&model, 77, index), now()).await.unwrap();
        store.accept(&operator, of_unit(&model, 0, UPLOADS + index), now()).await.unwrap();
    }
    work(&store).await;
    for (unit, expected) in [(77, learned.hash), (0, model.summary().prior)] {
        let tail = of_unit(&model, unit, 0).tail;
        let installed = store.installed(&operator, &tail).await.unwrap().remove(0);
        let prognosis = installed.prognosis.unwrap();
        assert_eq!(prognosis.prior, expected, "unit {unit}");
        let ensemble = prognosis.forecast.unwrap().ensemble;
        let taught = ensemble.as_ref().and_then(|ensemble| ensemble.coverage_of_past_forecasts).map(|past| past.lives);
        assert_eq!(taught, (unit == 77).then_some(Lesson::MIN_LIVES as usize), "{ensemble:?}");
        assert!(ensemble.is_none_or(|ensemble| (ensemble.weights.values().sum::<f64>() - 1.0).abs() < 1e-12));
    }
}

#[test]
fn a_life_with_an_estimate_of_other_faults_teaches_nothing() {
    let model = Model::from_bytes(common::BUNDLE).unwrap();
    let estimates =
        [5, 5, 1].iter().zip(0..).map(|(faults, index)| diagnosed(&model, &of_unit(&model, 1, index), *faults));
    let life = PastLife { estimates: estimates.collect(), began_fh: 0.0, failure_fh: Some(100.0) };
    let refused = model.learn_prior(&[life]).unwrap_err();
    assert_eq!(refused.to_string(), "the estimate of unit1.2 tells 1 faults, the bundle knows 5");
}

/// Runs a worker that has nothing to do but to learn, until it has.
async fn learn(store: &Store) {
    let stop = tokio_util::sync::CancellationToken::new();
    let running = tokio::spawn(worker::run(store.clone(), common::settings(), stop.clone()));
    while store.priors(&OperatorId::default()).await.unwrap().is_empty() {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    stop.cancel();
    running.await.unwrap();
}
