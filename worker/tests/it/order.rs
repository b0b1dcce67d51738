//! Estimates and states are functions of the set of uploads: any order of arrival, any repetition and any
//! partition into leases leave the same digest.
//!
//! `ACTUARY_PERMUTATIONS` sets how many orders are tried.

use crate::common::{self, now, store, upload, work};
use domain::{OperatorId, Upload};
use numerics::Stream;
use pipeline::Model;
use store::{Receipt, Store};

const UPLOADS: u32 = 18;
/// Uploads that arrive between two looks of the worker, at most.
const BATCH: f64 = 12.0;

/// A life of four days near its end, with one upload whose hours cannot be.
fn life(model: &Model) -> Vec<Upload> {
    let mask = &model.bundle().masks()[0];
    let mut stream = Stream::new(5, &["life"]);
    let mut uploads: Vec<Upload> = (0..UPLOADS).map(|index| upload(model, mask, index)).collect();
    for (index, upload) in uploads.iter_mut().enumerate() {
        // Weaker all over: half of every winding and more will be gone soon, which keeps the draws short.
        let wear = 0.72 - 0.005 * index as f64;
        let k_nom = model.summary().k_nom;
        upload.reading.samples_mut().unwrap().samples =
            (0..mask.len()).map(|_| Some(k_nom * (wear + 0.01 * stream.normal()))).collect();
    }
    uploads[7].flight_hours += 3000.0;
    uploads
}

async fn digest(arrivals: &[Upload], stream: &mut Stream) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (store, _) = store(&folder).await;
    let mut open = arrivals;
    while !open.is_empty() {
        let batch = (1 + (BATCH * stream.uniform()) as usize).min(open.len());
        accept(&store, &open[..batch]).await;
        open = &open[batch..];
        work(&store).await;
    }
    let digest = store.digest().await.unwrap();
    store.close().await;
    assert_eq!(digest.estimates, u64::from(UPLOADS));
    assert!(digest.states >= 2, "{digest:?}");
    digest.digest.to_string()
}

async fn accept(store: &Store, uploads: &[Upload]) {
    let operator = OperatorId::default();
    let arrivals = uploads.iter().map(|upload| store.accept(&operator, upload.clone(), now()));
    for receipt in futures_util::future::join_all(arrivals).await {
        assert!(matches!(receipt.unwrap(), Receipt::Accepted | Receipt::Duplicate));
    }
}

/// All in random order, three in ten of them twice.
fn shuffled(uploads: &[Upload], stream: &mut Stream) -> Vec<Upload> {
    let copies = uploads.iter().flat_map(|upload| vec![upload.clone(); if stream.uniform() < 0.3 { 2 } else { 1 }]);
    let mut arrivals: Vec<_> = copies.collect();
    stream.shuffle(&mut arrivals);
    arrivals
}

#[tokio::test]
async fn any_order_of_arrival_leaves_the_same_digest() {
    let model = Model::from_bytes(common::BUNDLE).unwrap();
    let uploads = life(&model);
    let expected = digest(&uploads, &mut Stream::new(0, &["in order"])).await;
    let permutations = std::env::var("ACTUARY_PERMUTATIONS").map_or(8, |count| count.parse().unwrap());
    for seed in 0..permutations {
        let mut stream = Stream::new(seed, &["permutation"]);
        let arrivals = shuffled(&uploads, &mut stream);
        assert_eq!(digest(&arrivals, &mut stream).await, expected, "permutation {seed}");
    }
}
