//! The filter with growth changes, on lives whose truth is known.

use crate::simulated::{Growth, STEP_FH, observe};
use domain::FaultModel;
use evaluation::metrics;
use numerics::Stream;
use prognosis::{
    Boundary, Clock, Draws, Filter, FleetPrior, Forecast, ForecastSettings, GrowthChanges, Observation, blocks,
    forecast,
};
use rayon::prelude::*;

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

fn with(growth_changes: GrowthChanges) -> FleetPrior {
    FleetPrior { growth_changes: Some(growth_changes), ..FleetPrior::vague() }
}

fn filter(observations: &[Observation], prior: &FleetPrior) -> Filter {
    let mut filter = Filter::new(&FaultModel::electrical(), prior);
    blocks(observations, &Clock::default()).iter().for_each(|block| filter.update(block));
    filter
}

/// The first winding dominant, with rates of the grid.
fn growth() -> Growth {
    let rates = FleetPrior::vague().rates_per_h;
    Growth {
        rate_per_h: [rates[8], rates[5], rates[5], rates[6], rates[6]],
        bias_per_h: [2.5e-5, 4e-6, 4e-6, 3e-6, -3e-6],
        process_noise: 2.5e-5,
        changes: Vec::new(),
    }
}

/// 2,400 h with a tenth of the usual noise.
fn life(changes: &[(f64, f64)]) -> Vec<Observation> {
    let mut random = Stream::new(2, &["changing"]);
    let growth = Growth { changes: changes.to_vec(), ..growth() };
    observe(&growth.path(2400.0, &mut random), 0.1, &mut random)
}

fn sharp() -> FleetPrior {
    FleetPrior { process_noise: 2.5e-5, ..with(GrowthChanges { particles: 100, ..GrowthChanges::default() }) }
}

/// The multipliers of a life drawn from the law, up to 9,000 h.
fn draw_changes(law: &GrowthChanges, random: &mut Stream) -> Vec<(f64, f64)> {
    let mut changes = Vec::new();
    if random.uniform() < law.probability {
        changes.push((0.0, law.start));
        let mut at_fh = law.interval_fh * random.exponential();
        while at_fh < 9000.0 {
            let factor = (1.0 + law.mean_increase * random.exponential()).min(law.largest_factor);
            changes.push((at_fh, changes[changes.len() - 1].1 * factor));
            at_fh += law.interval_fh * random.exponential();
        }
    }
    changes
}

#[test]
fn where_growth_never_changes_it_is_the_filter_of_constant_growth() {
    let seen = &life(&[])[..700];
    let constant = filter(seen, &FleetPrior::vague()).posterior();
    let impossible = with(GrowthChanges { probability: 0.0, ..GrowthChanges::default() });
    assert_eq!(filter(seen, &impossible).posterior(), constant);
    let never = GrowthChanges { start: 1.0, interval_fh: f64::INFINITY, particles: 3, ..GrowthChanges::default() };
    let known = filter(seen, &with(never)).posterior();
    assert!((known.changing_probability() - 0.5).abs() < 1e-9);
    for (entry, other) in known.entries().iter().zip(constant.entries()) {
        assert!((entry.deviation.mean - other.deviation.mean).abs() < 1e-12);
        assert!((entry.rate_per_h.sigma - other.rate_per_h.sigma).abs() < 1e-12);
        assert!((entry.bias_per_h.mean - other.bias_per_h.mean).abs() < 1e-15);
    }
}

#[test]
fn a_change_is_detected_and_measured() {
    let changed = filter(&life(&[(0.0, 0.75), (1400.0, 1.5)]), &sharp()).posterior();
    assert!(changed.changing_probability() > 0.95, "{}", changed.changing_probability());
    // Rates are known up to the multiplier at the start of life; their product is what carries damage on.
    let truth = 1.5 * growth().rate_per_h[0];
    let rate = changed.entries()[0].rate_per_h;
    assert!((rate.mean / truth - 1.0).abs() < 0.2, "{rate:?}, truth {truth}");
    let before = filter(&life(&[(0.0, 0.75)])[..700], &sharp()).posterior();
    let earlier = before.entries()[0].rate_per_h;
    assert!(rate.mean > 1.5 * earlier.mean, "{earlier:?}, then {rate:?}");
    assert!(changed.growth().mean > before.growth().mean);
    let constant = filter(&life(&[]), &sharp()).posterior();
    assert!(constant.changing_probability() < 0.5, "{}", constant.changing_probability());
}

#[test]
fn a_change_is_dated_and_measured() {
    let posterior = filter(&life(&[(0.0, 0.75), (1400.0, 1.5)]), &sharp()).posterior();
    let growth = posterior.growth_summary().expect("a filter that follows changes");
    assert_eq!((growth.multiplier, growth.sigma), (posterior.growth().mean, posterior.growth().sigma));
    assert!(growth.changed_probability > 0.95, "{growth:?}");
    let change = growth.latest_change.expect("a change");
    assert!(change.from_fh < 1400.0 && 1400.0 < change.to_fh, "{change:?}");
    assert!(change.to_fh - change.from_fh < 500.0, "{change:?}");
    assert!((1.2..=3.0).contains(&change.factor), "{change:?}");
    assert!((1.0..=change.factor).contains(&change.factor_p10) && change.factor < change.factor_p90, "{change:?}");
}

#[test]
fn growth_that_stays_shows_no_change() {
    let growth = filter(&life(&[]), &sharp()).posterior().growth_summary().expect("a filter that follows changes");
    assert!(growth.changed_probability < 0.5, "{growth:?}");
    assert_eq!(growth.latest_change, None);
    assert_eq!(filter(&life(&[]), &FleetPrior::vague()).posterior().growth_summary(), None);
}

#[test]
fn states_and_draws_depend_neither_on_threads_nor_on_the_order_within_a_time() {
    let prior = with(GrowthChanges { particles: 12, ..GrowthChanges::default() });
    let lives: Vec<Vec<Observation>> = (0..6u32).map(|i| life(&[(0.0, 1.0 + 0.2 * f64::from(i))])).collect();
    let run = |threads| -> Vec<(Filter, Forecast)> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let predict = |life: &Vec<Observation>| {
            let known = filter(life, &prior);
            let settings = ForecastSettings { draws: Draws::fixed(50), ..ForecastSettings::default() };
            let predicted = forecast(&known.posterior(), 3.0, &Sum, None, &settings, &Stream::new(1, &["threads"]));
            (known, predicted)
        };
        pool.install(|| lives.par_iter().map(predict).collect())
    };
    let alone = run(1);
    assert!(alone == run(2) && alone == run(8));
    let mut paired = lives[0].clone();
    paired.chunks_mut(2).for_each(|pair| {
        let t_fh = pair[0].t_fh;
        pair.iter_mut().for_each(|observation| observation.t_fh = t_fh);
    });
    let known = filter(&paired, &prior);
    paired.chunks_mut(2).for_each(<[Observation]>::reverse);
    assert!(known == filter(&paired, &prior));
}

#[test]
fn draws_that_change_end_earlier_than_draws_that_do_not() {
    let seen = &life(&[])[..500];
    let ends = |growth_changes| {
        let known = filter(seen, &with(growth_changes)).posterior();
        let settings = ForecastSettings { draws: Draws::fixed(400), ..ForecastSettings::default() };
        let predicted = forecast(&known, 0.0, &Sum, None, &settings, &Stream::new(1, &["earlier"]));
        let ends = predicted.ends_fh.iter().map(|end| end.unwrap_or(settings.horizon_fh));
        ends.sum::<f64>() / settings.draws.least as f64
    };
    let certain = GrowthChanges { probability: 1.0, start: 1.0, particles: 10, ..GrowthChanges::default() };
    let never = GrowthChanges { interval_fh: f64::INFINITY, ..certain };
    let (often, never) = (ends(GrowthChanges { interval_fh: 800.0, ..certain }), ends(never));
    assert!(often < 0.9 * never, "{often} and {never}");
}

/// Following such a law would never end.
#[test]
fn a_law_of_changes_without_pause_is_not_read() {
    let mut json = serde_json::to_value(GrowthChanges::default()).unwrap();
    assert_eq!(serde_json::from_value::<GrowthChanges>(json.clone()).unwrap(), GrowthChanges::default());
    json["interval_fh"] = 0.0.into();
    let refused = serde_json::from_value::<GrowthChanges>(json).unwrap_err().to_string();
    assert!(refused.contains("every 0 h"), "{refused}");
}

/// Lives from the prior and the law, judged after some time: intervals hold what they promise.
#[test]
fn slow_intervals_are_calibrated_on_lives_whose_growth_changes() {
    let law = GrowthChanges::default();
    let prior = with(law);
    let (now_fh, horizon_fh) = (1000.0, 8000.0);
    let settings = ForecastSettings { draws: Draws::fixed(300), horizon_fh, step_fh: 20.0 };
    let rank = |life| {
        let mut random = Stream::new(9, &["calibration"]).substream(life);
        let changes = draw_changes(&law, &mut random);
        let growth = Growth { changes, ..Growth::draw(&prior, &mut random) };
        let path = growth.path(now_fh + horizon_fh, &mut random);
        let faulty = |x: &[f64; 5]| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0;
        let truth_fh = path.iter().position(faulty).map_or(f64::INFINITY, |step| step as f64 * STEP_FH) - now_fh;
        let seen = observe(&path[..=(now_fh / STEP_FH) as usize], 1.0, &mut random);
        let known = filter(&seen, &prior).posterior();
        let predicted = forecast(&known, now_fh - known.t_fh(), &Sum, None, &settings, &random);
        (truth_fh > 0.0).then(|| metrics::pit(&predicted.ends_fh, truth_fh))
    };
    let ranks: Vec<f64> = (0..500u64).into_par_iter().filter_map(rank).collect();
    let share = |low: f64, high: f64| {
        ranks.iter().filter(|rank| (low..=high).contains(*rank)).count() as f64 / ranks.len() as f64
    };
    assert!(ranks.len() > 350, "{} lives outlived the observation", ranks.len());
    assert!((0.75..=0.86).contains(&share(0.1, 0.9)), "coverage {}", share(0.1, 0.9));
    assert!((0.44..=0.56).contains(&share(0.0, 0.5)), "below the median {}", share(0.0, 0.5));
}
