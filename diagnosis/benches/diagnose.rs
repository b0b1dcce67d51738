//! One diagnosis, samples of 30 points and load ratio per sample to a fault vector with sigmas, and its network.

#[path = "../tests/it/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{closed_form_maps, faults, mask};
use criterion::{Criterion, criterion_group, criterion_main};
use diagnosis::{MapKind, Measurement, TrainingSet, TrainingSettings, train};
use domain::LoadRatio;
use numerics::Stream;

fn diagnose(criterion: &mut Criterion) {
    let maps = closed_form_maps(200, 1);
    let mask = mask(&maps);
    let settings = TrainingSettings { restarts: 1, steps: 10, ..TrainingSettings::new(MapKind::LoadInvariant) };
    let set = TrainingSet { fault_model: &faults(), mask: &mask, maps: &maps, calibration: &[] };
    let diagnoser = train(&set, &settings, &Stream::new(1, &["bench"])).unwrap();
    let gappy = diagnoser.on_mask(&mask).unwrap();
    let samples: Vec<_> = mask.bins().iter().map(|bin| Some(maps[0].y[*bin])).collect();
    let load_ratio = LoadRatio::PerSample(mask.bins().iter().map(|bin| Some(maps[0].r[*bin])).collect());
    let measurement = Measurement { samples: &samples, load_ratio: Some(&load_ratio), noise: Some(0.01) };
    criterion.bench_function("diagnose", |b| b.iter(|| diagnoser.diagnose(&gappy, black_box(&measurement))));
    let coefficients = diagnoser.basis.project(&maps[0].load_invariant());
    criterion.bench_function("mlp", |b| b.iter(|| diagnoser.mlp.evaluate(black_box(&coefficients))));
    criterion.bench_function("mlp with jacobian", |b| b.iter(|| diagnoser.mlp.linearise(black_box(&coefficients))));
}

criterion_group!(benches, diagnose);
criterion_main!(benches);
