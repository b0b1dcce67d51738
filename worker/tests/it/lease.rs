//! The worker between a real store and the bundle that ships.

use std::time::Duration;

use crate::common::{now, settings, store, upload, work};
use domain::{Actor, Coordinate, Mask, OperatorId, SetAsideReason};
use store::{Receipt, UploadState};
use worker::Analyst;

#[tokio::test]
async fn uploads_become_estimates_states_and_a_prognosis() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let mask = &model.bundle().masks()[0];
    for index in 0..20 {
        assert_eq!(store.accept(&operator, upload(&model, mask, index), now()).await.unwrap(), Receipt::Accepted);
    }
    work(&store).await;
    let record = store.upload(&operator, &"u7".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!(record.state, UploadState::Processed);
    let diagnosis = record.estimate.unwrap().usable().unwrap().clone();
    assert!(diagnosis.fault_vector.values()[0] < 0.02, "{diagnosis:?}");
    let component = upload(&model, mask, 0).component(&operator);
    let states = store.states(&component, None, None, None, None, 100).await.unwrap();
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
    store.register_bundle(&summary, body, Actor::Cli.at(now())).await.unwrap();
    let mask = &model.bundle().masks()[0];
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

#[tokio::test]
async fn an_upload_whose_hours_or_time_cannot_be_is_set_aside_and_states_rest_on_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let mask = &model.bundle().masks()[0];
    for index in 0..8 {
        let mut upload = upload(&model, mask, index);
        if index == 3 {
            upload.flight_hours += 5000.0;
        }
        if index == 5 {
            upload.recorded_at = now().plus_hours(24.5);
        }
        store.accept(&operator, upload, now()).await.unwrap();
    }
    work(&store).await;
    for (id, word) in [("u3", "5012 fh"), ("u5", "24.5 hours after it was received")] {
        let record = store.upload(&operator, &id.parse().unwrap()).await.unwrap().unwrap();
        let UploadState::SetAside { reason, detail } = record.state else { panic!("{id}: {:?}", record.state) };
        assert_eq!(reason, SetAsideReason::ImplausibleHours);
        assert!(detail.contains(word), "{detail}");
    }
    let component = upload(&model, mask, 0).component(&operator);
    let states = store.states(&component, None, None, None, None, 100).await.unwrap();
    assert_eq!(states.iter().map(|state| state.observations).sum::<usize>(), 4, "u0, u1, u2 and u4: {states:?}");
    let installed = store.installed(&operator, &"EC-MXA".parse().unwrap()).await.unwrap();
    assert_eq!(installed[0].prognosis.clone().unwrap().as_of.flight_hours, 28.0);
}

/// The clock of the service was five years behind when uploads came; then it is set, and they are retried.
#[tokio::test]
async fn a_retried_upload_is_judged_by_the_clock_of_its_retry_also_when_results_are_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let mask = &model.bundle().masks()[0];
    let behind = now().plus_hours(-5.0 * 8766.0);
    for index in 0..8 {
        store.accept(&operator, upload(&model, mask, index), behind).await.unwrap();
    }
    work(&store).await;
    assert_eq!(store.work_figures().await.unwrap().set_aside, 8);
    for index in 0..7 {
        let id = format!("u{index}").parse().unwrap();
        store.retry_upload(&operator, &id, Actor::Cli.at(now())).await.unwrap();
    }
    work(&store).await;
    assert_eq!(store.work_figures().await.unwrap().set_aside, 1);
    let digest = store.digest().await.unwrap();
    assert_eq!(digest.estimates, 7);
    let mut last = None;
    loop {
        last = store.forget_derived(last.as_ref(), now()).await.unwrap();
        if last.is_none() {
            break;
        }
    }
    work(&store).await;
    assert_eq!(store.digest().await.unwrap(), digest);
    assert!(store.verify().await.unwrap().damaged.is_empty());
}

/// Nothing is forecast for data that are not the newest; the estimate is kept.
#[tokio::test]
async fn a_forecast_is_left_to_newer_uploads_that_wait() {
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = store(&folder).await;
    let operator = OperatorId::default();
    let mask = &model.bundle().masks()[0];
    let analyst = Analyst::new(store.clone(), settings().clock);
    let accept = async |index| store.accept(&operator, upload(&model, mask, index), now()).await.unwrap();
    let lease = async || store.lease(Duration::from_secs(60)).await.unwrap().unwrap();
    let forecast_at = async || {
        let installed = store.installed(&operator, &"EC-MXA".parse().unwrap()).await.unwrap();
        installed[0].prognosis.as_ref().unwrap().as_of.flight_hours
    };
    for index in 0..17 {
        accept(index).await;
    }
    work(&store).await;
    accept(17).await;
    let first = lease().await;
    accept(18).await;
    analyst.serve(&first).await.unwrap();
    let record = store.upload(&operator, &"u17".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!((record.state, forecast_at().await), (UploadState::Processed, 64.0));
    analyst.serve(&lease().await).await.unwrap();
    assert_eq!(forecast_at().await, 72.0);
}

/// A worker that has never seen a life goes on from the checkpoint that another one left.
#[tokio::test]
async fn a_new_worker_goes_on_where_another_one_stopped() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let ((in_parts, model), (at_once, _)) = (store(&folders[0]).await, store(&folders[1]).await);
    let operator = OperatorId::default();
    let mask = &model.bundle().masks()[0];
    let received_at = now().plus_hours(1000.0);
    for part in [0..140, 140..160] {
        for index in part {
            for store in [&in_parts, &at_once] {
                store.accept(&operator, upload(&model, mask, index), received_at).await.unwrap();
            }
        }
        work(&in_parts).await;
    }
    work(&at_once).await;
    let component = upload(&model, mask, 0).component(&operator);
    let states = in_parts.states(&component, None, None, None, None, 100).await.unwrap();
    let wanted: Vec<_> = states.iter().map(|state| (state.block, state.digest)).collect();
    let kept = in_parts.checkpoint(&component, 0, 1, &wanted).await.unwrap().unwrap();
    assert_eq!(kept.block, 24, "the twenty-fifth block's");
    assert_eq!(in_parts.digest().await.unwrap(), at_once.digest().await.unwrap());
}
