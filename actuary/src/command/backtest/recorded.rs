//! Lives whose limits are told by their user: some teach, the others are judged, in the unit of their times.

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::{Contestant, Digest, Judged, Metrics, Records, Terms, backtest::ReplaySettings, replay_all};
use indicatif::ProgressBar;
use numerics::quantile;
use prognosis::{Climatology, PredictionSettings, Scale, scale::reference_faults};
use serde::Serialize;

use super::{Arguments, EstimatorName, SEED, refuse, write};
use crate::{
    exit::Failure,
    files::{
        output::OutputFolder,
        records::{self, Lives, Tables},
    },
    say::note,
};

/// Judged where none is named.
const DEFAULT_ESTIMATORS: &[EstimatorName] = &[EstimatorName::Climatology];
/// Predictions of a characteristic life, and its multiple that is the horizon, where nothing else is told.
const PREDICTIONS: f64 = 25.0;
const HORIZON_LIVES: f64 = 2.0;
/// More predictions of one life are a mistake.
const MOST_PREDICTIONS: f64 = 10_000.0;

/// What the lives that teach have taught.
#[derive(Debug, Serialize)]
struct Lesson {
    /// The measure of the fleet.
    #[serde(flatten)]
    scale: Scale,
    #[serde(skip)]
    lives_fh: Vec<f64>,
}

/// Reads, learns, judges and writes.
pub fn run(arguments: &Arguments, out: &OutputFolder, bar: &ProgressBar) -> Result<()> {
    let tables = Tables {
        histories: &arguments.histories,
        prior: arguments.prior.as_deref(),
        split: arguments.split.map(std::num::NonZeroUsize::get),
    };
    let Lives { teach, judge, measures, notes } = records::read(tables, &arguments.records)?;
    let names = chosen(&arguments.estimators)?;
    bar.set_message("learning");
    let lesson = Lesson::of(&teach);
    let (every, settings) = settings(arguments, &lesson.scale, &judge)?;
    let faults = reference_faults(judge.faults.clone());
    let sigma: Vec<f64> = judge.sigma.iter().map(|sigma| sigma.unwrap_or(0.0)).collect();
    let recorded = judge.runs(&lesson.scale, &sigma, every);
    let contestants: Vec<Contestant> = names.into_iter().map(|name| contestant(name, &lesson)).collect();
    bar.set_message("predicting");
    bar.set_length((recorded.len() * contestants.len()) as u64);
    let replays = replay_all(&recorded, &contestants, &settings, &|| bar.inc(1));
    bar.finish_and_clear();
    notes.iter().for_each(|line| note!("note: {line}"));
    let terms = Terms::recorded(&judge.time_unit, &lesson.scale, notes);
    let judged = Judged {
        recorded: &recorded,
        replays: &replays,
        faults: &faults,
        sigma: &sigma,
        failure_time_error: None,
        terms: &terms,
    };
    let metrics = (judge.failures() > 0).then(|| Metrics::new(&settings, &judged));
    let measures: BTreeMap<String, _> = judge.faults.iter().cloned().zip(measures).collect();
    let digest = metrics.as_ref().map(|metrics| Digest::new(metrics, &terms, &teach, measures, &lesson));
    write(out, &judged, metrics.as_ref(), &digest)
}

/// The estimators to judge in the order asked for, each once.
fn chosen(asked: &[EstimatorName]) -> Result<Vec<EstimatorName>, Failure> {
    let asked = if asked.is_empty() { DEFAULT_ESTIMATORS } else { asked };
    let mut names = Vec::new();
    for name in asked {
        match name {
            EstimatorName::Climatology if names.contains(name) => {}
            EstimatorName::Climatology => names.push(*name),
            _ => return Err(refuse(format!("--estimator {} needs --model", super::called(*name)))),
        }
    }
    Ok(names)
}

fn contestant(name: EstimatorName, lesson: &Lesson) -> Contestant<'_> {
    Contestant::Estimator(match name {
        EstimatorName::Climatology => Box::new(Climatology::of_failures(&lesson.lives_fh).expect("a failure teaches")),
        _ => unreachable!("refused before"),
    })
}

/// The time between predictions as it was told, and how to replay.
fn settings(arguments: &Arguments, scale: &Scale, judge: &Records) -> Result<(f64, ReplaySettings), Failure> {
    let life = scale.characteristic_life;
    let every = arguments.every.unwrap_or(life / PREDICTIONS);
    let horizon = arguments.horizon.unwrap_or(HORIZON_LIVES * life);
    let longest = judge.lives.iter().filter_map(|life| life.times.last()).fold(0.0, |a: f64, b| a.max(*b));
    let (every_fh, horizon_fh, unit) = (scale.reference_fh(every), scale.reference_fh(horizon), &judge.time_unit);
    if every_fh == 0.0 || longest / every > MOST_PREDICTIONS {
        let reason = format!(
            "--every {every} {unit} makes more than {MOST_PREDICTIONS} predictions of a life of {longest} {unit}"
        );
        return Err(refuse(reason));
    }
    if horizon_fh == 0.0 {
        return Err(refuse(format!("--horizon {horizon} {unit} is nothing in a life of {life} {unit}")));
    }
    let prediction = PredictionSettings { draws: arguments.draws as usize, horizon_fh };
    Ok((every, ReplaySettings { every_fh, prediction, seed: SEED }))
}

impl Lesson {
    fn of(teach: &Records) -> Self {
        let failures =
            teach.lives.iter().filter_map(|life| life.end).filter(|end| end.ending == prognosis::Ending::Failed);
        let ends: Vec<f64> = quantile::sorted(failures.map(|end| end.time).collect());
        let scale = Scale { characteristic_life: quantile::median(&ends).expect("a failure teaches") };
        Self { scale, lives_fh: ends.into_iter().map(|end| scale.reference_fh(end)).collect() }
    }
}
