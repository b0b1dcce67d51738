//! Time of one assessment, which the training of a surrogate asks for thousands of times, and of one
//! simulated life.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use ema::{
    assessment::assess_faults,
    lf2::{Faults, Parameters},
    life::simulate_life,
    wear_law::Regime,
};

fn assessment(criterion: &mut Criterion) {
    let worn = Faults::electrical([0.1, 0.05, 0.0, 0.55, 0.45]);
    for (name, faults) in [("nominal", Faults::NOMINAL), ("worn", worn)] {
        criterion.bench_function(&format!("assessment, {name}"), |bencher| {
            bencher.iter(|| assess_faults(&Parameters::assessment(), black_box(&faults)));
        });
    }
}

fn life(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("life to failure");
    group.sample_size(10);
    let mut index = 0;
    group.bench_function("constant growth", |bencher| {
        bencher.iter(|| {
            index += 1;
            simulate_life(&Parameters::assessment(), 1, index, Regime::Constant)
        });
    });
    group.finish();
}

criterion_group!(benches, assessment, life);
criterion_main!(benches);
