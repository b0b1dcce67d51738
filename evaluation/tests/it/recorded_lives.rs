//! Lives of any unit, taught and judged: units change nothing.

use domain::FaultVector;
use evaluation::{
    RecordedEnd, RecordedLife, Records,
    backtest::{ReplaySettings, RulSummary, replay},
};
use numerics::Stream;
use prognosis::{
    EndedLife, Ending, Estimator, Lesson, Limits, NoLesson, Observation, PredictionSettings, fit_residual_noise,
    scale::reference_faults,
};

/// Lives that wear by a power of time, seen at eleven irregular times or so; the last of them was removed.
fn fleet(lives: usize) -> Records {
    let mut stream = Stream::new(11, &["recorded lives"]);
    let mut life = |number: usize| {
        let (pace, power) = (250.0 * (0.2 * stream.normal()).exp(), 1.5 + 0.2 * stream.normal());
        let removed = number + 1 == lives;
        let last = if removed { 0.7 * pace } else { pace };
        let mut times: Vec<f64> =
            (0..11).map(|i| 0.1 * pace * (f64::from(i) + 0.4 * stream.uniform())).filter(|time| *time < last).collect();
        times.push(last * 0.999);
        let severity = |time: &f64| vec![(time / pace).powf(power) + 0.004 * stream.normal()];
        let ending = if removed { Ending::Removed } else { Ending::Failed };
        RecordedLife {
            unit: number.to_string(),
            severities: times.iter().map(severity).collect(),
            times,
            stress: Vec::new(),
            end: Some(RecordedEnd { time: last, ending }),
        }
    };
    Records {
        time_unit: "days".to_owned(),
        faults: vec!["wear".to_owned()],
        sigma: vec![None],
        lives: (0..lives).map(&mut life).collect(),
    }
}

/// The same lives in other units.
fn converted(records: &Records, time: f64, severity: impl Fn(f64) -> f64) -> Records {
    let mut converted = records.clone();
    for life in &mut converted.lives {
        life.times.iter_mut().for_each(|t| *t *= time);
        life.severities.iter_mut().flatten().for_each(|x| *x = severity(*x));
        life.end.iter_mut().for_each(|end| end.time *= time);
    }
    converted
}

/// What the mixture says of the last two lives, taught by the others, in the unit of time.
fn predictions(records: &Records, every: f64) -> Vec<f64> {
    let (teach, judge) = records.lives.split_at(records.lives.len() - 2);
    let [teach, judge] = [teach, judge].map(|lives| Records { lives: lives.to_vec(), ..records.clone() });
    let (scale, model) = (teach.scale().unwrap(), reference_faults(records.faults.clone()));
    let silent: Vec<Vec<Observation>> =
        teach.ended(&scale, &[0.0]).into_iter().map(|EndedLife { observations, .. }| observations).collect();
    let sigma = fit_residual_noise(&silent, 1).unwrap();
    let lesson = Lesson::learn(&teach.ended(&scale, &sigma), &model, 1).unwrap();
    let limits = Limits::reference(1);
    let prediction = PredictionSettings { draws: 200, horizon_fh: 10_000.0 };
    let settings = ReplaySettings { every_fh: scale.reference_fh(every), prediction, seed: 1 };
    let estimators: [Box<dyn Estimator + '_>; 2] =
        [Box::new(lesson.mixture(&model, &limits)), Box::new(lesson.growth(&model, &limits))];
    let told = |RulSummary { t_fh, mean_fh, quantiles_fh, .. }: RulSummary| {
        let figures = [t_fh, mean_fh].into_iter().chain(quantiles_fh.into_iter().flatten());
        figures.map(|fh| scale.time(fh)).collect::<Vec<f64>>()
    };
    let runs = judge.runs(&scale, &sigma, every);
    let replays = estimators.iter().flat_map(|estimator| {
        runs.iter().map(|recorded| replay(&recorded.run, estimator.as_ref(), &settings)).collect::<Vec<_>>()
    });
    replays.flat_map(|replay| replay.predictions).flat_map(told).collect()
}

#[test]
fn a_power_of_two_of_the_unit_of_time_changes_no_bit_and_any_other_factor_no_more_than_rounding() {
    let (records, every) = (fleet(11), 30.0);
    let plain = predictions(&records, every);
    assert!(plain.len() > 200);
    let scaled = predictions(&converted(&records, 1024.0, |x| x), 1024.0 * every);
    assert!(plain.iter().zip(&scaled).all(|(a, b)| (a * 1024.0).to_bits() == b.to_bits()));
    for factor in [24.0, 3.7e-3] {
        let scaled = predictions(&converted(&records, factor, |x| x), factor * every);
        let worst = plain.iter().zip(&scaled).map(|(a, b)| (a * factor / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(plain.len() == scaled.len() && worst < 1e-9, "{worst} of times {factor}");
    }
}

#[test]
fn the_unit_of_severity_changes_nothing() {
    let records = fleet(9);
    let plain = predictions(&records, 30.0);
    // Read in tenths of a millimetre from 9 to 49.8, and back.
    let rounded = converted(&records, 1.0, |x| ((9.0 + 40.8 * x) * 25.4 - 9.0 * 25.4) / (40.8 * 25.4));
    let same = predictions(&rounded, 30.0);
    assert!(plain.iter().zip(&same).all(|(a, b)| (a / b - 1.0).abs() < 1e-9));
}

#[test]
fn lives_that_do_not_teach_are_refused() {
    let mut records = fleet(6);
    let model = reference_faults(records.faults.clone());
    records.lives.iter_mut().for_each(|life| life.end.as_mut().unwrap().ending = Ending::Removed);
    assert_eq!(records.scale(), None);
    let scale = fleet(6).scale().unwrap();
    let refused = Lesson::learn(&records.ended(&scale, &[0.001]), &model, 1).unwrap_err();
    assert!(matches!(refused, NoLesson::Failure(_)), "{refused}");
    let nothing = EndedLife { observations: Vec::new(), flights: Vec::new(), end_fh: 100.0, ending: Ending::Failed };
    assert!(matches!(Lesson::learn(&[nothing], &model, 1), Err(NoLesson::History(_))));
}

/// One life that teaches is little, and still an answer: nothing is not finite, and the interval is wide.
#[test]
fn one_life_teaches_a_wide_answer() {
    let records = fleet(4);
    let (scale, model) = (fleet(1 + 2).scale().unwrap(), reference_faults(records.faults.clone()));
    let one = Records { lives: records.lives[..1].to_vec(), ..records.clone() };
    let lesson = Lesson::learn(&one.ended(&scale, &[0.01]), &model, 1).unwrap();
    let limits = Limits::reference(1);
    let mixture = lesson.mixture(&model, &limits);
    let mut follower = mixture.follow();
    let seen = |t_fh: f64, x: f64| Observation {
        t_fh,
        fault_vector: FaultVector(vec![x]),
        sigma: vec![0.01],
        load: None,
        temperature: None,
    };
    [(0.0, 0.0), (500.0, 0.01), (1000.0, 0.03), (2000.0, 0.08)]
        .iter()
        .for_each(|(t, x)| follower.observe(&seen(*t, *x)));
    let settings = PredictionSettings { draws: 1000, horizon_fh: 10_000.0 };
    let mut ends: Vec<f64> =
        follower.predict(2000.0, &settings, &Stream::new(1, &["one"])).ends_fh.into_iter().flatten().collect();
    ends.sort_by(f64::total_cmp);
    let (p10, p90) = (ends[ends.len() / 10], ends[9 * ends.len() / 10]);
    assert!(ends.iter().all(|end| end.is_finite()) && p90 > 1.5 * p10 && p10 < 5000.0, "{p10} to {p90}");
}
