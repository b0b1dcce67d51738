//! The kernels of a reduction: a basis from a thousand maps, and coefficients from thirty samples.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use numerics::Stream;
use reduction::{GappyPod, MaskDesign, ModeCount, PodBasis, Prior, Sample};

const BINS: usize = 360;

/// Maps of nine independent parts and a little noise, so that the basis has nine modes and then a floor.
fn maps(count: usize) -> Vec<Vec<f64>> {
    let map = |i: usize| {
        let mut stream = Stream::new(1, &["maps"]).substream(i as u64);
        let parts: Vec<f64> = (0..9).map(|_| 0.1 * stream.normal()).collect();
        let at = |bin: usize| {
            let angle_rad = bin as f64 * std::f64::consts::TAU / BINS as f64;
            parts.iter().enumerate().fold(1.0, |y, (j, a)| y + a * libm::cos(j as f64 * angle_rad))
        };
        (0..BINS).map(|bin| at(bin) + 1e-4 * stream.normal()).collect()
    };
    (0..count).map(map).collect()
}

fn kernels(criterion: &mut Criterion) {
    let maps = maps(1000);
    let train = |maps: &[Vec<f64>]| PodBasis::train(maps, ModeCount::Fixed(9)).unwrap();
    let mut slow = criterion.benchmark_group("offline");
    slow.sample_size(10);
    slow.bench_function("pod of 1000 maps", |b| b.iter(|| train(black_box(&maps))));
    slow.finish();

    let basis = train(&maps);
    let mask = MaskDesign::default().d_optimal(&basis).unwrap();
    let gappy = GappyPod::new(&basis, &mask).unwrap();
    let samples: Vec<_> = mask.bins().iter().map(|bin| Some(Sample { value: maps[0][*bin], sd: 0.01 })).collect();
    for (name, prior) in [("gappy, map", Prior::Pod), ("gappy, least squares", Prior::Flat)] {
        criterion.bench_function(name, |b| b.iter(|| gappy.fit(black_box(&samples), prior)));
    }
    criterion.bench_function("projection of a whole map", |b| b.iter(|| basis.project(black_box(&maps[0]))));
}

criterion_group!(benches, kernels);
criterion_main!(benches);
