//! Filter, forecast and learning on lives whose truth is known.

use crate::simulated::{Growth, STEP_FH, observe};
use domain::{FaultModel, FaultVector};
use evaluation::metrics;
use numerics::Stream;
use prognosis::{
    Boundary, Clock, Draws, FailureTimeError, Filter, FinishedLife, FitSettings, FleetPrior, Forecast,
    ForecastSettings, NoHistory, Observation, Posterior, blocks, fit_failure_time_error, fit_prior, forecast,
};
use rayon::prelude::*;

/// Margin 1 - a . |x|, linear while no deviation changes sign.
struct Weighted(Vec<f64>);

impl Boundary for Weighted {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        let load: f64 = k.iter().zip(&nominal).zip(&self.0).map(|((k, nominal), a)| a * (k - nominal).abs()).sum();
        1.0 - load
    }
}

fn posterior(observations: &[Observation], prior: &FleetPrior) -> Posterior {
    let mut filter = Filter::new(&FaultModel::electrical(), prior);
    blocks(observations, &Clock::default()).iter().for_each(|block| filter.update(block));
    filter.posterior()
}

fn quiet() -> FleetPrior {
    FleetPrior { process_noise: 1e-9, ..FleetPrior::vague() }
}

/// The growth of [`quiet_life`]: rates of the grid, the first winding dominant.
fn quiet_growth() -> Growth {
    let rates = FleetPrior::vague().rates_per_h;
    Growth {
        rate_per_h: [rates[7], rates[3], rates[3], rates[5], rates[5]],
        bias_per_h: [2.5e-5, 4e-6, 4e-6, 3e-6, -3e-6],
        process_noise: 0.0,
        changes: Vec::new(),
    }
}

/// 1,500 h of almost exact observations of noiseless growth.
fn quiet_life() -> Vec<Observation> {
    let mut random = Stream::new(1, &["quiet"]);
    observe(&quiet_growth().path(1500.0, &mut random), 1e-3, &mut random)
}

/// A life drawn from the vague prior, seen for some time.
fn noisy_posterior(until_fh: f64) -> Posterior {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(4, &["noisy"]));
    let path = Growth::draw(&prior, &mut random).path(until_fh, &mut random);
    posterior(&observe(&path, 1.0, &mut random), &prior)
}

fn ends(forecast: &Forecast) -> Vec<f64> {
    forecast.ends_fh.iter().flatten().copied().collect()
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt())
}

/// What is hidden below nominal is not a fault, however long nothing but nominal was seen.
#[test]
fn what_was_only_ever_seen_healthy_has_not_failed() {
    let model = FaultModel::electrical();
    let seen = |number: u32| Observation {
        t_fh: 5.0 * f64::from(number),
        fault_vector: FaultVector(model.nominal.clone()),
        sigma: vec![0.003; 5],
        load: None,
        temperature: None,
    };
    let posterior = posterior(&(0..2000).map(seen).collect::<Vec<_>>(), &FleetPrior::vague());
    let boundary = Weighted(vec![4.0, 4.0, 4.0, 0.0, 0.0]);
    let forecast =
        forecast(&posterior, 0.0, &boundary, None, &ForecastSettings::default(), &Stream::new(1, &["healthy"]));
    assert!(forecast.failed_fraction < 0.01, "{}", forecast.failed_fraction);
}

#[test]
fn rate_and_bias_of_noiseless_growth_are_recovered() {
    let known = posterior(&quiet_life(), &quiet());
    let truth = quiet_growth();
    for (entry, estimate) in known.entries().iter().enumerate() {
        let (rate, bias) = (truth.rate_per_h[entry], truth.bias_per_h[entry]);
        let deviation = bias / rate * (rate * known.t_fh()).exp_m1();
        assert!((estimate.deviation.mean - deviation).abs() < 1e-5, "{entry}: {estimate:?}");
        assert!((estimate.rate_per_h.mean / rate - 1.0).abs() < 0.02, "{entry}: {estimate:?}");
        assert!((estimate.bias_per_h.mean / bias - 1.0).abs() < 0.02, "{entry}: {estimate:?}");
        let trend = rate * deviation + bias;
        assert!((estimate.trend_per_h.mean / trend - 1.0).abs() < 0.01, "{entry}: {estimate:?}");
    }
    assert!(known.dominance()[0] > 0.99);
}

#[test]
fn reports_agree_with_the_estimates() {
    let known = posterior(&quiet_life(), &quiet());
    let (entries, trends, propagation) = (known.entries(), known.trends(), known.propagation());
    for (i, entry) in entries.iter().enumerate() {
        assert_eq!(trends[i].value, [0.0, 0.0, 0.0, 0.5, 0.5][i] + entry.deviation.mean);
        assert_eq!(trends[i].trend_per_1000_fh, 1000.0 * entry.trend_per_h.mean);
        let modelled = propagation.state_matrix[i][i] * entry.deviation.mean + propagation.control_matrix[i][0];
        assert!((modelled / entry.trend_per_h.mean - 1.0).abs() < 0.01);
        assert_eq!(propagation.control_matrix_sigma[i].len(), 3);
        assert!(propagation.control_matrix_sigma[i][0] > 0.0);
    }
    let closed: usize = blocks(&quiet_life(), &Clock::default()).iter().map(|block| block.observations.len()).sum();
    assert_eq!(propagation.observations, closed);
}

#[test]
fn noiseless_growth_ends_where_the_closed_solution_crosses() {
    let known = posterior(&quiet_life(), &quiet());
    let threshold = 0.1;
    let boundary = Weighted(vec![1.0 / threshold, 0.0, 0.0, 0.0, 0.0]);
    let (rate, bias) = (quiet_growth().rate_per_h[0], quiet_growth().bias_per_h[0]);
    let crossing = (1.0 + threshold * rate / bias).ln() / rate;
    let lag_fh = 11.0;
    let predicted =
        forecast(&known, lag_fh, &boundary, None, &ForecastSettings::default(), &Stream::new(2, &["closed"]));
    let (mean, sd) = mean_and_sd(&ends(&predicted));
    let truth = crossing - known.t_fh() - lag_fh;
    assert_eq!(predicted.failed_fraction, 0.0);
    assert!((mean - truth).abs() < 3.0 && sd < 10.0, "{mean} +- {sd}, truth {truth}");
    assert_eq!(predicted.dominant_group(), 0);
}

#[test]
fn spread_of_the_ends_does_not_depend_on_the_step() {
    let known = noisy_posterior(1200.0);
    let boundary = Weighted(vec![8.0, 8.0, 8.0, 6.0, 6.0]);
    let spread = |step_fh| {
        let settings = ForecastSettings { draws: Draws::fixed(4000), horizon_fh: 20_000.0, step_fh };
        mean_and_sd(&ends(&forecast(&known, 0.0, &boundary, None, &settings, &Stream::new(3, &["step"]))))
    };
    let (mean, sd) = spread(20.0);
    for step_fh in [5.0, 60.0] {
        let (other_mean, other_sd) = spread(step_fh);
        assert!((other_sd / sd - 1.0).abs() < 0.05, "sd {other_sd} at {step_fh} h, {sd} at 20 h");
        assert!((other_mean - mean).abs() < 0.1 * sd, "mean {other_mean} at {step_fh} h, {mean} at 20 h");
    }
}

#[test]
fn draws_depend_on_their_index_only() {
    let known = noisy_posterior(800.0);
    let boundary = Weighted(vec![8.0, 8.0, 8.0, 6.0, 6.0]);
    let run = |draws| {
        let settings = ForecastSettings { draws: Draws::fixed(draws), ..ForecastSettings::default() };
        forecast(&known, 5.0, &boundary, None, &settings, &Stream::new(9, &["index"]))
    };
    let (few, many) = (run(100), run(300));
    assert_eq!(few.ends_fh, many.ends_fh[..100]);
    assert_eq!(few.drivers, many.drivers[..100]);
}

#[test]
fn what_is_faulty_ends_now_and_what_cannot_fail_is_censored() {
    let known = noisy_posterior(800.0);
    struct Constant(f64);
    impl Boundary for Constant {
        fn margin(&self, _: &[f64]) -> f64 {
            self.0
        }
    }
    let run = |margin, error| {
        let stream = Stream::new(5, &["ends"]);
        forecast(&known, 0.0, &Constant(margin), error, &ForecastSettings::default(), &stream)
    };
    let faulty = run(-0.1, None);
    assert_eq!(faulty.failed_fraction, 1.0);
    assert!(faulty.ends_fh.iter().all(|end| *end == Some(0.0)));
    let sound = run(0.1, None);
    assert_eq!(sound.failed_fraction, 0.0);
    assert!(sound.ends_fh.iter().all(Option::is_none));
    let uncertain = run(-0.1, Some(FailureTimeError { offset_fh: 50.0, sd_fh: 0.0 }));
    assert!(uncertain.ends_fh.iter().all(|end| *end == Some(50.0)));
}

#[test]
fn the_driver_is_the_group_that_the_boundary_looks_at() {
    let known = noisy_posterior(800.0);
    let run = |weights: [f64; 5]| {
        let boundary = Weighted(weights.into());
        forecast(&known, 0.0, &boundary, None, &ForecastSettings::default(), &Stream::new(6, &["driver"]))
    };
    assert!(run([0.0, 8.0, 0.0, 0.0, 0.0]).drivers.iter().all(|&driver| driver == 1));
    assert_eq!(run([0.0, 0.0, 0.0, 8.0, 8.0]).dominant_group(), 3);
}

/// Lives from the prior, judged half way: the model's own intervals hold what they promise.
#[test]
fn slow_intervals_are_calibrated_on_lives_from_the_prior() {
    let prior = FleetPrior::vague();
    let boundary = Weighted(vec![8.0, 8.0, 8.0, 8.0, 8.0]);
    let (now_fh, horizon_fh) = (800.0, 8000.0);
    let settings = ForecastSettings { draws: Draws::fixed(400), horizon_fh, step_fh: 20.0 };
    let ranks: Vec<f64> = (0..800)
        .into_par_iter()
        .filter_map(|life| {
            let mut random = Stream::new(8, &["calibration"]).substream(life);
            let path = Growth::draw(&prior, &mut random).path(now_fh + horizon_fh, &mut random);
            let faulty = |x: &[f64; 5]| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0;
            let truth_fh = path.iter().position(faulty).map_or(f64::INFINITY, |step| step as f64 * STEP_FH) - now_fh;
            let seen = observe(&path[..=(now_fh / STEP_FH) as usize], 1.0, &mut random);
            let known = posterior(&seen, &prior);
            let predicted = forecast(&known, now_fh - known.t_fh(), &boundary, None, &settings, &random);
            (truth_fh > 0.0).then(|| metrics::pit(&predicted.ends_fh, truth_fh))
        })
        .collect();
    let share = |low: f64, high: f64| {
        ranks.iter().filter(|rank| (low..=high).contains(*rank)).count() as f64 / ranks.len() as f64
    };
    assert!(ranks.len() > 700, "{} lives outlived the observation", ranks.len());
    assert!((0.76..=0.84).contains(&share(0.1, 0.9)), "coverage {}", share(0.1, 0.9));
    assert!((0.45..=0.55).contains(&share(0.0, 0.5)), "below the median {}", share(0.0, 0.5));
}

fn fleet(prior: &FleetPrior, lives: u64) -> Vec<Vec<Observation>> {
    let life = |index| {
        let mut random = Stream::new(11, &["fleet"]).substream(index);
        let path = Growth::draw(prior, &mut random).path(2500.0, &mut random);
        observe(&path, 1.0, &mut random)
    };
    (0..lives).into_par_iter().map(life).collect()
}

#[test]
fn the_prior_of_a_fleet_is_learned() {
    let mut truth = FleetPrior::vague();
    truth.one_sided.dominant.mean_per_h = 4e-5;
    truth.pair.dominance = 0.0;
    truth.process_noise = 1.5e-4;
    let learned = fit_prior(&fleet(&truth, 80), &FaultModel::electrical(), &FitSettings::default()).unwrap();
    let dominant = learned.one_sided.dominant;
    assert!((dominant.mean_per_h / 4e-5 - 1.0).abs() < 0.15, "{dominant:?}");
    assert!((learned.process_noise / 1.5e-4 - 1.0).abs() < 0.1, "{}", learned.process_noise);
    assert!(learned.pair.dominance < 0.1 && (learned.one_sided.dominance - 1.0 / 3.0).abs() < 0.04, "{learned:?}");
    let mean_rate = |prior: &FleetPrior| {
        let weighted = prior.rates_per_h.iter().zip(&prior.one_sided.rate_weights).map(|(rate, weight)| rate * weight);
        weighted.sum::<f64>()
    };
    assert!((mean_rate(&learned) / mean_rate(&truth) - 1.0).abs() < 0.15, "{}", mean_rate(&learned));
}

#[test]
fn learning_and_forecasting_do_not_depend_on_the_number_of_threads() {
    let histories = fleet(&FleetPrior::vague(), 12);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let model = FaultModel::electrical();
            let prior = fit_prior(&histories, &model, &FitSettings { rounds: 2, ..FitSettings::default() }).unwrap();
            let boundary = Weighted(vec![8.0; 5]);
            let predict = |history: &Vec<Observation>| {
                let known = posterior(history, &prior);
                forecast(&known, 3.0, &boundary, None, &ForecastSettings::default(), &Stream::new(1, &["threads"]))
            };
            let forecasts: Vec<Forecast> = histories.par_iter().map(predict).collect();
            (prior, forecasts)
        })
    };
    let alone = run(1);
    assert_eq!(alone, run(2));
    assert_eq!(alone, run(8));
}

#[test]
fn nothing_is_learned_from_no_closed_block() {
    let histories = vec![quiet_life()[..5].to_vec(), Vec::new()];
    let refused = fit_prior(&histories, &FaultModel::electrical(), &FitSettings::default());
    assert_eq!(refused, Err(NoHistory { histories: 2 }));
}

/// Lives that fail 40 h before they reach the boundary that the forecast sees.
#[test]
fn the_error_of_the_boundary_in_failure_time_is_learned() {
    let prior = FleetPrior::vague();
    let boundary = Weighted(vec![8.0; 5]);
    let finished = |index| {
        let mut random = Stream::new(12, &["finished"]).substream(index);
        let path = Growth::draw(&prior, &mut random).path(8000.0, &mut random);
        let crossing = path.iter().position(|x| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0)?;
        let failure_fh = crossing as f64 * STEP_FH - 40.0;
        Some(FinishedLife { observations: observe(&path[..crossing], 1.0, &mut random), failure_fh })
    };
    let lives: Vec<FinishedLife> = (0..90).filter_map(finished).collect();
    let learn = |lives: &[FinishedLife]| fit_failure_time_error(lives, &FaultModel::electrical(), &prior, &boundary, 1);
    let error = learn(&lives).unwrap();
    assert!((error.offset_fh + 40.0).abs() < 12.0, "{error:?}");
    assert!(error.sd_fh < 40.0, "{error:?}");
    assert_eq!(learn(&lives[..9]), None);
}
