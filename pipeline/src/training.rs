//! Training a bundle from nothing but a motor's parameters and a seed.
//!
//! What: simulates maps (LF1 to learn from, HF to calibrate and to judge), assessments and a fleet, and
//! learns from them the diagnosers, the surrogate and the fleet prior.
//! Order: maps -> mask and diagnosers -> fleet -> assessments, of importance samples and of states
//! where the fleet passes the boundary -> surrogate -> prior.
//! Requires: minutes of two cores for a thousand samples at most; deterministic for a seed on one
//! machine.

mod fleet;
mod maps;

use diagnosis::{
    Diagnoser, LoadInput, MapKind, TrainingError, TrainingMap, TrainingSet, TrainingSettings, Validation,
    ValidationSettings,
};
use domain::{FaultModel, FaultVector, Invalid, Mask, Stream};
use ema::{
    assessment::assess_faults,
    lf2::{Faults, Parameters},
    motor::Motor,
    simulation::Model as MotorModel,
};
use prognosis::{
    fit::NoHistory,
    surrogate::{
        ClassificationQuality, LabelledFaults, RegressionSettings, Surrogate, SurrogateError, SurrogateSettings,
        SvmSettings,
    },
};
use reduction::{ImportanceSampling, MaskDesign, ModeCount, PodBasis, ReductionError};

use crate::{Bundle, ChainSettings, Dataset, DatasetError, DiagnosisMetrics, Metrics, Provenance, SurrogateMetrics};

/// High-fidelity maps that calibrate the error law.
const CALIBRATION_MAPS: usize = 100;
/// High-fidelity maps that judge the diagnosers.
const VALIDATION_MAPS: usize = 100;
/// Importance samples that judge the surrogate.
const VALIDATION_ASSESSMENTS: usize = 500;
/// Standard deviation of a sample in validation, units of k_nom.
const SAMPLE_NOISE: f64 = 0.01;
/// Noise realisations per map in validation.
const VALIDATION_REPEATS: usize = 10;

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
    let assessment = Parameters::assessment_of(&settings.motor);
    must_be_fit(&assessment)?;
    let training = Training { settings, progress, faults: FaultModel::electrical(), assessment };
    if let Some(dataset) = dataset {
        dataset.check(&training.faults)?;
    }
    let (mask, diagnosers, diagnosis) = training.diagnosers()?;
    let fleet = training.fleet();
    let (surrogate, surrogate_metrics) = training.surrogate(&fleet)?;
    progress.stage("learning the fleet prior", 1);
    let prior = fleet::prior(&fleet, &training.faults, &surrogate, settings.seed)?;
    let [with_load_ratio, without_load_ratio] = diagnosers;
    Ok(Bundle {
        format: Bundle::FORMAT,
        provenance: Provenance {
            samples: settings.samples,
            lives: settings.lives,
            seed: settings.seed,
            chain: settings.chain,
            dataset: dataset.map(Dataset::id),
            code_version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        faults: training.faults,
        motor: settings.motor.clone(),
        masks: vec![mask],
        with_load_ratio,
        without_load_ratio,
        surrogate,
        prior,
        metrics: Metrics { diagnosis, surrogate: surrogate_metrics },
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

    /// The mask, both diagnosers, and how good they are on maps that they have not seen.
    fn diagnosers(&self) -> Result<(Mask, [Diagnoser; 2], DiagnosisMetrics), TrainError> {
        let maps = self.maps("maps to learn from", MotorModel::LowFidelity1, self.settings.samples)?;
        let calibration = self.maps("maps to calibrate with", MotorModel::HighFidelity, CALIBRATION_MAPS)?;
        let validation = self.maps("maps to judge by", MotorModel::HighFidelity, VALIDATION_MAPS)?;
        let snapshots: Vec<Vec<f64>> = maps.iter().map(TrainingMap::load_invariant).collect();
        let mask = MaskDesign::default().d_optimal(&PodBasis::train(&snapshots, ModeCount::Fixed(9))?)?;
        let set = TrainingSet { fault_model: &self.faults, mask: &mask, maps: &maps, calibration: &calibration };
        self.progress.stage("training the diagnosis", 2);
        let train = |kind, purpose| {
            let diagnoser = diagnosis::train(&set, &TrainingSettings::new(kind), &self.stream(purpose));
            self.progress.step();
            diagnoser
        };
        let with = train(MapKind::LoadInvariant, "diagnosis with load ratio")?;
        let without = train(MapKind::Raw, "diagnosis without load ratio")?;
        let validate = |diagnoser: &Diagnoser, load| -> Result<Validation, ReductionError> {
            let settings = ValidationSettings { load, noise: SAMPLE_NOISE, repeats: VALIDATION_REPEATS };
            diagnosis::validate(diagnoser, &mask, &validation, &settings, &self.stream("validation noise"))
        };
        let metrics = DiagnosisMetrics {
            maps: validation.len(),
            load_ratio_per_sample: validate(&with, LoadInput::PerSample)?,
            mean_load_ratio: validate(&with, LoadInput::Mean)?,
            no_load_ratio: validate(&without, LoadInput::None)?,
        };
        Ok((mask, [with, without], metrics))
    }

    fn maps(&self, name: &'static str, model: MotorModel, count: usize) -> Result<Vec<TrainingMap>, TrainError> {
        self.progress.stage(name, count);
        let faults = self.samples(count, name);
        maps::simulate(&self.settings.motor, model, &faults, &self.stream(name), &|| self.progress.step())
    }

    fn fleet(&self) -> Vec<fleet::PastLife> {
        self.progress.stage("lives of the fleet", self.settings.lives);
        fleet::simulate(&self.assessment, self.settings.seed, self.settings.lives, &|| self.progress.step())
    }

    /// The surrogate, and how good it is on assessments that it has not seen.
    fn surrogate(&self, fleet: &[fleet::PastLife]) -> Result<(Surrogate, SurrogateMetrics), TrainError> {
        let mut samples = self.samples(self.settings.samples, "assessments to learn from");
        samples.extend(fleet::near_failure(fleet, &self.faults));
        let fresh = self.samples(VALIDATION_ASSESSMENTS, "assessments to judge by");
        self.progress.stage("assessments", samples.len() + fresh.len());
        let labelled = fleet::assess_all(&self.assessment, &samples, &|| self.progress.step());
        let fresh = fleet::assess_all(&self.assessment, &fresh, &|| self.progress.step());
        self.progress.stage("training the surrogate", 2);
        let regression =
            self.surrogate_of(&labelled, SurrogateSettings::FigureRegression(RegressionSettings::default()))?;
        let svm = self.surrogate_of(&labelled, SurrogateSettings::Svm(SvmSettings::default()))?;
        let metrics = SurrogateMetrics {
            samples: fresh.len(),
            figure_regression: ClassificationQuality::of(&regression, &fresh),
            svm: ClassificationQuality::of(&svm, &fresh),
        };
        Ok((regression, metrics))
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
