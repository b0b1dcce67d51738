//! What one online step and one forecast cost.

#[path = "../tests/it/labelled/mod.rs"]
mod labelled;
#[path = "../tests/it/simulated/mod.rs"]
mod simulated;

use std::{hint::black_box, path::Path};

use criterion::{Criterion, criterion_group, criterion_main};
use domain::FaultModel;
use evaluation::Thesis;
use numerics::Stream;
use prognosis::{
    Clock, Estimator, Filter, FleetPrior, ForecastSettings, PredictionSettings, blocks, forecast,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings},
};
use simulated::{Growth, observe};

/// A life of 1,200 h drawn from the vague prior, filtered up to its last but one block.
fn online_step(criterion: &mut Criterion) {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(4, &["bench"]));
    let path = Growth::draw(&prior, &mut random).path(1200.0, &mut random);
    let observations = observe(&path, 1.0, &mut random);
    let closed = blocks(&observations, &Clock::default());
    let (last, earlier) = closed.split_last().expect("a life of many blocks");
    let mut filter = Filter::new(&FaultModel::electrical(), &prior);
    earlier.iter().for_each(|block| filter.update(block));
    criterion.bench_function("clone and update by a block", |bencher| {
        bencher.iter(|| {
            let mut filter = filter.clone();
            filter.update(black_box(last));
            filter
        });
    });
    let mut changing = Filter::new(&FaultModel::electrical(), &prior.with_growth_changes());
    earlier.iter().for_each(|block| changing.update(block));
    criterion.bench_function("clone and update by a block, growth changes", |bencher| {
        bencher.iter(|| {
            let mut filter = changing.clone();
            filter.update(black_box(last));
            filter
        });
    });
    criterion.bench_function("posterior", |bencher| bencher.iter(|| black_box(&filter).posterior()));

    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/assess/surrogate_train.csv");
    let settings = SurrogateSettings::FigureRegression(RegressionSettings::default());
    let surrogate =
        Surrogate::train(&labelled::read(&fixture), &FaultModel::electrical(), &settings).expect("good samples");
    let (posterior, stream) = (filter.posterior(), Stream::new(1, &["bench"]));
    criterion.bench_function("forecast of 1,000 draws, 300 centres", |bencher| {
        bencher.iter(|| forecast(&posterior, 9.0, &surrogate, None, &ForecastSettings::default(), &stream));
    });

    let model = FaultModel::electrical();
    let thesis = Thesis { model: &model, boundary: &surrogate };
    let mut follower = thesis.follow();
    observations.iter().for_each(|observation| follower.observe(observation));
    let settings = PredictionSettings { draws: 1000, horizon_fh: 10_000.0 };
    criterion.bench_function("thesis: prediction of 1,000 draws", |bencher| {
        bencher.iter(|| follower.predict(1200.0, &settings, &stream));
    });
}

criterion_group!(benches, online_step);
criterion_main!(benches);
