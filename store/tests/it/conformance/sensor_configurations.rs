use domain::Upload;
use store::{Addition, Completion, Store, StoreError, UploadState};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, component, configuration, day, drain, later_upload, lease, life_inputs, operator, results, tail,
    upload,
};

async fn add(store: &Store, tail_name: &str, from: f64, gain_noise: f64) -> Addition {
    let configuration = configuration(gain_noise);
    let tail = tail(tail_name);
    store.add_sensor_configuration(&operator(), &tail, day(from), &configuration, by_hand(50.0)).await.unwrap()
}

/// Gain noise of the configuration by which each upload of 0001 was estimated, in the order of the life.
async fn used(store: &Store) -> Vec<Option<f64>> {
    let history = store.estimates(&component("0001"), None, None, None, None, 100).await.unwrap();
    history.into_iter().map(|estimate| estimate.temperature).collect()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn configurations_are_listed_by_the_time_from_which_they_are_in_force(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    assert_eq!(add(&store, "EC-MXA", 5.0, 0.05).await, Addition::Added);
    assert_eq!(add(&store, "EC-MXA", 1.0, 0.01).await, Addition::Added);
    assert_eq!(add(&store, "EC-MXA", 9.0, 0.05).await, Addition::Added);
    assert_eq!(add(&store, "EC-MXA", 5.0, 0.05).await, Addition::Duplicate);
    assert_eq!(add(&store, "EC-MXA", 5.0, 0.06).await, Addition::Conflict);
    assert_eq!(add(&store, "EC-MXB", 5.0, 0.06).await, Addition::Added);
    let listed = store.sensor_configurations(&operator(), &tail("EC-MXA")).await.unwrap();
    let expected = [(1.0, 0.01), (5.0, 0.05), (9.0, 0.05)];
    assert_eq!(listed.len(), expected.len());
    for (one, (from, gain_noise)) in listed.into_iter().zip(expected) {
        let configuration = configuration(gain_noise);
        assert_eq!((one.effective_from, one.added_at, one.hash), (day(from), day(50.0), configuration.id()));
        assert_eq!(one.configuration, configuration);
    }
    let others = store.sensor_configurations(&"other".parse().unwrap(), &tail("EC-MXA")).await.unwrap();
    assert_eq!(others, []);
    let refused = store
        .add_sensor_configuration(&operator(), &tail("EC-MXA"), day(7.0), &configuration(f64::NAN), by_hand(50.0))
        .await;
    assert!(matches!(refused, Err(StoreError::Unrepresentable { .. })), "{refused:?}");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_upload_is_estimated_by_what_was_in_force_on_its_tail_when_it_was_recorded(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    add(&store, "EC-MXA", 2.0, 0.02).await;
    add(&store, "EC-MXA", 4.0, 0.04).await;
    add(&store, "EC-MXB", 0.0, 0.09).await;
    // Days 0 to 6; the component is on another tail on day 5.
    for i in 0..7 {
        let seen = later_upload(&format!("u{i}"), "0001", 10.0 * f64::from(i));
        let tail = tail(if i == 5 { "EC-MXB" } else { "EC-MXA" });
        store.accept(&operator(), Upload { tail, ..seen }, day(0.0)).await.unwrap();
    }
    drain(&store).await;
    let before = [None, None, Some(0.02), Some(0.02), Some(0.04), Some(0.09), Some(0.04)];
    assert_eq!(used(&store).await, before);
    // Backdated: only the uploads of its period are estimated again.
    assert_eq!(add(&store, "EC-MXA", 1.0, 0.01).await, Addition::Added);
    assert_eq!(store.pending().await.unwrap(), 1);
    assert_eq!(store.work_figures().await.unwrap().oldest_pending_since, Some(day(50.0)));
    drain(&store).await;
    assert_eq!(used(&store).await, [None, Some(0.01), Some(0.02), Some(0.02), Some(0.04), Some(0.09), Some(0.04)]);
    assert_eq!(add(&store, "EC-MXA", 3.5, 0.03).await, Addition::Added);
    assert_eq!(store.pending().await.unwrap(), 0, "nothing was recorded between days 3.5 and 4");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn what_is_voided_stays_so_and_what_is_set_aside_is_tried_again(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for id in ["kept", "voided", "aside"] {
        store.accept(&operator(), upload(id, "0001"), day(0.0)).await.unwrap();
    }
    store.void_upload(&operator(), &"voided".parse().unwrap(), by_hand(0.0)).await.unwrap();
    let lease = lease(&store).await;
    let mut results = results(&life_inputs(&store, &lease).await);
    results.estimates.retain(|estimate| estimate.upload_id.as_str() != "aside");
    results.set_aside.push(crate::fixture::set_aside("aside", domain::SetAsideReason::NotFinite));
    store.complete(&lease, vec![results]).await.unwrap();
    add(&store, "EC-MXA", -1.0, 0.01).await;
    let state = async |id: &str| store.upload(&operator(), &id.parse().unwrap()).await.unwrap().unwrap().state;
    assert_eq!(state("kept").await, UploadState::Pending);
    assert_eq!(state("aside").await, UploadState::Pending);
    assert_eq!(state("voided").await, UploadState::Voided { at: day(0.0) });
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_computed_by_another_configuration_are_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let early = lease(&store).await;
    let inputs = life_inputs(&store, &early).await;
    add(&store, "EC-MXA", -1.0, 0.01).await;
    assert_eq!(store.complete(&early, vec![results(&inputs)]).await.unwrap(), Completion::Fenced);
    drain(&store).await;
    assert_eq!(used(&store).await, [Some(0.01)]);
}
