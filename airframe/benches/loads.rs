//! One load estimate: twelve gratings and air data to the products and both hinge moments.

#[path = "../tests/it/cases/mod.rs"]
mod cases;

use std::hint::black_box;

use airframe::load_estimator::LoadReading;
use cases::Table;
use criterion::{Criterion, criterion_group, criterion_main};
use domain::sensor_configuration::{Side, Surface};

fn loads(criterion: &mut Criterion) {
    let folder = cases::folder();
    let estimator = cases::estimator(&cases::parameters(&folder, "D_faulty"), None);
    let cases = cases::cases(&Table::open(&folder.join("D_faulty.csv")));
    let estimate = |case: &cases::Case| {
        let reading = LoadReading { strain: Some(&case.strain), air_data: Some(&case.air_data), recorded_at: None };
        let estimate = estimator.estimate(&reading).expect("air data");
        [Surface::Flap, Surface::Aileron].map(|surface| estimator.hinge_moment(&estimate, surface, Side::Right))
    };
    for (name, index) in [("a failed grating", 0), ("all gratings sound", 3)] {
        criterion.bench_function(&format!("loads/{name}"), |b| b.iter(|| estimate(black_box(&cases[index]))));
    }
}

criterion_group!(benches, loads);
criterion_main!(benches);
