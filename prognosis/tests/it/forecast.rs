//! What forecasts say of their own precision, and of what they do not know.

use std::{
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
};

use crate::simulated::{Growth, observe};
use domain::{FaultModel, RulDistribution};
use numerics::Stream;
use prognosis::{
    Boundary, Clock, Draws, Filter, FleetPrior, Forecast, ForecastSettings, GrowthChanges, Margin, Posterior,
    Precision, blocks, forecast,
    surrogate::{LabelledFaults, RegressionSettings, Surrogate, SurrogateSettings, SvmSettings},
};
use proptest::prelude::*;
use rayon::prelude::*;

use crate::labelled;

/// Margin 1 - 8 |x|, unknown where the first fault is beyond `known_until`.
struct Sum {
    known_until: f64,
}

const KNOWN: Sum = Sum { known_until: f64::INFINITY };

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }

    fn look(&self, k: &[f64], gradient: &mut [f64]) -> Margin {
        let nominal = FaultModel::electrical().nominal;
        for (slope, (k, nominal)) in gradient.iter_mut().zip(k.iter().zip(&nominal)) {
            *slope = -8.0 * (k - nominal).signum();
        }
        Margin { value: self.margin(k), sigma: 3.0 * (k[0] - self.known_until).max(0.0) }
    }
}

/// A life drawn from the vague prior and seen for some time.
fn posterior(seed: u64, until_fh: f64) -> Posterior {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(seed, &["forecast"]));
    let path = Growth::draw(&prior, &mut random).path(until_fh, &mut random);
    let mut filter = Filter::new(&FaultModel::electrical(), &prior);
    blocks(&observe(&path, 1.0, &mut random), &Clock::default()).iter().for_each(|block| filter.update(block));
    filter.posterior()
}

fn run(known: &Posterior, boundary: &dyn Boundary, draws: Draws, seed: u64) -> Forecast {
    let settings = ForecastSettings { draws, horizon_fh: 8000.0, ..ForecastSettings::default() };
    forecast(known, 5.0, boundary, None, &settings, &Stream::new(seed, &["draws"]))
}

fn quantile_fh(forecast: &Forecast, level: f64) -> f64 {
    RulDistribution::from_draws(&forecast.ends_fh, 8000.0).quantile_fh(level).expect("not censored")
}

/// The standard error that a forecast states is how much its quantiles vary from stream to stream.
#[test]
fn stated_errors_are_those_of_repetition() {
    let known = posterior(1, 1000.0);
    let forecasts: Vec<Forecast> =
        (0..400).into_par_iter().map(|seed| run(&known, &KNOWN, Draws::fixed(500), seed)).collect();
    let stated = |error: fn(&Forecast) -> Option<f64>| {
        forecasts.iter().map(|forecast| error(forecast).expect("not censored")).sum::<f64>() / forecasts.len() as f64
    };
    for (level, stated) in [(0.1, stated(|f| f.p10_error_fh)), (0.5, stated(|f| f.median_error_fh))] {
        let quantiles: Vec<f64> = forecasts.iter().map(|forecast| quantile_fh(forecast, level)).collect();
        let mean = quantiles.iter().sum::<f64>() / quantiles.len() as f64;
        let sd = (quantiles.iter().map(|q| (q - mean).powi(2)).sum::<f64>() / quantiles.len() as f64).sqrt();
        assert!((stated / sd - 1.0).abs() < 0.12, "{stated} stated, {sd} seen at {level}");
    }
}

#[test]
fn draws_go_on_until_the_forecast_is_precise() {
    let known = posterior(1, 1000.0);
    let draws = |share, most| Draws { least: 200, most, precision: Precision { share, floor_fh: 1.0 } };
    let precise = run(&known, &KNOWN, draws(0.01, 100_000), 1);
    let largest_fh = 0.01 * quantile_fh(&precise, 0.5);
    assert!(precise.p10_error_fh.unwrap() <= largest_fh && precise.median_error_fh.unwrap() <= largest_fh);
    assert!((400..20_000).contains(&precise.ends_fh.len()), "{} draws", precise.ends_fh.len());
    assert_eq!(run(&known, &KNOWN, draws(0.5, 100_000), 1).ends_fh.len(), 200);
    assert_eq!(run(&known, &KNOWN, draws(1e-6, 1111), 1).ends_fh.len(), 1111);
    // Batches are a matter of when to stop and change no draw.
    let count = precise.ends_fh.len();
    assert_eq!(precise, run(&known, &KNOWN, Draws::fixed(count), 1));
}

#[test]
fn nothing_is_stated_of_censored_quantiles() {
    struct Sound;
    impl Boundary for Sound {
        fn margin(&self, _: &[f64]) -> f64 {
            1.0
        }
    }
    let forecast = run(&posterior(1, 400.0), &Sound, Draws::precise(), 1);
    assert_eq!((forecast.p10_error_fh, forecast.median_error_fh), (None, None));
    assert_eq!(forecast.ends_fh, vec![None; Draws::precise().least]);
}

#[test]
fn shares_of_the_drivers_are_counted_over_all_draws() {
    let forecast = run(&posterior(2, 800.0), &KNOWN, Draws::fixed(300), 1);
    let shares = forecast.driver_shares();
    assert_eq!(shares.len(), 4);
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    for (group, share) in shares.iter().enumerate() {
        let count = forecast.drivers.iter().filter(|driver| **driver == group).count();
        assert_eq!(*share, count as f64 / 300.0);
    }
    assert!(shares.iter().all(|share| *share <= shares[forecast.dominant_group()]));
}

/// Draws that never leave what is known end as if all were known; the others' ends spread.
#[test]
fn only_what_is_not_known_is_widened() {
    let known = posterior(1, 1000.0);
    let sure = run(&known, &KNOWN, Draws::fixed(1000), 1);
    let far = run(&known, &Sum { known_until: 5.0 }, Draws::fixed(1000), 1);
    assert_eq!((&far, far.outside_training_fraction), (&sure, 0.0));
    let spread = |forecast: &Forecast| quantile_fh(forecast, 0.9) - quantile_fh(forecast, 0.1);
    let nowhere = run(&known, &Sum { known_until: 0.01 }, Draws::fixed(1000), 1);
    let partly = run(&known, &Sum { known_until: 0.04 }, Draws::fixed(1000), 1);
    assert!(nowhere.outside_training_fraction > partly.outside_training_fraction);
    assert!(partly.outside_training_fraction > 0.0);
    assert!(spread(&nowhere) > 1.1 * spread(&sure), "{} and {}", spread(&nowhere), spread(&sure));
    let same = partly.ends_fh.iter().zip(&sure.ends_fh).filter(|(a, b)| a == b).count() as f64 / 1000.0;
    assert!(same > 0.05 && same <= 1.0 - 0.5 * partly.outside_training_fraction, "{same}");
}

/// A margin that may be asked for so many times.
struct Asked {
    margin: fn(&[f64]) -> f64,
    times: AtomicUsize,
}

impl Asked {
    const MOST: usize = 5_000_000;
}

impl Boundary for Asked {
    fn margin(&self, k: &[f64]) -> f64 {
        assert!(self.times.fetch_add(1, Ordering::Relaxed) < Self::MOST, "a path without end");
        (self.margin)(k)
    }
}

/// Boundaries that are hard to meet: kinked, flat, no number everywhere or in part, never crossed, infinitely steep.
const HARD: [fn(&[f64]) -> f64; 9] = [
    |k| -k.iter().sum::<f64>(),
    |k| k.iter().sum(),
    |k| 0.2 - (k[0] - 0.05).abs().max((k[3] - 0.5).abs()),
    |_| 0.0,
    |_| 1.0,
    |_| f64::NAN,
    |k| if k[0] < 0.05 { f64::NAN } else { -1.0 },
    |k| if k[0] < 0.05 { 1.0 } else { f64::NEG_INFINITY },
    |k| 0.1 - (k[0] + k[1] + k[2]).sqrt(),
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whatever the boundary, and however wildly faults grow, every draw comes to an end that is a number, or
    /// outlives the horizon.
    #[test]
    fn every_path_ends(
        margin in prop::sample::select(&HARD[..]),
        noise in prop::sample::select(&[0.0, 2.5e-4, 10.0][..]),
        growth in prop::sample::select(&[1e-6, 1.0, 1e4, 1e18][..]),
        bias_per_h in prop::sample::select(&[0.0, 2e-5, 1e3, -1e3, -1e14][..]),
        seed in 0..1000_u64,
    ) {
        let changes = GrowthChanges { probability: 1.0, start: growth, particles: 1, ..GrowthChanges::default() };
        let mut prior = FleetPrior { process_noise: noise, growth_changes: Some(changes), ..FleetPrior::vague() };
        prior.one_sided.dominant.mean_per_h = bias_per_h;
        prior.pair.minor.mean_per_h = bias_per_h;
        let new = Filter::new(&FaultModel::electrical(), &prior).posterior();
        let boundary = Asked { margin, times: AtomicUsize::new(0) };
        let forecast = run(&new, &boundary, Draws::fixed(8), seed);
        prop_assert!(forecast.ends_fh.iter().flatten().all(|end_fh| (0.0..8000.0).contains(end_fh)));
    }
}

/// Where the margin is no number a life counts as healthy, and its end is sought from there on.
#[test]
fn a_margin_that_is_no_number_is_not_a_failure_now() {
    let boundary = Asked { margin: HARD[6], times: AtomicUsize::new(0) };
    let new = Filter::new(&FaultModel::electrical(), &FleetPrior::vague()).posterior();
    let forecast = run(&new, &boundary, Draws::fixed(200), 1);
    assert_eq!(forecast.failed_fraction, 0.0);
    assert!(forecast.ends_fh.iter().flatten().count() > 20);
}

fn samples() -> Vec<LabelledFaults> {
    labelled::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/assess/surrogate_train.csv"))
}

/// A surrogate that never saw a shorted first winding is unsure of lives that end by one, and only of those.
#[test]
fn surrogates_know_what_they_have_not_learned() {
    let model = FaultModel::electrical();
    let without_first: Vec<LabelledFaults> = samples().into_iter().filter(|sample| sample.k[0] < 0.03).collect();
    let kinds = [
        (SurrogateSettings::FigureRegression(RegressionSettings::default()), 0.05),
        (SurrogateSettings::Svm(SvmSettings::default()), 1.0),
    ];
    for (settings, near) in kinds {
        let whole = Surrogate::train(&samples(), &model, &settings).unwrap();
        let part = Surrogate::train(&without_first, &model, &settings).unwrap();
        for sample in &samples() {
            let mut gradient = [0.0; 5];
            let looked = part.look(&sample.k, &mut gradient);
            assert_eq!(looked.value, part.margin(&sample.k));
            assert_eq!(looked.sigma > 0.0, part.outside_training(&sample.k).unwrap());
        }
        let far = [0.6, 0.0, 0.0, 0.5, 0.5];
        assert_eq!(part.outside_training(&far), Some(true));
        let near_boundary = || samples().into_iter().filter(|sample| whole.margin(&sample.k).abs() < near);
        let outside = near_boundary().filter(|sample| whole.outside_training(&sample.k) == Some(true)).count();
        assert!(outside as f64 <= 0.02 * near_boundary().count() as f64, "{outside} of its own samples");
    }
}

/// Surrogates written before they knew their domain can be read, and claim nothing.
#[test]
fn surrogates_without_a_domain_are_sure_everywhere() {
    let settings = SurrogateSettings::FigureRegression(RegressionSettings::default());
    let surrogate = Surrogate::train(&samples(), &FaultModel::electrical(), &settings).unwrap();
    let mut json = serde_json::to_value(&surrogate).unwrap();
    assert!(json.as_object_mut().unwrap().remove("reach").is_some());
    let older: Surrogate = serde_json::from_value(json).unwrap();
    let k = [9.0, 0.0, 0.0, 0.5, 0.5];
    let mut gradient = [0.0; 5];
    assert_eq!((older.outside_training(&k), older.look(&k, &mut gradient).sigma), (None, 0.0));
    assert!(surrogate.look(&k, &mut gradient).sigma > 0.0);
    assert_eq!(older.margin(&k), surrogate.margin(&k));
}
