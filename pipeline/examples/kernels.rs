//! The hot kernels of the online service, each under a name of its own: what they cost in time and in instructions.
//!
//! `cargo run --workspace --example kernels` prints the time of each, and that of a naive Monte Carlo of as many draws.
//! With the word `once` every kernel runs a fixed number of times, which `scripts/instructions` counts under valgrind;
//! with `forecast` only forecasts are made, for a profiler.

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
    Block, Boundary, EntryEstimate, Filter, FleetPrior, Forecast, ForecastSettings, Margin, Moments, Observation,
    Posterior, blocks, forecast,
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

    /// Runs each kernel so many times, and says how many.
    fn once(&self) {
        let run = |name: &str, times: usize, kernel: &dyn Fn()| {
            (0..times).for_each(|_| kernel());
            println!("{name} {times}");
        };
        run("surrogate_sums", 20, &|| drop(black_box(self.surrogate_sums())));
        run("forecast_1000", 2, &|| drop(black_box(self.forecast_1000())));
        run("estimate", 200, &|| self.estimate());
        run("filter_block", 20, &|| drop(black_box(self.filter_block())));
    }

    fn time(&self) {
        let look_us = least_us(40, &|| drop(black_box(self.surrogate_sums()))) / 64.0;
        let forecast_us = least_us(20, &|| drop(black_box(self.forecast_1000())));
        let looks = self.looks();
        println!("look_us {look_us:.3}");
        println!("forecast_1000_ms {:.2}", 1e-3 * forecast_us);
        println!("looks_per_draw {looks:.2}");
        println!("sums_of_a_forecast_ms {:.2}", looks * look_us);
        println!("estimate_us {:.1}", least_us(200, &|| self.estimate()));
        println!("filter_block_us {:.0}", least_us(20, &|| drop(black_box(self.filter_block()))));
        println!("naive_plain_sum_ms {:.1}", 1e-3 * least_us(5, &|| drop(black_box(self.naive(&plain_sum)))));
        let margin = |k: &[f64; 5]| self.model.boundary().margin(k);
        println!("naive_surrogate_ms {:.1}", 1e-3 * least_us(2, &|| drop(black_box(self.naive(&margin)))));
    }

    /// Looks and margins that a forecast asks the boundary for, per draw.
    fn looks(&self) -> f64 {
        let counted = Counted { boundary: self.model.boundary(), asked: AtomicUsize::new(0) };
        self.forecast_by(&counted);
        counted.asked.load(Relaxed) as f64 / 1000.0
    }

    /// A thousand draws in steps of ten hours, as in a textbook: each fault for itself, the event at the end of a step.
    fn naive(&self, margin: &dyn Fn(&[f64; 5]) -> f64) -> Vec<f64> {
        const STEP_FH: f64 = 10.0;
        let (entries, noise) = (self.filter.posterior().entries(), self.prior().process_noise * STEP_FH.sqrt());
        let mut random = Stream::new(5, &["naive"]);
        let mut end_fh = || {
            let mut draw = |of: fn(&EntryEstimate) -> Moments| -> [f64; 5] {
                std::array::from_fn(|i| of(&entries[i]).mean + of(&entries[i]).sigma * random.normal())
            };
            let (mut x, rate, bias) = (draw(|e| e.deviation), draw(|e| e.rate_per_h), draw(|e| e.bias_per_h));
            let mut t_fh = 0.0;
            while t_fh < 10_000.0 && margin(&std::array::from_fn(|i| x[i] + if i < 3 { 0.0 } else { 0.5 })) > 0.0 {
                for i in 0..5 {
                    x[i] += STEP_FH * (rate[i] * x[i] + bias[i]) + noise * random.normal();
                    x[i] = if i < 3 { x[i].abs() } else { x[i] };
                }
                t_fh += STEP_FH;
            }
            t_fh
        };
        (0..1000).map(|_| end_fh()).collect()
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
    fn filter_block(&self) -> Posterior {
        let mut filter = self.filter.clone();
        filter.update(black_box(&self.last));
        filter.posterior()
    }
}

/// Least time of so many runs, microseconds: what a machine that others use does when they do not.
fn least_us(runs: usize, kernel: &dyn Fn()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        kernel();
        1e6 * start.elapsed().as_secs_f64()
    };
    (0..runs).map(time).fold(f64::INFINITY, f64::min)
}

/// One minus eight times the sum of the faults.
fn plain_sum(k: &[f64; 5]) -> f64 {
    1.0 - 8.0 * (k[0] + k[1] + k[2]) - 2.0 * ((k[3] - 0.5).abs() + (k[4] - 0.5).abs())
}

/// A boundary that counts how often it is asked.
struct Counted<'a> {
    boundary: &'a dyn Boundary,
    asked: AtomicUsize,
}

impl Boundary for Counted<'_> {
    fn margin(&self, k: &[f64]) -> f64 {
        self.asked.fetch_add(1, Relaxed);
        self.boundary.margin(k)
    }

    fn look(&self, k: &[f64], gradient: &mut [f64]) -> Margin {
        self.asked.fetch_add(1, Relaxed);
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
