//! What estimators know before a life begins: the model's, or learned from files.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use domain::FaultModel;
use ema::life::DIAGNOSIS_SD;
use pipeline::{Labels, Model};
use prognosis::{
    FinishedLife, FitSettings, FleetPrior, Observation, fit_consistency, fit_failure_time_error, fit_growth_changes,
    fit_noise, fit_prior,
    surrogate::{RegressionSettings, Surrogate, SurrogateSettings, SvmSettings},
};

use super::{
    histories::{self, Recorded},
    laws, refuse,
};
use crate::{exit::Failure, files::labels};

/// Farther from the boundary, on average, no recorded failure is, flight hours.
const FARTHEST_END_FH: f64 = 300.0;

/// Boundary, priors and noise.
pub struct Knowledge {
    /// What the faults are.
    pub faults: FaultModel,
    /// Says when life ends.
    pub surrogate: Surrogate,
    /// What earlier lives have taught; growth does not change.
    pub prior: FleetPrior,
    /// The same where growth may change, if the model knows it or files were to teach it.
    pub changing_prior: Option<FleetPrior>,
    /// Standard deviation of one observation of each fault.
    pub sigma: Vec<f64>,
    /// Lengths of the lives that taught the prior, flight hours; none without their histories.
    pub lives_fh: Vec<f64>,
    /// What is odd about the lives that taught it, a line each.
    pub notes: Vec<String>,
}

/// Reads a model bundle.
pub fn read_model(file: &Path) -> Result<Model, Failure> {
    let refused = |reason: &dyn std::fmt::Display| refuse(format!("{}: {reason}", file.display()));
    let bytes = fs::read(file).map_err(|error| refused(&error))?;
    Model::from_bytes(&bytes).map_err(|error| refused(&error))
}

impl Knowledge {
    /// The model's own, but what the files teach instead. The model's prior without its growth changes stands
    /// for constant growth.
    pub fn gather(
        model: &Model,
        labels: &[impl AsRef<Path>],
        prior: Option<&Path>,
        growth_changes: bool,
        seed: u64,
    ) -> Result<Self> {
        let bundle = model.bundle();
        let faults = bundle.faults.clone();
        let mut knowledge = Self {
            surrogate: bundle.surrogate.clone(),
            prior: without_growth_changes(&bundle.prior),
            changing_prior: bundle.prior.growth_changes.is_some().then(|| bundle.prior.clone()),
            sigma: DIAGNOSIS_SD.into(),
            lives_fh: Vec::new(),
            notes: Vec::new(),
            faults,
        };
        if !labels.is_empty() {
            knowledge.surrogate = train_surrogate(labels, &knowledge.faults)?;
            // It was the error of another surrogate.
            knowledge.priors().for_each(|prior| prior.failure_time_error = None);
        }
        if let Some(file) = prior {
            knowledge.learn_from(file, growth_changes, seed)?;
        } else if knowledge.sigma.len() != knowledge.faults.len() {
            return Err(refuse(format!(
                "the noise of {} faults is not known: give --prior to learn it",
                knowledge.faults.len()
            ))
            .into());
        }
        Ok(knowledge)
    }

    fn priors(&mut self) -> impl Iterator<Item = &mut FleetPrior> {
        std::iter::once(&mut self.prior).chain(&mut self.changing_prior)
    }

    /// Tells the observations of a run their noise, and the oracle how growth may go on to change.
    pub fn prepare(&self, Recorded { run, regime, law }: &mut Recorded) {
        self.set_noise(&mut run.observations);
        if let Some(law) = law.as_mut().filter(|_| laws::may_change(regime.as_deref())) {
            let changes = self.changing_prior.as_ref().and_then(|prior| prior.growth_changes);
            law.changes = Some(changes.unwrap_or_default());
        }
    }

    /// Tells observations their noise.
    fn set_noise(&self, observations: &mut [Observation]) {
        observations.iter_mut().for_each(|observation| observation.sigma.clone_from(&self.sigma));
    }

    /// Noise, priors and failure-time errors from the histories of lives that ended in failure.
    fn learn_from(&mut self, file: &Path, growth_changes: bool, seed: u64) -> Result<()> {
        let refused = |reason: &dyn std::fmt::Display| refuse(format!("{}: {reason}", file.display()));
        let mut lives = histories::read_observations(file, &self.faults, &mut self.notes)?;
        self.sigma = fit_noise(&lives, &self.faults).map_err(|error| refused(&error))?;
        lives.iter_mut().for_each(|life| self.set_noise(life));
        let settings = FitSettings::default();
        self.prior = fit_prior(&lives, &self.faults, &settings).map_err(|error| refused(&error))?;
        self.changing_prior = None;
        if growth_changes {
            let prior = fit_growth_changes(&self.prior, &lives, &self.faults);
            self.changing_prior = Some(prior.map_err(|error| refused(&error))?);
        }
        for prior in [&mut self.prior].into_iter().chain(&mut self.changing_prior) {
            prior.consistency = fit_consistency(&lives, &self.faults, prior);
        }
        let finished = |observations: Vec<Observation>| FinishedLife {
            failure_fh: observations.last().expect("a history has a row").t_fh,
            observations,
        };
        let lives: Vec<FinishedLife> = lives.into_iter().map(finished).collect();
        self.lives_fh = lives.iter().map(|life| life.failure_fh).collect();
        for prior in [&mut self.prior].into_iter().chain(&mut self.changing_prior) {
            let error = fit_failure_time_error(&lives, &self.faults, prior, &self.surrogate, seed);
            if let Some(error) = error.filter(|error| error.offset_fh.abs() > FARTHEST_END_FH) {
                let reason = format!(
                    "its lives end {:.0} h from where the surrogate ends them, on average; each has to end with its failure",
                    error.offset_fh
                );
                return Err(refused(&reason).into());
            }
            prior.failure_time_error = error;
        }
        Ok(())
    }
}

/// The limits of what is like the fleet were learned with the changes.
fn without_growth_changes(prior: &FleetPrior) -> FleetPrior {
    let consistency = prior.consistency.filter(|_| prior.growth_changes.is_none());
    FleetPrior { growth_changes: None, consistency, ..prior.clone() }
}

/// Margins teach one regression per figure, verdicts alone a support vector machine.
fn train_surrogate(files: &[impl AsRef<Path>], faults: &FaultModel) -> Result<Surrogate> {
    let (mut samples, mut verdicts_only, mut figures) = (Vec::new(), false, None);
    for file in files {
        let file = file.as_ref();
        let (more, verdicts) = match labels::read(file, &faults.names)? {
            Labels::Margins(samples) => (samples, false),
            Labels::Verdicts(samples) => (samples, true),
        };
        let width = more.first().map(|sample| sample.margins.len());
        if *figures.get_or_insert(width) != width || (!samples.is_empty() && verdicts != verdicts_only) {
            return Err(refuse(format!("{}: other figures than the files of labels before it", file.display())).into());
        }
        verdicts_only = verdicts;
        samples.extend(more);
    }
    let settings = match verdicts_only {
        false => SurrogateSettings::FigureRegression(RegressionSettings::default()),
        true => SurrogateSettings::Svm(SvmSettings::default()),
    };
    let named = || files.iter().map(|file| file.as_ref().display().to_string()).collect::<Vec<_>>().join(", ");
    let trained = Surrogate::train(&samples, faults, &settings);
    trained.map_err(|error| refuse(error.to_string())).with_context(named)
}
