//! Speed of the models in simulated microseconds per second (1 Melem/s is real time), of the low-fidelity
//! kernel in lane steps per second, and of making maps.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ema::{
    back_emf::{Awaited, MapAccumulator},
    closed_form,
    commutation::BINS,
    faults::ElectricalFaults,
    lf2,
    manoeuvre::{Manoeuvre, Signal},
    motor::Motor,
    observer::{Observer, Sample},
    response::simulate_response,
    simulation::{Model, Settings, simulate, simulate_map, simulate_map_until},
};
use numerics::Stream;

const MODELS: [Model; 3] = [Model::HighFidelity, Model::LowFidelity1, Model::LowFidelity1Thesis];

fn faults() -> ElectricalFaults {
    ElectricalFaults::new([0.1, 0.2, 0.0], 0.2, 1.0).expect("inside the domain")
}

fn models(criterion: &mut Criterion) {
    let (motor, faults, manoeuvre) = (Motor::default(), faults(), Manoeuvre::acquisition());
    let mut group = criterion.benchmark_group("map of 2 s");
    group.throughput(Throughput::Elements(2_000_000)).sample_size(20);
    for model in MODELS {
        let settings = Settings::new(model, 2.0);
        group.bench_function(format!("{model:?}"), |bencher| {
            bencher.iter(|| simulate_map(model, &motor, &faults, &manoeuvre, &settings));
        });
    }
    group.finish();
}

fn response(criterion: &mut Criterion) {
    let (motor, faults, manoeuvre) = (Motor::default(), faults(), Manoeuvre::step(0.1));
    let mut group = criterion.benchmark_group("step response of 0.5 s");
    group.throughput(Throughput::Elements(500_000)).sample_size(20);
    for model in MODELS {
        let settings = Settings::new(model, 0.5);
        group.bench_function(format!("{model:?}"), |bencher| {
            bencher.iter(|| simulate_response(model, &motor, &faults, &manoeuvre, &settings, 1e-3));
        });
    }
    group.finish();
}

fn low_fidelity_2(criterion: &mut Criterion) {
    const LANES: usize = 8;
    const STEPS: usize = 5_000;
    let motor = lf2::Motor::new(&lf2::Parameters::assessment(), &lf2::Faults::electrical([0.1, 0.05, 0.0, 0.55, 0.45]));
    let (reference_rad_s, load_nm) = ([200.0; LANES], [0.1; LANES]);
    let mut group = criterion.benchmark_group("LF2");
    group.throughput(Throughput::Elements((LANES * STEPS) as u64));
    group.bench_function("lane steps", |bencher| {
        bencher.iter(|| {
            let mut lanes = lf2::Lanes::<LANES>::at_rest();
            for _ in 0..STEPS {
                lanes.step(&motor, black_box(&reference_rad_s), &load_nm);
            }
            lanes.output_rad
        });
    });
    group.finish();
}

/// Keeps what a simulation shows.
struct Kept(Vec<Sample>);

impl Observer for Kept {
    fn observe(&mut self, sample: &Sample) {
        self.0.push(*sample);
    }
}

fn map(criterion: &mut Criterion) {
    let (motor, faults) = (Motor::default(), faults());
    let mut kept = Kept(Vec::new());
    let settings = Settings::new(Model::LowFidelity1, 0.4);
    simulate(Model::LowFidelity1, &motor, &faults, &Manoeuvre::acquisition(), &settings, &mut kept);
    let mut group = criterion.benchmark_group("back-EMF map");
    group.throughput(Throughput::Elements(kept.0.len() as u64));
    group.bench_function("samples of a simulation", |bencher| {
        bencher.iter(|| {
            let mut map = MapAccumulator::new(&motor);
            kept.0.iter().for_each(|sample| map.observe(sample));
            map.map()
        });
    });
    group.throughput(Throughput::Elements(1));
    group.bench_function("closed form", |bencher| {
        bencher.iter(|| closed_form::map(black_box(&faults), &[0.2; BINS]));
    });
    group.finish();
}

fn upload(criterion: &mut Criterion) {
    let (motor, faults) = (Motor::default(), faults());
    let load_nm = Signal::constant(0.15);
    let manoeuvre = Manoeuvre::stroke(&motor, load_nm, &mut Stream::new(1, &["upload"]));
    let settings = Settings::new(Model::HighFidelity, 1.5);
    let bins: Vec<usize> = (0..BINS).step_by(12).collect();
    let awaited = Awaited { bins: &bins, passes: 10, from_s: 0.04 };
    criterion.bench_function("upload of 10 passes", |bencher| {
        bencher.iter(|| simulate_map_until(Model::HighFidelity, &motor, &faults, &manoeuvre, &settings, awaited));
    });
}

criterion_group!(benches, models, response, low_fidelity_2, map, upload);
criterion_main!(benches);
