//! A bundle tried out before it judges anything.
//!
//! A file may be well-formed and yet hold parts that do not work together: matrices of other sizes, figures
//! that lead to no number. A rehearsal takes every online step once, on a life that is made up.

use std::panic::{AssertUnwindSafe, catch_unwind};

use diagnosis::Measurement;
use domain::{Component, Diagnosis, Estimate, Life, LoadRatio, Mask, NUMERICS_VERSION, Outcome, Stream, Timestamp};

use crate::{EstimateError, LifeContext, Model, OutlookError};

/// Flight hours between two uploads of the life that is made up.
const STEP_FH: f64 = 5.0;
/// Its uploads: enough for ten closed blocks.
const UPLOADS: u32 = 44;
/// Standard deviation of a sample, in k_nom.
const NOISE: f64 = 0.01;

/// Why a bundle cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RehearsalError {
    /// A diagnosis failed.
    #[error("a diagnosis by mask {mask} fails: {error}")]
    Estimate {
        /// The mask.
        mask: domain::ContentHash,
        /// Why.
        error: EstimateError,
    },
    /// The outlook of a life failed.
    #[error("the outlook of a life fails: {0}")]
    Outlook(#[from] OutlookError),
    /// A life with a history has no forecast.
    #[error("a life of {UPLOADS} uploads has no forecast: {0}")]
    NoForecast(String),
    /// Parts of it do not fit together.
    #[error("its parts do not fit together: a calculation ended abnormally")]
    Abnormal,
}

impl Model {
    /// Tries every online step on a made-up life of an actuator without faults; a second at most.
    pub fn rehearse(&self) -> Result<(), RehearsalError> {
        catch_unwind(AssertUnwindSafe(|| self.try_out())).unwrap_or(Err(RehearsalError::Abnormal))
    }

    fn try_out(&self) -> Result<(), RehearsalError> {
        let mut stream = Stream::new(1, &["rehearsal"]);
        let mut history = Vec::new();
        for mask in &self.bundle.masks {
            for i in 0..UPLOADS {
                let samples: Vec<_> = (0..mask.len()).map(|_| Some(1.0 + NOISE * stream.normal())).collect();
                let ratios =
                    [None, Some(LoadRatio::Mean(0.1)), Some(LoadRatio::PerSample(vec![Some(0.1); mask.len()]))];
                for load_ratio in &ratios {
                    let measurement =
                        Measurement { samples: &samples, load_ratio: load_ratio.as_ref(), noise: Some(NOISE) };
                    let outcome = self.diagnose(&measurement, mask);
                    let outcome = outcome.map_err(|error| RehearsalError::Estimate { mask: mask.id(), error })?;
                    if load_ratio.is_none() && mask == &self.bundle.masks[0] {
                        history.push(self.plausible_estimate(mask, i, outcome));
                    }
                }
            }
        }
        self.look_ahead(&history)
    }

    /// An estimate of the made-up life; samples that are too simple for a map may look implausible.
    fn plausible_estimate(&self, mask: &Mask, number: u32, outcome: Outcome) -> Estimate {
        let outcome = match outcome {
            Outcome::Diagnosed(diagnosis) => Outcome::Diagnosed(Diagnosis { plausible: true, ..diagnosis }),
            other => other,
        };
        let flight_hours = STEP_FH * f64::from(number + 1);
        Estimate {
            upload_id: format!("rehearsal-{number:03}").parse().expect("a name"),
            flight_hours,
            recorded_at: Timestamp::from_micros(0).plus_hours(3.0 * flight_hours),
            mask_id: mask.id(),
            model: self.hash,
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome,
            load: None,
            temperature: None,
        }
    }

    fn look_ahead(&self, history: &[Estimate]) -> Result<(), RehearsalError> {
        let component = Component {
            operator: "rehearsal".parse().expect("a name"),
            part_number: "rehearsal".parse().expect("a name"),
            serial_number: "1".parse().expect("a name"),
        };
        let life = Life { component, overhaul_index: 0 };
        let context = LifeContext { life: &life, generation: 1, prior: self.prior(), began_fh: 0.0 };
        let outlook = self.outlook(&context, &self.course(&context, history), &[], None)?;
        match outlook.prognosis.map(|prognosis| prognosis.forecast) {
            Some(Ok(_)) => Ok(()),
            Some(Err(history)) => Err(RehearsalError::NoForecast(history.missing)),
            None => Err(RehearsalError::NoForecast("no estimate counts".to_owned())),
        }
    }
}
