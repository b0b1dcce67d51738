//! How good a diagnoser is on maps whose faults are known.
//!
//! err_k = sqrt(mean over the faults of (estimate - truth)^2), one number per diagnosis.
//! Source: Berri 2021, section 6.5, with the square inside the mean.

use domain::{Mask, Outcome};
use numerics::{Stream, quantile};
use reduction::ReductionError;
use serde::{Deserialize, Serialize};

use crate::{Diagnoser, LoadInput, TrainingMap, error_law::Z_90, simulated_upload::SimulatedUpload};

/// How maps are sampled for a validation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValidationSettings {
    /// What the diagnosis is told of the load.
    pub load: LoadInput,
    /// Standard deviation of the noise on each sample, units of k_nom.
    pub noise: f64,
    /// Noise realisations per map.
    pub repeats: usize,
}

/// Figures of a diagnoser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Median of err_k.
    pub median: f64,
    /// Mean of err_k.
    pub mean: f64,
    /// 95 % quantile of err_k.
    pub p95: f64,
    /// For each fault the fraction of truths inside the nominal 90 % interval.
    pub coverage_90: Vec<f64>,
    /// Fraction of diagnoses that were not plausible.
    pub implausible: f64,
}

/// Diagnoses every map several times under noise.
///
/// # Panics
/// If no map could be diagnosed.
pub fn validate(
    diagnoser: &Diagnoser,
    mask: &Mask,
    maps: &[TrainingMap],
    settings: &ValidationSettings,
    stream: &Stream,
) -> Result<Validation, ReductionError> {
    let gappy = diagnoser.on_mask(mask)?;
    let faults = diagnoser.fault_model.len();
    let (mut errors, mut inside, mut implausible) = (Vec::new(), vec![0.0; faults], 0.0);
    for (index, map) in maps.iter().enumerate() {
        let mut stream = stream.substream(index as u64);
        for _ in 0..settings.repeats {
            let upload = SimulatedUpload::new(map, mask, settings.load, settings.noise, &mut stream);
            let Outcome::Diagnosed(found) = diagnoser.diagnose(&gappy, &upload.measurement()) else { continue };
            implausible += f64::from(u8::from(!found.is_plausible()));
            let error = |i: usize| found.fault_vector.0[i] - map.faults.0[i];
            errors.push(((0..faults).map(|i| error(i) * error(i)).sum::<f64>() / faults as f64).sqrt());
            for (i, inside) in inside.iter_mut().enumerate() {
                *inside += f64::from(u8::from(error(i).abs() <= Z_90 * found.sigma[i]));
            }
        }
    }
    assert!(!errors.is_empty(), "no map could be diagnosed");
    let errors = quantile::sorted(errors);
    let count = errors.len() as f64;
    Ok(Validation {
        median: quantile::with_before(&errors, 0.5),
        mean: errors.iter().sum::<f64>() / count,
        p95: quantile::with_before(&errors, 0.95),
        coverage_90: inside.iter().map(|inside| inside / count).collect(),
        implausible: implausible / count,
    })
}
