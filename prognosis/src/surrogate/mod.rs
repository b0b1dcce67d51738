//! Surrogates of the assessment function: the boundary between healthy and faulty in microseconds.
//!
//! The assessment function runs dozens of simulations per fault vector; a Monte Carlo asks for it
//! millions of times. Two surrogates are trained on labelled fault vectors:
//! - [`Svm`], the classifier of Berri 2021, sections 2.4.1 and 6.5, which knows only healthy and faulty;
//! - [`FigureRegression`], which predicts each figure's margin and takes the least. It is the better
//!   of the two, because each figure is smooth where the boundary of the intersection has edges.
//!
//! Which one serves is decided by [`FailureTimeQuality`], not by classes. Both know where they have
//! learned, and how unsure they are elsewhere.

mod expansion;
mod failure_time;
mod reach;
mod regression;
mod svm;

use domain::FaultModel;
use serde::{Deserialize, Serialize};

pub use expansion::Scaling;
pub use failure_time::{FailurePath, FailureTimeQuality, best_by_failure_time};
pub use regression::{FigureRegression, RegressionSettings};
pub use svm::{Svm, SvmSettings};

use crate::boundary::{Boundary, Margin};

/// A fault vector with what the assessment function says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledFaults {
    /// Fault vector, nominal values included.
    pub k: Vec<f64>,
    /// Margin of each figure of merit, value / requirement - 1; the same figures in every sample.
    pub margins: Vec<f64>,
}

impl LabelledFaults {
    /// The least margin.
    pub fn margin(&self) -> f64 {
        self.margins.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Whether every figure meets its requirement.
    pub fn healthy(&self) -> bool {
        self.margin() >= 0.0
    }
}

/// Which surrogate to train, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum SurrogateSettings {
    /// The classifier.
    Svm(SvmSettings),
    /// One regression per figure.
    FigureRegression(RegressionSettings),
}

/// A trained surrogate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Surrogate {
    /// The classifier.
    Svm(Svm),
    /// One regression per figure.
    FigureRegression(FigureRegression),
}

/// Why a surrogate cannot be trained.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurrogateError {
    /// Samples that disagree in their number of faults or figures, or with the fault model.
    #[error("sample {sample}: {faults} faults, {figures} figures; expected {expected_faults} and {expected_figures}")]
    Sizes {
        /// Index of the sample.
        sample: usize,
        /// Its faults.
        faults: usize,
        /// Its figures.
        figures: usize,
        /// Faults of the model.
        expected_faults: usize,
        /// Figures of the first sample.
        expected_figures: usize,
    },
    /// A sample with a value that is not finite.
    #[error("sample {sample} holds a value that is not finite")]
    NotFinite {
        /// Index of the sample.
        sample: usize,
    },
    /// Labels that leave no boundary to learn.
    #[error("{healthy} healthy and {faulty} faulty samples leave no boundary to learn")]
    NoBoundary {
        /// Healthy samples.
        healthy: usize,
        /// Faulty samples.
        faulty: usize,
    },
    /// Too few samples close to the requirement of any figure.
    #[error("no figure has {needed} samples with a margin below {band} in size")]
    NothingNearBoundary {
        /// Samples that a figure needs.
        needed: usize,
        /// The band of margins.
        band: f64,
    },
    /// More figures than one surrogate holds.
    #[error("{figures} figures where at most {most} are possible")]
    TooManyFigures {
        /// Figures of a sample.
        figures: usize,
        /// Most figures.
        most: usize,
    },
    /// The optimiser ran out of iterations.
    #[error("support vector machine not converged: violation {violation} after {iterations} iterations")]
    NotConverged {
        /// Violation of the optimality conditions.
        violation: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// A linear system that is not positive definite in floating point.
    #[error("regression of figure {figure} is singular")]
    Singular {
        /// Index of the figure.
        figure: usize,
    },
}

impl Surrogate {
    /// Trains a surrogate on labelled fault vectors of the model `faults`. Deterministic.
    pub fn train(
        samples: &[LabelledFaults],
        faults: &FaultModel,
        settings: &SurrogateSettings,
    ) -> Result<Self, SurrogateError> {
        check(samples, faults)?;
        match settings {
            SurrogateSettings::Svm(settings) => Svm::train(samples, faults, settings).map(Self::Svm),
            SurrogateSettings::FigureRegression(settings) => {
                FigureRegression::train(samples, faults, settings).map(Self::FigureRegression)
            }
        }
    }

    /// Whether the fault vector `k` lies where nothing was learned: farther from what the surrogate was
    /// trained on than its training samples near the boundary are from each other. `None` from a
    /// surrogate that was trained before this was kept.
    pub fn outside_training(&self, k: &[f64]) -> Option<bool> {
        let (expansion, reach) = match self {
            Self::Svm(svm) => svm.parts(),
            Self::FigureRegression(regression) => regression.parts(),
        };
        reach.map(|reach| expansion.distance_to_nearest_centre(k) > reach.radius())
    }
}

impl Boundary for Surrogate {
    fn margin(&self, k: &[f64]) -> f64 {
        match self {
            Self::Svm(svm) => svm.margin(k),
            Self::FigureRegression(regression) => regression.margin(k),
        }
    }

    fn look(&self, k: &[f64], gradient: &mut [f64]) -> Margin {
        let (expansion, reach) = match self {
            Self::Svm(svm) => svm.parts(),
            Self::FigureRegression(regression) => regression.parts(),
        };
        let least = expansion.look(k, gradient);
        Margin { value: least.value, sigma: reach.map_or(0.0, |reach| reach.sigma(&least)) }
    }
}

fn check(samples: &[LabelledFaults], faults: &FaultModel) -> Result<(), SurrogateError> {
    let figures = samples.first().map_or(0, |sample| sample.margins.len());
    for (i, sample) in samples.iter().enumerate() {
        if sample.k.len() != faults.len() || sample.margins.len() != figures {
            return Err(SurrogateError::Sizes {
                sample: i,
                faults: sample.k.len(),
                figures: sample.margins.len(),
                expected_faults: faults.len(),
                expected_figures: figures,
            });
        }
        if !sample.k.iter().chain(&sample.margins).all(|value| value.is_finite()) {
            return Err(SurrogateError::NotFinite { sample: i });
        }
    }
    let healthy = samples.iter().filter(|sample| sample.healthy()).count();
    match samples.len() - healthy {
        faulty if healthy > 0 && faulty > 0 => Ok(()),
        faulty => Err(SurrogateError::NoBoundary { healthy, faulty }),
    }
}

/// How well a boundary classifies labelled fault vectors that it was not trained on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClassificationQuality {
    /// Share of samples that are classified rightly.
    pub accuracy: f64,
    /// Share of the faulty samples that are called healthy; zero when there are none.
    pub missed_share: f64,
    /// Share of the healthy samples that are called faulty; zero when there are none.
    pub false_share: f64,
}

impl ClassificationQuality {
    /// Judges `boundary` by `samples`.
    pub fn of(boundary: &impl Boundary, samples: &[LabelledFaults]) -> Self {
        let (mut faulty, mut missed, mut false_alarms) = (0, 0, 0);
        for sample in samples {
            let called_healthy = boundary.margin(&sample.k) >= 0.0;
            faulty += usize::from(!sample.healthy());
            missed += usize::from(called_healthy && !sample.healthy());
            false_alarms += usize::from(!called_healthy && sample.healthy());
        }
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Self {
            accuracy: 1.0 - share(missed + false_alarms, samples.len()),
            missed_share: share(missed, faulty),
            false_share: share(false_alarms, samples.len() - faulty),
        }
    }
}
