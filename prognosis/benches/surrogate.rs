//! What one evaluation of the boundary costs.

#[path = "../tests/it/labelled/mod.rs"]
mod labelled;

use std::{hint::black_box, path::Path};

use criterion::{Criterion, criterion_group, criterion_main};
use domain::FaultModel;
use prognosis::{
    boundary::Boundary,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings, SvmSettings},
};

fn one_margin(criterion: &mut Criterion) {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/assess/surrogate_train.csv");
    let samples = labelled::read(&fixture);
    let kinds = [
        ("svm", SurrogateSettings::Svm(SvmSettings::default())),
        ("figure regression, 300 centres", SurrogateSettings::FigureRegression(RegressionSettings::default())),
    ];
    for (name, settings) in kinds {
        let surrogate = Surrogate::train(&samples, &FaultModel::electrical(), &settings).expect("good samples");
        let k = [0.05, 0.02, 0.08, 0.55, 0.47];
        criterion.bench_function(name, |bencher| bencher.iter(|| surrogate.margin(black_box(&k))));
    }
}

criterion_group!(benches, one_margin);
criterion_main!(benches);
