//! Training a bundle from nothing but a motor's parameters and a seed.
//!
//! What: simulates maps (LF1 to learn from, HF to calibrate and to judge), assessments and a fleet, and
//! learns from them the diagnosers, the surrogate and the fleet prior.
//! Order: maps -> mask and diagnosers -> fleet -> assessments, of importance samples and of states
//! where the fleet passes the boundary -> surrogate -> prior.
//! Requires: minutes of two cores for a thousand samples at most; deterministic for a seed on one
//! machine.

mod diagnosis;
mod fleet;
mod maps;
mod motor;

pub use motor::motor_calibration;

use ::diagnosis::TrainingError;
use domain::{FaultModel, FaultVector, Invalid};
use ema::{
    assessment::assess_faults,
    lf2::{Faults, Parameters},
    motor::Motor,
};
use numerics::Stream;
use prognosis::{
    fit::NoHistory,
    surrogate::{
        ClassificationQuality, FailurePath, FailureTimeQuality, LabelledFaults, RegressionSettings, Surrogate,
        SurrogateError, SurrogateSettings, SvmSettings, best_by_failure_time,
    },
};
use reduction::{ImportanceSampling, MaskDesign, ReductionError};

use crate::{
    Assessment, Bundle, ChainSettings, Dataset, DatasetError, Labels, LoadModel, MapChain, Metrics, Provenance,
    SurrogateMetrics,
};

/// Importance samples that judge the surrogate.
const VALIDATION_ASSESSMENTS: usize = 500;
/// Lives that judge it.
const VALIDATION_LIVES: usize = 60;
/// The share of a dataset's labels that judges the surrogate.
const HELD_OUT_LABELS: usize = 5;

/// What to train from.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainSettings {
    /// The motor.
    pub motor: Motor,
    /// Importance samples of the fault vector.
    pub samples: usize,
    /// Lives of the simulated fleet that teaches the prior.
    pub lives: usize,
    /// Seed of everything random.
    pub seed: u64,
    /// The links of the diagnosis.
    pub chain: ChainSettings,
}

/// Looks on while a training runs.
pub trait Progress: Sync {
    /// A stage of so many steps begins.
    fn stage(&self, name: &'static str, steps: usize);
    /// A step of the stage is done.
    fn step(&self);
}

/// Why a bundle cannot be trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// A parameter of the motor is out of its range.
    #[error("motor: {0}")]
    Motor(Invalid),
    /// Without any fault the actuator does not meet the requirements.
    #[error("motor: without any fault its {figure} is {:.1} % below what the assessment requires", -100.0 * margin)]
    Unfit {
        /// The figure that is furthest below its requirement.
        figure: &'static str,
        /// Value over requirement, minus one.
        margin: f64,
    },
    /// The motor did not pass every bin of the map fast enough.
    #[error("the motor never passed bin {bin} of the map at speed, under faults {faults:?}")]
    Incomplete {
        /// The bin.
        bin: usize,
        /// The faults.
        faults: FaultVector,
    },
    /// The dataset does not fit the method.
    #[error("dataset: {0}")]
    Dataset(#[from] DatasetError),
    /// More modes than the points of a mask can tell apart.
    #[error("{modes} modes are too many: {points} points of a mask leave room for {}", points - 2)]
    Modes {
        /// Modes of the chain.
        modes: usize,
        /// Points of a mask; a diagnosis needs two more than modes.
        points: usize,
    },
    /// The maps make no basis or no mask.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// No diagnoser can be trained from the maps.
    #[error(transparent)]
    Diagnosis(#[from] TrainingError),
    /// No surrogate can be trained from the assessments.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The fleet taught nothing.
    #[error(transparent)]
    Prior(#[from] NoHistory),
}

/// Trains a bundle: the diagnosis from the maps of `dataset`, or from simulated ones without it.
pub fn train(
    settings: &TrainSettings,
    dataset: Option<&Dataset>,
    progress: &dyn Progress,
) -> Result<Bundle, TrainError> {
    settings.motor.check().map_err(TrainError::Motor)?;
    let (modes, points) = (settings.chain.modes, MaskDesign::default().points);
    if modes + 2 > points {
        return Err(TrainError::Modes { modes, points });
    }
    let assessment = Parameters::assessment_of(&settings.motor);
    must_be_fit(&assessment)?;
    let training = Training { settings, progress, faults: FaultModel::electrical(), assessment };
    if let Some(dataset) = dataset {
        dataset.check(&training.faults)?;
    }
    let diagnosis = training.diagnosis(dataset)?;
    let fleet = training.fleet();
    let labels = dataset.and_then(|dataset| dataset.labels.as_ref());
    // Labels of a dataset may draw another boundary than the assessment function, which ends the lives.
    let (samples, paths) = match labels {
        Some(labels) => (training.held_out(labels), Vec::new()),
        None => (training.assessments(&fleet), training.unseen_paths()),
    };
    let (surrogate, surrogate_metrics) = training.surrogate(&samples, &paths)?;
    progress.stage("learning the fleet prior", 1);
    let prior = fleet::prior(&fleet, &training.faults, &surrogate, settings.seed)?;
    progress.stage("calibrating the motor", 1);
    let motor = motor_calibration(&settings.motor, &diagnosis.masks[0], settings.seed);
    progress.step();
    Ok(Bundle {
        format: Bundle::FORMAT,
        provenance: Provenance {
            samples: settings.samples,
            lives: settings.lives,
            seed: settings.seed,
            chain: settings.chain,
            dataset: dataset.map(Dataset::id),
            histories: None,
            code_version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        faults: training.faults,
        assessment: Assessment::Maps(Box::new(MapChain {
            motor: settings.motor.clone(),
            masks: diagnosis.masks,
            self_organising_map: diagnosis.self_organising_map,
            with_load_ratio: diagnosis.with_load_ratio,
            without_load_ratio: diagnosis.without_load_ratio,
            surrogate,
            metrics: Metrics { diagnosis: diagnosis.metrics, surrogate: surrogate_metrics },
        })),
        loads: Some(LoadModel { motor, ..LoadModel::reference(settings.seed) }),
        prior: prior.into(),
    })
}

/// A motor that fails its assessment when new has no remaining life to predict.
fn must_be_fit(assessment: &Parameters) -> Result<(), TrainError> {
    let margins = assess_faults(assessment, &Faults::NOMINAL).margins();
    let figures = ["no-load speed", "stall load", "gain margin", "phase margin"];
    let worst = figures.into_iter().zip(margins).min_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        Some((figure, margin)) if margin < 0.0 => Err(TrainError::Unfit { figure, margin }),
        _ => Ok(()),
    }
}

/// Fault vectors of known verdict, each used for one thing only.
struct Verdicts {
    learn: Vec<LabelledFaults>,
    judge: Vec<LabelledFaults>,
    /// Whether more than healthy or faulty is known.
    margins_known: bool,
}

/// A training under way.
struct Training<'a> {
    settings: &'a TrainSettings,
    progress: &'a dyn Progress,
    faults: FaultModel,
    /// Parameters of the assessment function.
    assessment: Parameters,
}

impl Training<'_> {
    /// Random numbers of one purpose.
    fn stream(&self, purpose: &str) -> Stream {
        Stream::new(self.settings.seed, &["train", purpose])
    }

    fn samples(&self, count: usize, purpose: &str) -> Vec<FaultVector> {
        ImportanceSampling::INCIPIENT.draw(count, &mut self.stream(purpose))
    }

    fn fleet(&self) -> Vec<fleet::PastLife> {
        self.progress.stage("lives of the fleet", self.settings.lives);
        fleet::simulate(&self.assessment, self.settings.seed, self.settings.lives, &|| self.progress.step())
    }

    /// Assessments of importance samples, of states where the fleet passes the boundary, and of fresh samples.
    fn assessments(&self, fleet: &[fleet::PastLife]) -> Verdicts {
        let mut samples = self.samples(self.settings.samples, "assessments to learn from");
        samples.extend(fleet::near_failure(fleet, &self.faults));
        let fresh = self.samples(VALIDATION_ASSESSMENTS, "assessments to judge by");
        self.progress.stage("assessments", samples.len() + fresh.len());
        let assess = |samples: &[FaultVector]| fleet::assess_all(&self.assessment, samples, &|| self.progress.step());
        Verdicts { learn: assess(&samples), judge: assess(&fresh), margins_known: true }
    }

    /// Labels of a dataset, a part of them held out.
    fn held_out(&self, labels: &Labels) -> Verdicts {
        let (samples, margins_known) = match labels {
            Labels::Margins(samples) => (samples, true),
            Labels::Verdicts(samples) => (samples, false),
        };
        let mut learn = samples.clone();
        self.stream("split of the labels").shuffle(&mut learn);
        let judge = learn.split_off(learn.len() - learn.len() / HELD_OUT_LABELS);
        Verdicts { learn, judge, margins_known }
    }

    /// The surrogate that knows best when lives end, or without lives the one that learns most from what is known;
    /// and how good each candidate is on verdicts and lives that it has not seen.
    fn surrogate(
        &self,
        verdicts: &Verdicts,
        paths: &[FailurePath],
    ) -> Result<(Surrogate, SurrogateMetrics), TrainError> {
        self.progress.stage("training the surrogate", if verdicts.margins_known { 2 } else { 1 });
        let of = |settings| self.surrogate_of(&verdicts.learn, settings);
        let regression = SurrogateSettings::FigureRegression(RegressionSettings::default());
        let regression = verdicts.margins_known.then(|| of(regression)).transpose()?;
        let svm = of(SurrogateSettings::Svm(SvmSettings::default()))?;
        let quality = |surrogate: &Surrogate| ClassificationQuality::of(surrogate, &verdicts.judge);
        let metrics = SurrogateMetrics {
            samples: verdicts.judge.len(),
            figure_regression: regression.as_ref().map(quality),
            svm: quality(&svm),
            figure_regression_failure_time: regression.as_ref().and_then(|it| FailureTimeQuality::of(it, paths)),
            svm_failure_time: FailureTimeQuality::of(&svm, paths),
        };
        let candidates: Vec<Surrogate> = regression.into_iter().chain([svm]).collect();
        let best = best_by_failure_time(&candidates, paths).map_or(&candidates[0], |(best, _)| best);
        Ok((best.clone(), metrics))
    }

    /// Lives that teach nothing.
    fn unseen_paths(&self) -> Vec<FailurePath> {
        self.progress.stage("lives to judge the surrogate by", VALIDATION_LIVES);
        let seed = self.stream("lives to judge by").bits();
        let lives = fleet::simulate(&self.assessment, seed, VALIDATION_LIVES, &|| self.progress.step());
        lives.iter().map(|life| FailurePath::of_life(&life.t_fh, &life.states)).collect()
    }

    fn surrogate_of(
        &self,
        samples: &[LabelledFaults],
        settings: SurrogateSettings,
    ) -> Result<Surrogate, SurrogateError> {
        let surrogate = Surrogate::train(samples, &self.faults, &settings);
        self.progress.step();
        surrogate
    }
}
