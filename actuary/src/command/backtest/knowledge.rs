//! What estimators know before a life begins: the model's, or learned from files.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use domain::FaultModel;
use ema::life::DIAGNOSIS_SD;
use evaluation::Knowledge;
use pipeline::{Labels, Model};
use prognosis::surrogate::{RegressionSettings, Surrogate, SurrogateSettings, SvmSettings};

use super::refuse;
use crate::{
    files::{histories, labels, stress},
    lesson::told_pace,
};

/// What is to teach instead of the model.
pub struct Teach<'a> {
    /// Files of labelled fault vectors, which teach the surrogate.
    pub labels: &'a [PathBuf],
    /// Lives that ended in failure, which teach all else.
    pub prior: Option<&'a Path>,
    /// Which of their columns act on wear.
    pub stress: &'a stress::Flags,
    /// Whether growth may change.
    pub growth_changes: bool,
}

/// The model's own, but what the files teach instead; what is odd about them goes into the notes.
pub fn gather(model: &Model, teach: &Teach, seed: u64, notes: &mut Vec<String>) -> Result<Knowledge> {
    let Teach { labels, prior, stress, growth_changes } = *teach;
    let bundle = model.bundle();
    let maps = bundle.maps().ok_or_else(|| {
        refuse("--model takes faults of an own diagnosis: tell the --limit of each, and no --model".to_owned())
    })?;
    let (faults, surrogate) = (bundle.faults.clone(), maps.surrogate.clone());
    let mut knowledge = Knowledge::new(faults, surrogate, bundle.prior.first(), DIAGNOSIS_SD.into());
    if !labels.is_empty() {
        knowledge.replace_surrogate(train_surrogate(labels, &knowledge.faults)?);
    }
    if let Some(file) = prior {
        let lives = histories::read_observations(file, &knowledge.faults, stress, notes)?;
        let unteachable = |error| refuse(format!("{}: {error}", file.display()));
        if stress.act() {
            let lesson = knowledge.learn_with_pace(lives, growth_changes, seed).map_err(unteachable)?;
            notes.push(
                lesson.as_ref().map_or_else(|| "no life of --prior tells of load or temperature".to_owned(), told_pace),
            );
        } else {
            knowledge.learn(lives, growth_changes, seed).map_err(unteachable)?;
        }
    } else if knowledge.sigma.len() != knowledge.faults.len() {
        let faults = knowledge.faults.len();
        return Err(refuse(format!("the noise of {faults} faults is not known: give --prior to learn it")).into());
    }
    Ok(knowledge)
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
