//! Speed of the models in simulated microseconds per second: 1 Melem/s is real time.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domain::Stream;
use ema::{
    back_emf::Awaited,
    commutation::BINS,
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map, simulate_map_until},
};

fn models(criterion: &mut Criterion) {
    let motor = Motor::default();
    let faults = ElectricalFaults::new([0.1, 0.2, 0.0], 0.2, 1.0).expect("inside the domain");
    let manoeuvre = Manoeuvre::acquisition();
    let mut group = criterion.benchmark_group("map of 2 s");
    group.throughput(Throughput::Elements(2_000_000)).sample_size(20);
    for model in [Model::HighFidelity, Model::LowFidelity1] {
        let settings = Settings::new(model, 2.0);
        group.bench_function(format!("{model:?}"), |bencher| {
            bencher.iter(|| simulate_map(model, &motor, &faults, &manoeuvre, &settings));
        });
    }
    group.finish();
}

fn upload(criterion: &mut Criterion) {
    let motor = Motor::default();
    let faults = ElectricalFaults::new([0.1, 0.2, 0.0], 0.2, 1.0).expect("inside the domain");
    let manoeuvre = Manoeuvre::operating(&mut Stream::new(1, &["upload"]));
    let settings = Settings::new(Model::HighFidelity, 20.0);
    let bins: Vec<usize> = (0..BINS).step_by(12).collect();
    let awaited = Awaited { bins: &bins, passes: 10 };
    criterion.bench_function("upload of 10 passes", |bencher| {
        bencher.iter(|| simulate_map_until(Model::HighFidelity, &motor, &faults, &manoeuvre, &settings, awaited));
    });
}

criterion_group!(benches, models, upload);
criterion_main!(benches);
