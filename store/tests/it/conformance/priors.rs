use std::time::Duration;

use domain::{Component, ContentHash, OperatorId, PartNumber, Upload};
use store::{Lesson, Options, PriorRecord, Store, StoreError};
use test_case::test_case;
use tokio::task::JoinSet;

use crate::fixture::{
    Backend::{self, *},
    Database, HandClock, bundle, bundle_body, by_hand, component, day, fail, operator, prior, upload,
};

async fn learn(store: &Store, operator: &OperatorId, name: &str, lives: u32, learned_on: f64) {
    store.add_prior(operator, &prior(name, lives, learned_on), name.as_bytes()).await.unwrap();
}

async fn activate(store: &Store, name: &str) {
    store.register_bundle(&bundle(name), &bundle_body(name), by_hand(1.0)).await.unwrap();
    store.activate_bundle(&bundle(name).hash, by_hand(1.0)).await.unwrap();
}

/// Begins a life; the bundle and the prior to which it is pinned.
async fn begin(store: &Store, operator: &OperatorId, part: &str, serial: &str) -> (ContentHash, ContentHash) {
    let part_number: PartNumber = part.parse().unwrap();
    let upload = Upload { part_number: part_number.clone(), ..upload(&format!("{part}-{serial}"), serial) };
    store.accept(operator, upload, day(0.0)).await.unwrap();
    let unit = Component { operator: operator.clone(), part_number, ..component(serial) };
    let life = store.component(&unit).await.unwrap().unwrap().lives.remove(0);
    (life.generation.model, life.generation.prior)
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_prior_reads_back_and_adding_it_again_changes_nothing(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    learn(&store, &operator(), "second", 13, 2.0).await;
    for learned_on in [1.0, 3.0] {
        learn(&store, &operator(), "first", 10, learned_on).await;
    }
    let expected = [prior("first", 10, 1.0), prior("second", 13, 2.0)];
    assert_eq!(store.priors(&operator()).await.unwrap(), expected);
    let body = async |operator: &OperatorId, name: &str| {
        store.prior_body(operator, &ContentHash::of(name.as_bytes())).await.unwrap()
    };
    assert_eq!(body(&operator(), "first").await, Some(b"first".to_vec()));
    assert_eq!(body(&operator(), "third").await, None);
    let elsewhere = "elsewhere".parse().unwrap();
    assert_eq!(store.priors(&elsewhere).await.unwrap(), []);
    assert_eq!(body(&elsewhere, "first").await, None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_prior_of_other_bytes_or_of_an_unknown_bundle_is_refused(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let wrong = store.add_prior(&operator(), &prior("first", 10, 1.0), b"second").await;
    assert!(matches!(wrong, Err(StoreError::WrongHash { .. })), "{wrong:?}");
    let stray = PriorRecord { model: ContentHash::of(b"other"), ..prior("first", 10, 1.0) };
    let unknown = store.add_prior(&operator(), &stray, b"first").await;
    assert!(matches!(unknown, Err(StoreError::UnknownBundle(_))), "{unknown:?}");
    assert_eq!(store.priors(&operator()).await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_life_is_pinned_to_the_newest_prior_that_its_operator_learned_for_its_part_and_bundle(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let elsewhere: OperatorId = "elsewhere".parse().unwrap();
    let (one, own) = (bundle("one").hash, bundle("one").prior);
    let first = ContentHash::of(b"first");
    assert_eq!(begin(&store, &operator(), "EMA-500", "old").await, (one, own));
    learn(&store, &operator(), "first", 10, 2.0).await;
    learn(&store, &operator(), "before", 20, 1.0).await;
    assert_eq!(begin(&store, &operator(), "EMA-500", "new").await, (one, first));
    assert_eq!(begin(&store, &operator(), "EMA-500", "old").await, (one, own), "a life keeps its prior");
    assert_eq!(begin(&store, &operator(), "EMA-600", "new").await, (one, own), "a prior is of one part number");
    assert_eq!(begin(&store, &elsewhere, "EMA-500", "new").await, (one, own), "operators are a wall");
    activate(&store, "two").await;
    let (two, its_own) = (bundle("two").hash, bundle("two").prior);
    assert_eq!(begin(&store, &operator(), "EMA-500", "newer").await, (two, its_own), "a prior goes with its bundle");
    activate(&store, "one").await;
    learn(&store, &operator(), "third", 30, 3.0).await;
    assert_eq!(begin(&store, &operator(), "EMA-500", "newest").await, (one, ContentHash::of(b"third")));
    assert_eq!(begin(&store, &operator(), "EMA-500", "new").await, (one, first));
}

/// Lets lives begin and end, the serial numbers being those of a range.
async fn end_lives(store: &Store, operator: &OperatorId, serials: std::ops::Range<u32>) {
    for serial in serials {
        let serial = format!("{serial:03}");
        begin(store, operator, "EMA-500", &serial).await;
        fail(store, operator, &serial, 900.0).await;
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_lesson_waits_for_ten_lives_and_then_for_a_quarter_more(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let counts = async || -> Vec<u32> { store.lessons().await.unwrap().iter().map(|lesson| lesson.lives).collect() };
    end_lives(&store, &operator(), 0..9).await;
    begin(&store, &operator(), "EMA-500", "alive").await;
    assert!(counts().await.is_empty());
    end_lives(&store, &operator(), 9..10).await;
    let expected = Lesson {
        operator: operator(),
        part_number: component("any").part_number,
        model: bundle("one").hash,
        lives: 10,
    };
    assert_eq!(store.lessons().await.unwrap(), [expected]);
    learn(&store, &operator(), "first", 10, 1.0).await;
    end_lives(&store, &operator(), 10..12).await;
    assert!(counts().await.is_empty());
    end_lives(&store, &operator(), 12..13).await;
    assert_eq!(counts().await, [13]);
    learn(&store, &operator(), "first", 13, 2.0).await;
    assert_eq!(store.priors(&operator()).await.unwrap(), [prior("first", 13, 2.0)]);
    assert!(counts().await.is_empty(), "what teaches nothing new is not learned for ever");
    end_lives(&store, &operator(), 13..17).await;
    assert_eq!(counts().await, [17]);
    store.void_event(&operator(), &"end-of-000".parse().unwrap(), by_hand(2.0)).await.unwrap();
    assert!(counts().await.is_empty(), "a life that goes on teaches nothing");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn lessons_are_of_one_operator_and_of_the_active_bundle(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let elsewhere: OperatorId = "elsewhere".parse().unwrap();
    end_lives(&store, &operator(), 0..9).await;
    end_lives(&store, &elsewhere, 0..9).await;
    assert_eq!(store.lessons().await.unwrap(), []);
    end_lives(&store, &elsewhere, 9..10).await;
    let lesson = store.lessons().await.unwrap().remove(0);
    assert_eq!((&lesson.operator, lesson.lives), (&elsewhere, 10));
    let lives = store.finished_lives(&elsewhere, &lesson.part_number, &lesson.model).await.unwrap();
    assert_eq!(lives.len(), 10, "a lesson counts the lives that it is about");
    end_lives(&store, &operator(), 9..10).await;
    let owners: Vec<_> = store.lessons().await.unwrap().into_iter().map(|lesson| lesson.operator).collect();
    assert_eq!(owners, [operator(), elsewhere], "all of them, so that one that fails keeps no other waiting");
    activate(&store, "two").await;
    assert_eq!(store.lessons().await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_lesson_is_taken_by_one_worker_and_less_often_the_more_it_fails(backend: Backend) {
    const CLAIM: Duration = Duration::from_secs(60);
    const SECOND: Duration = Duration::from_secs(1);
    let clock = HandClock::new();
    let database = Database::with(backend, Options { clock: Some(clock.clock()), ..Options::default() });
    let store = database.ready().await;
    end_lives(&store, &operator(), 0..10).await;
    let lesson = store.lessons().await.unwrap().remove(0);
    for length in [1, 2, 4] {
        let ask = || {
            let (store, lesson) = (store.clone(), lesson.clone());
            async move { store.claim_lesson(&lesson, CLAIM).await.unwrap() }
        };
        let claims = (0..6).map(|_| ask()).collect::<JoinSet<_>>().join_all().await;
        assert_eq!(claims.iter().filter(|claimed| **claimed).count(), 1);
        clock.advance(CLAIM * length - SECOND);
        assert_eq!(store.lessons().await.unwrap(), []);
        clock.advance(SECOND);
        assert_eq!(store.lessons().await.unwrap(), std::slice::from_ref(&lesson));
    }
    assert!(store.claim_lesson(&lesson, CLAIM).await.unwrap());
    store.release_lesson(&lesson).await.unwrap();
    assert_eq!(store.lessons().await.unwrap(), std::slice::from_ref(&lesson), "it was handed back");
    learn(&store, &operator(), "first", 10, 1.0).await;
    assert!(!store.claim_lesson(&lesson, CLAIM).await.unwrap(), "it was learned meanwhile");
    end_lives(&store, &operator(), 10..13).await;
    let next = store.lessons().await.unwrap().remove(0);
    assert!(store.claim_lesson(&next, CLAIM).await.unwrap());
    clock.advance(CLAIM);
    assert_eq!(store.lessons().await.unwrap(), [next], "a prior forgets the attempts before it");
}
