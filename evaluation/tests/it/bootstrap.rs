//! Intervals over runs, and pairs of estimators.

use evaluation::{
    backtest::{Bootstrap, BootstrapSettings, Comparison, OracleGap, PredictionScore, RunScore, scoreboard},
    metrics::Horizon,
};
use numerics::Stream;

fn run(crps_fh: f64, predictions: usize) -> RunScore {
    let judge = |i: usize| PredictionScore {
        truth_fh: 100.0 + 300.0 * i as f64,
        crps_fh,
        pit: 0.5,
        covered_80: true,
        covered_95: true,
        undecided: false,
        doubted: false,
    };
    RunScore {
        predictions: (0..predictions).map(judge).collect(),
        median_errors: [None; 3],
        alpha_lambda: [None; 5],
        prognostic_horizon: Horizon::default(),
        life_horizon: Horizon::default(),
        cumulative_relative_accuracy: None,
        cumulative_event_accuracy: None,
    }
}

fn runs(seed: u64, mean_fh: f64, count: usize) -> Vec<RunScore> {
    let mut random = Stream::new(seed, &["runs"]);
    (0..count).map(|_| run(mean_fh + 50.0 * random.normal(), 5)).collect()
}

fn all(runs: &[RunScore]) -> Vec<&RunScore> {
    runs.iter().collect()
}

/// The mean of n independent values of standard deviation s lies within 1.645 s / sqrt(n) in 90 % of cases.
#[test]
fn an_interval_is_as_wide_as_the_error_of_the_mean() {
    let settings = BootstrapSettings { resamples: 300, ..BootstrapSettings::default() };
    let (mut width, mut held) = (0.0, 0.0);
    for seed in 0..60 {
        let runs = runs(seed, 200.0, 50);
        let interval = Bootstrap::new(&all(&runs), &settings).interval(|board| board.crps_fh).unwrap();
        width += (interval.high - interval.low) / 60.0;
        held += f64::from(u8::from((interval.low..=interval.high).contains(&200.0))) / 60.0;
    }
    let expected = 2.0 * 1.645 * 50.0 / 50f64.sqrt();
    assert!((width / expected - 1.0).abs() < 0.05, "{width}, expected {expected}");
    assert!((0.8..=0.98).contains(&held), "{held}");
}

#[test]
fn a_figure_that_resamples_lack_has_no_interval() {
    let runs = runs(1, 200.0, 10);
    let bootstrap = Bootstrap::new(&all(&runs), &BootstrapSettings::default());
    assert_eq!(bootstrap.interval(|board| board.at_rul[0].relative_error), None);
    assert_eq!(Bootstrap::new(&[], &BootstrapSettings::default()).interval(|board| board.crps_fh), None);
}

/// What makes a run hard for both drops out: the difference of 3 h is certain, though runs differ by 50 h.
#[test]
fn estimators_are_compared_run_by_run() {
    let theirs = runs(1, 200.0, 40);
    let ours: Vec<RunScore> = theirs.iter().map(|score| run(score.predictions[0].crps_fh - 3.0, 5)).collect();
    let settings = BootstrapSettings::default();
    let comparison = Comparison::of(&all(&ours), &all(&theirs), &settings).unwrap();
    let interval = comparison.interval_fh.unwrap();
    assert!((comparison.crps_difference_fh + 3.0).abs() < 1e-9);
    assert!((interval.low + 3.0).abs() < 1e-9 && (interval.high + 3.0).abs() < 1e-9);
    assert_eq!((comparison.runs, comparison.better_runs), (40, 1.0));
    let same = Comparison::of(&all(&theirs), &all(&theirs), &settings).unwrap();
    assert_eq!((same.crps_difference_fh, same.better_runs), (0.0, 0.5));
    assert_eq!(Comparison::of(&[], &[], &settings), None);
}

#[test]
fn bins_of_remaining_life_hold_every_prediction_once() {
    let runs = [run(100.0, 20), run(300.0, 3)];
    let board = scoreboard(&all(&runs));
    assert_eq!(board.by_rul.iter().map(|bin| bin.predictions).sum::<usize>(), board.predictions);
    let first = board.by_rul[0];
    assert_eq!((first.from_fh, first.to_fh, first.runs, first.predictions), (0.0, Some(500.0), 2, 4));
    assert_eq!(first.crps_fh, Some(200.0));
    let last = board.by_rul[7];
    assert_eq!((last.from_fh, last.to_fh, last.runs, last.coverage.level_80), (3500.0, None, 1, Some(1.0)));
}

#[test]
fn the_gap_is_closed_by_the_oracle_and_open_for_climatology() {
    let settings = BootstrapSettings::default();
    let (climatology, oracle) = (runs(1, 300.0, 40), runs(2, 120.0, 40));
    let halfway: Vec<_> = climatology
        .iter()
        .zip(&oracle)
        .map(|(a, b)| run(0.5 * (a.predictions[0].crps_fh + b.predictions[0].crps_fh), 5))
        .collect();
    let gap = |ours: &[RunScore]| OracleGap::of(&all(ours), &all(&climatology), &all(&oracle), &settings);
    for (ours, closed) in [(&climatology, 0.0), (&oracle, 1.0), (&halfway, 0.5)] {
        let gap = gap(ours).unwrap();
        assert!((gap.closed - closed).abs() < 1e-12 && gap.runs == 40, "{gap:?}");
        let interval = gap.interval.unwrap();
        assert!((interval.low - closed).abs() < 1e-12 && (interval.high - closed).abs() < 1e-12, "whatever the runs");
    }
    let worse = gap(&runs(3, 400.0, 40)).unwrap();
    let interval = worse.interval.unwrap();
    assert!(worse.closed < 0.0 && interval.low < worse.closed && worse.closed < interval.high, "{worse:?}");
    assert_eq!(OracleGap::of(&all(&oracle), &all(&oracle), &all(&climatology), &settings), None, "no gap to close");
    assert_eq!(OracleGap::of(&[], &[], &[], &settings), None);
}
