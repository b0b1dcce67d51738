use domain::{ContentHash, State};
use store::{Checkpoint, LifeResults, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, component, day, later_upload, lease, life_inputs, operator, results,
};

fn checkpoint(state: &State) -> Checkpoint {
    let body = [state.digest.bytes().as_slice(), &state.block.to_le_bytes()].concat();
    Checkpoint { block: state.block, digest: state.digest, body }
}

fn wanted(states: &[State]) -> Vec<(u64, ContentHash)> {
    states.iter().map(|state| (state.block, state.digest)).collect()
}

/// Sends uploads at some hours after the first and writes what a worker finds, with the checkpoints of
/// the states that it picks.
async fn process(store: &Store, hours: &[f64], pick: impl Fn(&State) -> bool) -> LifeResults {
    for at in hours {
        store.accept(&operator(), later_upload(&format!("u{at}"), "0001", *at), day(0.0)).await.unwrap();
    }
    let lease = lease(store).await;
    let mut results = results(&life_inputs(store, &lease).await);
    results.checkpoints = results.states.iter().filter(|state| pick(state)).map(checkpoint).collect();
    store.complete(&lease, vec![results.clone()]).await.unwrap();
    results
}

async fn found(store: &Store, wanted: &[(u64, ContentHash)]) -> Option<Checkpoint> {
    store.checkpoint(&component("0001"), 0, 1, wanted).await.unwrap()
}

/// Blocks of which there is a checkpoint.
async fn kept(store: &Store, states: &[State]) -> Vec<u64> {
    let mut blocks = Vec::new();
    for state in states {
        blocks.extend(found(store, &wanted(std::slice::from_ref(state))).await.map(|one| one.block));
    }
    blocks
}

fn every(hours: f64, count: u32) -> Vec<f64> {
    (0..count).map(|i| hours * f64::from(i)).collect()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_latest_checkpoint_that_is_wanted_is_found(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let states = process(&store, &every(500.0, 6), |_| true).await.states;
    let all = wanted(&states);
    assert_eq!(states.len(), 5);
    assert_eq!(found(&store, &all).await, Some(checkpoint(&states[4])));
    assert_eq!(found(&store, &all[..3]).await, Some(checkpoint(&states[2])), "of those that are wanted");
    let mut other = all.clone();
    other[4].1 = ContentHash::of(b"other");
    assert_eq!(found(&store, &other).await, Some(checkpoint(&states[3])), "with the digest that is wanted");
    assert_eq!(found(&store, &[]).await, None);
    assert_eq!(store.checkpoint(&component("0002"), 0, 1, &all).await.unwrap(), None);
    for (overhaul_index, generation) in [(1, 1), (0, 2)] {
        let elsewhere = store.checkpoint(&component("0001"), overhaul_index, generation, &all).await.unwrap();
        assert_eq!(elsewhere, None, "checkpoints are of one generation of one life");
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_late_upload_ends_the_checkpoints_after_it(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let before = process(&store, &every(500.0, 6), |_| true).await.states;
    let after = process(&store, &[1100.0], |_| false).await.states;
    assert_eq!(before[..3], after[..3]);
    let stand: Vec<u64> = before[..3].iter().map(|state| state.block).collect();
    assert_eq!(kept(&store, &before).await, stand);
    assert_eq!(found(&store, &wanted(&after)).await, Some(checkpoint(&before[2])));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn checkpoints_go_with_the_last_upload(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let states = process(&store, &every(500.0, 3), |_| true).await.states;
    for hours in every(500.0, 3) {
        store.void_upload(&operator(), &format!("u{hours}").parse().unwrap(), by_hand(1.0)).await.unwrap();
    }
    assert_eq!(kept(&store, &states).await, [0; 0]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn of_each_run_of_blocks_the_last_checkpoint_is_kept(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    // Blocks begin at multiples of 20 h, and the first upload is at 100 h: in block 5.
    for count in [30, 60] {
        let latest = u64::from(count) + 3;
        let states = process(&store, &every(20.0, count), |state| state.block >= latest - 20).await.states;
        assert_eq!(states.last().map(|state| state.block), Some(latest));
        let expected = if count == 30 { vec![24, 33] } else { vec![24, 49, 63] };
        assert_eq!(kept(&store, &states).await, expected);
    }
}
