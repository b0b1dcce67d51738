//! Lives whose limits are told by their user: some teach, the others are judged, in the unit of their times.

use std::collections::BTreeMap;

use anyhow::Result;
use domain::FaultModel;
use evaluation::{
    Contestant, Digest, Judged, Metrics, MixedBrownian, MixedEffects, Records, Terms, backtest::ReplaySettings,
    replay_all,
};
use indicatif::ProgressBar;
use prognosis::{EndedLife, Estimator, Lesson, Limits, Paced, PredictionSettings, Scale};

use super::{Arguments, EstimatorName, SEED, learned::Learned, refuse, write};
use crate::{
    exit::Failure,
    files::{
        output::OutputFolder,
        records::{self, Lives, Tables},
    },
    lesson::{FleetLesson, told_pace},
    say::note,
};

/// Judged where none is named.
const DEFAULT_ESTIMATORS: &[EstimatorName] =
    &[EstimatorName::Mixture, EstimatorName::Growth, EstimatorName::Similarity, EstimatorName::Climatology];
/// Predictions of a characteristic life, and its multiple that is the horizon, where nothing else is told.
const PREDICTIONS: f64 = 25.0;
const HORIZON_LIVES: f64 = 2.0;
/// More predictions of one life are a mistake.
const MOST_PREDICTIONS: f64 = 10_000.0;

/// Reads, learns, judges and writes.
pub fn run(arguments: &Arguments, out: &OutputFolder, bar: &ProgressBar) -> Result<()> {
    let tables = Tables {
        histories: &arguments.histories,
        prior: arguments.prior.as_deref(),
        split: arguments.split.map(std::num::NonZeroUsize::get),
        stress: &arguments.stress,
    };
    let Lives { teach, judge, measures, mut notes } = records::read(tables, &arguments.records)?;
    let names = chosen(&arguments.estimators)?;
    bar.set_message("learning");
    let (every, settings) = settings(arguments, &teach.scale().expect("a failure teaches"), &judge)?;
    let FleetLesson { scale, faults, sigma, lesson, pace } = FleetLesson::learn(&teach)?;
    let ended = teach.ended(&scale, &sigma);
    notes.extend(lesson.oddities());
    notes.extend(pace.as_ref().map(told_pace));
    let recorded = judge.runs(&scale, &sigma, every);
    let limits = Limits::reference(faults.len());
    let taught = Taught { lesson: &lesson, lives: &ended, faults: &faults, limits: &limits };
    let contestant = |name| taught.contestant(name);
    let contestants: Vec<Contestant> = names.into_iter().map(contestant).collect();
    bar.set_message("predicting");
    bar.set_length((recorded.len() * contestants.len()) as u64);
    let replays = replay_all(&recorded, &contestants, &settings, &|| bar.inc(1));
    bar.finish_and_clear();
    notes.iter().for_each(|line| note!("note: {line}"));
    let terms = Terms::recorded(&judge.time_unit, &scale, every, notes);
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
    let learned = Learned::new(&lesson, &scale, &judge.faults, &sigma);
    let digest = metrics.as_ref().map(|metrics| Digest::new(metrics, &terms, &teach, measures, learned));
    write(out, &judged, metrics.as_ref(), &digest)
}

/// The estimators to judge in the order asked for, each once.
fn chosen(asked: &[EstimatorName]) -> Result<Vec<EstimatorName>, Failure> {
    let asked = if asked.is_empty() { DEFAULT_ESTIMATORS } else { asked };
    let mut names = Vec::new();
    for name in asked {
        match name {
            _ if names.contains(name) => {}
            name if name.needs_limits() || DEFAULT_ESTIMATORS.contains(name) => names.push(*name),
            _ => return Err(refuse(format!("--estimator {} needs --model", super::called(*name)))),
        }
    }
    Ok(names)
}

/// What the lives that teach have taught, and they themselves.
struct Taught<'a> {
    lesson: &'a Lesson,
    lives: &'a [EndedLife],
    faults: &'a FaultModel,
    limits: &'a Limits,
}

impl<'a> Taught<'a> {
    fn contestant(&self, name: EstimatorName) -> Contestant<'a> {
        let Self { lesson, lives, faults, limits } = *self;
        let observed = "lives that taught a lesson were observed";
        let estimator: Box<dyn Estimator> = match name {
            EstimatorName::Mixture => Box::new(lesson.mixture(faults, limits)),
            EstimatorName::Growth => Box::new(lesson.growth(faults, limits)),
            EstimatorName::Similarity => Box::new(lesson.similarity(faults, limits)),
            EstimatorName::Climatology => Box::new(lesson.companions.climatology.clone()),
            EstimatorName::MixedExponential => return rival(MixedEffects::exponential(lives).expect(observed)),
            EstimatorName::MixedBrownian => return rival(MixedBrownian::learn(lives).expect(observed)),
            EstimatorName::MixedPolynomial => return rival(MixedEffects::polynomial(lives).expect(observed)),
            _ => unreachable!("refused before"),
        };
        match &lesson.pace {
            Some(law) => Contestant::Paced(Paced { law, inner: estimator }),
            None => Contestant::Estimator(estimator),
        }
    }
}

/// A model of the literature, which knows nothing of the pace.
fn rival<'a>(estimator: impl Estimator + 'a) -> Contestant<'a> {
    Contestant::Estimator(Box::new(estimator))
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
    if longest < every && judge.lives.iter().all(|life| life.end.is_some()) {
        let reason = format!("--every {every} {unit} leaves nothing to predict: the longest life has {longest} {unit}");
        return Err(refuse(reason));
    }
    if horizon_fh < every_fh {
        return Err(refuse(format!("--horizon {horizon} {unit} is shorter than --every {every} {unit}")));
    }
    let prediction = PredictionSettings { draws: arguments.draws as usize, horizon_fh };
    Ok((every, ReplaySettings { every_fh, prediction, seed: SEED }))
}
