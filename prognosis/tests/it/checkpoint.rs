//! Filters restored from checkpoints.

use crate::simulated::{Growth, observe};
use domain::{ContentHash, FaultModel};
use numerics::Stream;
use prognosis::{Block, CheckpointError, Clock, ConsistencyLimits, Filter, FleetPrior, GrowthChanges, blocks};
use proptest::prelude::*;

/// The blocks of 1,200 h of a life drawn from the vague prior.
fn life() -> Vec<Block> {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(4, &["checkpoint"]));
    let path = Growth::draw(&prior, &mut random).path(1200.0, &mut random);
    blocks(&observe(&path, 1.0, &mut random), &Clock::default())
}

fn changing() -> FleetPrior {
    FleetPrior::vague().with_growth_changes()
}

fn begin(prior: &FleetPrior) -> Filter {
    Filter::new(&FaultModel::electrical(), prior)
}

fn restore(prior: &FleetPrior, bytes: &[u8]) -> Result<Filter, CheckpointError> {
    Filter::from_bytes(&FaultModel::electrical(), prior, bytes)
}

#[test]
fn a_life_restored_anywhere_goes_on_as_if_never_interrupted() {
    let consistency = Some(ConsistencyLimits { usual_scatter: 0.7, scatter: 0.9, surprise: 1.2, log_drift: 2.0 });
    for prior in [FleetPrior::vague(), changing(), FleetPrior { consistency, ..changing() }] {
        let (mut steady, mut interrupted) = (begin(&prior), begin(&prior));
        for block in &life() {
            interrupted = restore(&prior, &interrupted.to_bytes()).unwrap();
            steady.update(block);
            interrupted.update(block);
        }
        assert_eq!(interrupted, steady);
        assert_eq!(interrupted.to_bytes(), steady.to_bytes());
        assert_eq!(interrupted.posterior(), steady.posterior());
        assert_eq!(interrupted.doubt(), steady.doubt());
    }
}

#[test]
fn rates_without_weight_survive() {
    let mut prior = FleetPrior::vague();
    prior.one_sided.rate_weights[3] = 0.0;
    let mut filter = begin(&prior);
    life().iter().for_each(|block| filter.update(block));
    assert_eq!(restore(&prior, &filter.to_bytes()).unwrap(), filter);
}

#[test]
fn particles_of_one_ancestor_are_written_once() {
    let more = GrowthChanges { particles: 200, ..GrowthChanges::default() };
    let many = FleetPrior { growth_changes: Some(more), ..changing() };
    let sizes = [changing(), many].map(|prior| begin(&prior).to_bytes().len());
    // All that change start alike; one more of them is six words.
    assert_eq!(sizes[1] - sizes[0], (200 - 29) * 6 * 8);
}

#[test]
fn checkpoints_of_other_filters_are_refused() {
    let bytes = begin(&changing()).to_bytes();
    let refused = restore(&FleetPrior::vague(), &bytes).unwrap_err();
    assert!(matches!(refused, CheckpointError::Other { expected: [0, 1, _], found: [0, 30, _] }), "{refused}");
    let mut newer = bytes.clone();
    newer[0] += 1;
    assert_eq!(restore(&changing(), &newer).unwrap_err(), CheckpointError::Version { found: Some(newer[0]) });
    assert_eq!(restore(&changing(), &[]).unwrap_err(), CheckpointError::Version { found: None });
}

/// `bytes` without its digest, changed, with a digest that is right.
fn forged(bytes: &[u8], change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut content = bytes[..bytes.len() - 32].to_vec();
    change(&mut content);
    let digest = ContentHash::of(&content);
    content.extend(digest.bytes());
    content
}

#[test]
fn words_that_are_not_those_of_a_filter_are_refused() {
    let bytes = begin(&changing()).to_bytes();
    let refused = |change: &dyn Fn(&mut Vec<u8>)| restore(&changing(), &forged(&bytes, change)).unwrap_err();
    assert_eq!(refused(&|content| content.truncate(content.len() - 8)), CheckpointError::Malformed);
    assert_eq!(refused(&|content| content.extend([0; 8])), CheckpointError::Malformed);
    assert_eq!(refused(&|content| content.truncate(100)), CheckpointError::Malformed);
    // Where the tracks of the first particle are: behind the version, five words and five more.
    assert_eq!(refused(&|content| content[1 + 10 * 8..][..8].fill(255)), CheckpointError::Malformed);
}

proptest! {
    #[test]
    fn damaged_bytes_are_refused(at in 0.0..1.0f64, bit in 0u8..8, garbage in prop::collection::vec(any::<u8>(), 0..300)) {
        let prior = FleetPrior::vague();
        let bytes = begin(&prior).to_bytes();
        let place = (at * bytes.len() as f64) as usize;
        prop_assert!(restore(&prior, &bytes[..place]).is_err());
        let mut flipped = bytes.clone();
        flipped[place] ^= 1 << bit;
        prop_assert!(restore(&prior, &flipped).is_err());
        prop_assert!(restore(&prior, &garbage).is_err());
        let longer: Vec<u8> = bytes.iter().chain(&garbage).copied().collect();
        prop_assert!(garbage.is_empty() || restore(&prior, &longer).is_err());
    }
}
