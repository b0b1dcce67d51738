use domain::{ContentHash, GenerationState, OperatorId, SetAsideReason};
use store::{Completion, HistoryOf, LifeRecord, ModelUse, Store, UploadState};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, LEASE, bundle, bundle_body, by_hand, component, day, drain, fail, later_upload, lease, life_inputs,
    operator, prior, results, set_aside, tail, upload,
};

async fn activate(store: &Store, name: &str) {
    store.register_bundle(&bundle(name), &bundle_body(name), by_hand(1.0)).await.unwrap();
    store.activate_bundle(&bundle(name).hash, by_hand(1.0)).await.unwrap();
}

/// A processed life of four uploads under bundle `one`, while `two` is active.
async fn judged_by_one(database: &Database) -> Store {
    let store = database.ready().await;
    for i in 0..4 {
        store.accept(&operator(), later_upload(&format!("u{i}"), "0001", 30.0 * f64::from(i)), day(0.0)).await.unwrap();
    }
    drain(&store).await;
    activate(&store, "two").await;
    store
}

async fn life(store: &Store, serial: &str) -> LifeRecord {
    store.component(&component(serial)).await.unwrap().unwrap().lives.remove(0)
}

/// Number, bundle and state of each generation of a life.
async fn generations(store: &Store, serial: &str) -> Vec<(u32, ContentHash, GenerationState)> {
    let life = life(store, serial).await;
    life.generations.iter().map(|one| (one.generation.number, one.generation.model, one.state)).collect()
}

/// Which bundle made the prognosis that is served.
async fn served_by(store: &Store) -> Option<ContentHash> {
    store.installed(&operator(), &tail("EC-MXA")).await.unwrap().remove(0).prognosis.map(|prognosis| prognosis.model)
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_new_generation_answers_once_it_is_whole_and_not_before(backend: Backend) {
    let database = Database::new(backend);
    let store = judged_by_one(&database).await;
    let (one, two) = (bundle("one").hash, bundle("two").hash);
    assert!(store.lease(LEASE).await.unwrap().is_none(), "an activation alone changes no life");
    assert_eq!(store.judge_all_lives_by(&two).await.unwrap(), 1);
    assert_eq!(store.judge_all_lives_by(&two).await.unwrap(), 0, "what waits already is not announced again");
    let waiting = ModelUse { model: two, answering: 0, waiting: 1 };
    assert!(store.model_use().await.unwrap().contains(&waiting));
    assert!(store.work_waits().await.unwrap());
    assert_eq!(
        generations(&store, "0001").await,
        [(1, one, GenerationState::Answers), (2, two, GenerationState::Waits)]
    );
    assert_eq!(served_by(&store).await, Some(one));
    store.accept(&operator(), later_upload("late", "0001", 20.0), day(2.0)).await.unwrap();
    assert_eq!(served_by(&store).await, Some(one));
    drain(&store).await;
    assert_eq!(
        generations(&store, "0001").await,
        [(1, one, GenerationState::Kept), (2, two, GenerationState::Answers)]
    );
    assert_eq!(served_by(&store).await, Some(two));
    let life = life(&store, "0001").await;
    assert_eq!(life.generation.number, 2);
    let estimates: Vec<u64> = life.generations.iter().map(|one| one.estimates).collect();
    assert_eq!(estimates, [4, 5], "the late upload is in the generation that takes over");
    assert!(!store.work_waits().await.unwrap());
    assert_eq!(store.pending().await.unwrap(), 0);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_generation_is_what_would_have_been_if_its_bundle_had_judged_from_the_beginning(backend: Backend) {
    let (switched, straight) = (Database::new(backend), Database::new(backend));
    let store = judged_by_one(&switched).await;
    store.judge_all_lives_by(&bundle("two").hash).await.unwrap();
    drain(&store).await;
    let other = straight.open().await;
    activate(&other, "two").await;
    for i in 0..4 {
        other.accept(&operator(), later_upload(&format!("u{i}"), "0001", 30.0 * f64::from(i)), day(0.0)).await.unwrap();
    }
    drain(&other).await;
    let of = async |store: &Store, of: HistoryOf| {
        let estimates = store.estimates(&component("0001"), of, None, None, None, 100).await.unwrap();
        (estimates, store.states(&component("0001"), of, None, None, None, 100).await.unwrap())
    };
    let answers = HistoryOf::default();
    assert_eq!(of(&store, answers).await, of(&other, answers).await);
    let first = of(&store, HistoryOf { generation: Some(1), ..answers }).await;
    assert!(first.0.iter().all(|estimate| estimate.model == bundle("one").hash), "what answered before is readable");
    assert_eq!((first.0.len(), first.1.len()), (4, 3));
    assert_eq!(of(&store, HistoryOf { generation: Some(3), ..answers }).await, (Vec::new(), Vec::new()));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn who_goes_back_before_a_generation_is_made_has_lost_nothing(backend: Backend) {
    let database = Database::new(backend);
    let store = judged_by_one(&database).await;
    let before = store.digest().await.unwrap();
    let (one, two) = (bundle("one").hash, bundle("two").hash);
    store.judge_all_lives_by(&two).await.unwrap();
    let building = lease(&store).await;
    let inputs = life_inputs(&store, &building).await;
    assert_eq!((inputs.generation.model, inputs.unestimated.len()), (two, 4));
    activate(&store, "one").await;
    assert_eq!(store.judge_all_lives_by(&one).await.unwrap(), 0);
    let late = store.complete(&building, vec![results(&inputs)]).await.unwrap();
    assert_eq!(late, Completion::Fenced, "who made the other generation comes too late");
    drain(&store).await;
    assert_eq!(generations(&store, "0001").await, [(1, one, GenerationState::Answers)]);
    assert_eq!(store.digest().await.unwrap(), before);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_life_goes_from_bundle_to_bundle_and_every_generation_has_a_number_of_its_own(backend: Backend) {
    let database = Database::new(backend);
    let store = judged_by_one(&database).await;
    let (one, two) = (bundle("one").hash, bundle("two").hash);
    for model in [two, one] {
        assert_eq!(store.judge_all_lives_by(&model).await.unwrap(), 1);
        drain(&store).await;
    }
    let expected =
        [(1, one, GenerationState::Kept), (2, two, GenerationState::Kept), (3, one, GenerationState::Answers)];
    assert_eq!(generations(&store, "0001").await, expected);
    let answers = ModelUse { model: one, answering: 1, waiting: 0 };
    assert!(store.model_use().await.unwrap().contains(&answers));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn uploads_that_were_set_aside_are_tried_again_by_a_new_generation(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let first = lease(&store).await;
    let mut found = results(&life_inputs(&store, &first).await);
    found.estimates.clear();
    found.states.clear();
    found.prognosis = None;
    found.set_aside = vec![set_aside("u1", SetAsideReason::NotEstimable)];
    store.complete(&first, vec![found]).await.unwrap();
    activate(&store, "two").await;
    store.judge_all_lives_by(&bundle("two").hash).await.unwrap();
    drain(&store).await;
    let record = store.upload(&operator(), &"u1".parse().unwrap()).await.unwrap().unwrap();
    assert_eq!((record.state, record.estimate.unwrap().model), (UploadState::Processed, bundle("two").hash));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn all_lives_of_all_operators_are_judged_each_by_its_newest_prior(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let elsewhere: OperatorId = "elsewhere".parse().unwrap();
    for i in 0..120 {
        store.accept(&operator(), upload(&format!("u{i}"), &format!("{i:04}")), day(0.0)).await.unwrap();
    }
    store.accept(&elsewhere, upload("u1", "0001"), day(0.0)).await.unwrap();
    store.add_prior(&operator(), &prior("learned", 10, 1.0), b"learned").await.unwrap();
    assert_eq!(store.judge_all_lives_by(&bundle("one").hash).await.unwrap(), 120, "a new prior is a new generation");
    assert_eq!(life(&store, "0119").await.generations[1].generation.prior, ContentHash::of(b"learned"));
    activate(&store, "two").await;
    assert_eq!(store.judge_all_lives_by(&bundle("two").hash).await.unwrap(), 121);
    let newest = life(&store, "0119").await.generations.pop().unwrap().generation;
    assert_eq!((newest.number, newest.model, newest.prior), (2, bundle("two").hash, bundle("two").prior));
    let unknown = store.judge_all_lives_by(&ContentHash::of(b"other")).await;
    assert!(matches!(unknown, Err(store::StoreError::UnknownBundle(_))), "{unknown:?}");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_finished_life_is_judged_by_what_was_issued_then_whatever_generation_answers_now(backend: Backend) {
    let database = Database::new(backend);
    let store = judged_by_one(&database).await;
    fail(&store, &operator(), "0001", 1000.0).await;
    let issued = async || store.issued_on_finished_lives(&operator(), 10.0, 10).await.unwrap().remove(0).prognoses;
    let before = issued().await;
    assert!(!before.is_empty());
    store.judge_all_lives_by(&bundle("two").hash).await.unwrap();
    drain(&store).await;
    assert_eq!(issued().await, before);
}
