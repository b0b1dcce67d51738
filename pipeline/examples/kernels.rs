//! The hot kernels of the online service, each under a name of its own: what they cost in time and in instructions.
//!
//! `cargo run --example kernels` prints the time of each and of the parts of a forecast; under `valgrind --tool=callgrind`,
//! with the word `once`, every kernel runs a fixed number of times, which `scripts/instructions` counts.

#![allow(clippy::disallowed_methods, reason = "what is measured here is time")]

use std::{
    hint::black_box,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    time::Instant,
};

use domain::{FaultModel, FaultVector, LoadRatio, Mask};
use ema::{closed_form, faults::ElectricalFaults};
use numerics::Stream;
use pipeline::{Measurement, Model};
use prognosis::{
    Block, Boundary, Filter, FleetPrior, Forecast, ForecastSettings, Margin, Observation, blocks, forecast,
};

/// Flight hours of the life that is followed, and between its observations.
const LIFE_FH: f64 = 1200.0;
const EVERY_FH: f64 = 2.0;

fn main() {
    let bench = Bench::new();
    match std::env::args().nth(1).as_deref() {
        Some("once") => bench.once(),
        Some("forecast") => (0..300).for_each(|_| drop(black_box(bench.forecast_1000()))),
        _ => bench.time(),
    }
}

/// A life of the shipped bundle's fleet, followed up to its last but one block.
struct Bench {
    model: Model,
    filter: Filter,
    last: Block,
    fault_vectors: Vec<[f64; 5]>,
    samples: Vec<Option<f64>>,
    load_ratio: LoadRatio,
}

impl Bench {
    fn new() -> Self {
        let model = Model::from_bytes(include_bytes!("../../models/default.json")).expect("the bundle that ships");
        let prior = model.prior().body.first();
        let closed = blocks(&life(), &prior.clock);
        let (last, earlier) = closed.split_last().expect("a life of many blocks");
        let mut filter = Filter::new(&FaultModel::electrical(), prior);
        earlier.iter().for_each(|block| filter.update(block));
        let mut random = Stream::new(3, &["faults"]);
        let mut fault = |i: usize| if i < 3 { 0.1 * random.uniform() } else { 0.5 + 0.1 * (random.uniform() - 0.5) };
        let fault_vectors = (0..64).map(|_| std::array::from_fn(&mut fault)).collect();
        let (samples, load_ratio) = samples(&model.bundle().masks()[0]);
        Self { last: last.clone(), filter, model, fault_vectors, samples, load_ratio }
    }

    fn prior(&self) -> &FleetPrior {
        self.model.prior().body.first()
    }

    fn once(&self) {
        (0..20).for_each(|_| drop(black_box(self.surrogate_sums())));
        (0..2).for_each(|_| drop(black_box(self.forecast_1000())));
        (0..200).for_each(|_| self.estimate());
        (0..20).for_each(|_| drop(black_box(self.filter_block())));
    }

    fn time(&self) {
        let per = |name: &str, calls: f64, run: &dyn Fn()| {
            let mut best = f64::INFINITY;
            for _ in 0..40 {
                let start = Instant::now();
                run();
                best = best.min(start.elapsed().as_secs_f64());
            }
            println!("{name:<34} {:10.2} us", 1e6 * best / calls);
        };
        per("surrogate: one look", 64.0, &|| drop(black_box(self.surrogate_sums())));
        per("forecast: one draw of 1,000", 1000.0, &|| drop(black_box(self.forecast_1000())));
        per("estimate: Gappy POD and network", 1.0, &|| self.estimate());
        per("filter: one block", 1.0, &|| drop(black_box(self.filter_block())));
        self.parts();
    }

    /// How often a forecast looks at the boundary, and what it would cost if that were free.
    fn parts(&self) {
        let counted =
            Counted { boundary: self.model.boundary(), looks: AtomicUsize::new(0), margins: AtomicUsize::new(0) };
        self.forecast_by(&counted);
        let per_draw = |count: &AtomicUsize| count.load(Relaxed) as f64 / 1000.0;
        println!(
            "looks at the boundary per draw {:.2}, and margins {:.2}",
            per_draw(&counted.looks),
            per_draw(&counted.margins)
        );
    }

    /// The margin and its derivatives at 64 fault vectors.
    #[inline(never)]
    fn surrogate_sums(&self) -> Vec<f64> {
        let margin = |k: &[f64; 5]| {
            let mut gradient = [0.0; 5];
            self.model.boundary().look(black_box(k), &mut gradient).value + gradient[0]
        };
        self.fault_vectors.iter().map(margin).collect()
    }

    /// A forecast of 1,000 draws.
    #[inline(never)]
    fn forecast_1000(&self) -> Forecast {
        self.forecast_by(self.model.boundary())
    }

    fn forecast_by(&self, boundary: &dyn Boundary) -> Forecast {
        let stream = Stream::new(1, &["bench"]);
        let error = self.prior().failure_time_error;
        forecast(&self.filter.posterior(), 9.0, boundary, error, &ForecastSettings::default(), &stream)
    }

    /// The faults that thirty samples tell.
    #[inline(never)]
    fn estimate(&self) {
        let measurement = Measurement { samples: &self.samples, load_ratio: Some(&self.load_ratio), noise: Some(0.01) };
        black_box(self.model.diagnose(black_box(&measurement), &self.model.bundle().masks()[0])).expect("it is finite");
    }

    /// The filter after one more block, with all that is known then.
    #[inline(never)]
    fn filter_block(&self) -> prognosis::Posterior {
        let mut filter = self.filter.clone();
        filter.update(black_box(&self.last));
        filter.posterior()
    }
}

/// A boundary that counts how often it is asked.
struct Counted<'a> {
    boundary: &'a dyn Boundary,
    looks: AtomicUsize,
    margins: AtomicUsize,
}

impl Boundary for Counted<'_> {
    fn margin(&self, k: &[f64]) -> f64 {
        self.margins.fetch_add(1, Relaxed);
        self.boundary.margin(k)
    }

    fn look(&self, k: &[f64], gradient: &mut [f64]) -> Margin {
        self.looks.fetch_add(1, Relaxed);
        self.boundary.look(k, gradient)
    }
}

/// A short that wears as the fleet's do, beside an eccentricity that hardly does.
fn life() -> Vec<Observation> {
    let mut random = Stream::new(2, &["life"]);
    let mut seen = |t_fh: f64| {
        let k1 = 2e-5 / 5e-4 * libm::expm1(5e-4 * t_fh);
        let means = [k1, 0.005, 0.002, 0.5 + 1e-5 * t_fh, 0.5 - 5e-6 * t_fh];
        let sigma = [0.0075, 0.0075, 0.0075, 0.02, 0.02];
        let fault_vector = (0..5).map(|i| (means[i] + sigma[i] * random.normal()).max(0.0)).collect();
        Observation {
            t_fh,
            fault_vector: FaultVector(fault_vector),
            sigma: sigma.to_vec(),
            load: None,
            temperature: None,
        }
    };
    (0..(LIFE_FH / EVERY_FH) as usize).map(|i| seen(EVERY_FH * i as f64)).collect()
}

/// Samples of a faulty motor by its closed form, with one per cent of noise.
fn samples(mask: &Mask) -> (Vec<Option<f64>>, LoadRatio) {
    let mut random = Stream::new(4, &["samples"]);
    let faults = ElectricalFaults::try_from(&FaultVector(vec![0.12, 0.03, 0.0, 0.55, 0.47])).expect("five faults");
    let mut sample = |&bin: &usize| Some(closed_form::back_emf(&faults, bin, 0.1) + 0.01 * random.normal());
    let samples = mask.bins().iter().map(&mut sample).collect();
    (samples, LoadRatio::PerSample(vec![Some(0.1); mask.len()]))
}
