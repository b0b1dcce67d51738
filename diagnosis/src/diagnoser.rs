//! From the samples of one upload to the fault vector.
//!
//! What: Gappy POD, network, calibrated uncertainty, plausibility.
//! Rule: samples -> values of the map with their noise -> coefficients, MAP or least squares -> network ->
//! deviation from nominal. The load-invariant map shows eccentricity as zeta/(1 + r), so pairs are multiplied back by
//! 1 + mean r.
//! Plausibility: chi-square of the least-squares residual within its 99.9 % limit. Where it is not, the
//! worst studentised point is left out, once; a diagnosis that passes then is plausible, else all
//! points are kept and it is not. That is blind to what lies inside the subspace of the modes, so a map that no
//! training map comes near is not plausible either, however well the modes fit it: one with a coefficient of a
//! leading mode beyond 5.8 standard deviations of the training maps (no signal, a reversed one, another unit), or
//! with faults that the network puts a tenth or more outside 0 to 1 (more back-EMF than a motor gives).
//! Requires: valid samples >= modes + 2.
//! Source: Berri 2021, sections 2.3 and 6.2-6.4.

use domain::{Diagnosis, FaultGroup, FaultModel, FaultVector, LoadRatio, MapFit, Mask, Outcome};
use numerics::chi_square;
use reduction::{GappyFit, GappyPod, PodBasis, Prior, ReductionError, Sample};
use serde::{Deserialize, Serialize};

use crate::{ErrorLaw, MapKind, MapReader, Measurement, Mlp};

/// No map of training has a leading coefficient farther from the mean, standard deviations: with magnitudes of
/// importance sampling, three shorts at their largest reach 5.7.
const REACH: f64 = 5.8;
/// Modes lead that carry so much of the variance of the training maps; the others are skewed too much for a limit.
const LEADING: f64 = 0.01;
/// Faults outside 0 to 1 by more than so much and [`CERTAIN`] standard deviations are none: constants of motors of
/// one type differ by less.
const OVERSHOOT: f64 = 0.1;
const CERTAIN: f64 = 4.0;

/// A trained diagnosis: everything that turns samples into a fault vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnoser {
    /// Names and nominal values of the faults.
    pub fault_model: FaultModel,
    /// The reader that makes values of the map of samples.
    pub reader: MapReader,
    /// POD basis of that map, in units of k_nom.
    pub basis: PodBasis,
    /// What is taken as known of the coefficients before the samples.
    #[serde(default)]
    pub prior: Prior,
    /// The network that makes deviations from nominal of coefficients.
    pub mlp: Mlp,
    /// Error law with a load ratio per sample, or of the raw map.
    pub error_law: ErrorLaw,
    /// Error law with the mean load ratio only, where the map needs one.
    pub mean_load_error_law: Option<ErrorLaw>,
}

/// A diagnosis before its error law.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assessment {
    pub fault_vector: FaultVector,
    pub deviation: Vec<f64>,
    pub sampling_variance: Vec<f64>,
    pub plausible: bool,
    pub chi_square: f64,
    pub degrees_of_freedom: usize,
}

impl Diagnoser {
    /// The basis at the points of `mask`: made once per mask, used for every upload.
    pub fn on_mask(&self, mask: &Mask) -> Result<GappyPod, ReductionError> {
        GappyPod::new(&self.basis, mask)
    }

    /// Valid samples that a diagnosis needs.
    pub fn needed_samples(&self) -> usize {
        self.basis.len() + 2
    }

    /// Diagnoses one upload sampled at the mask of `gappy`.
    ///
    /// # Panics
    /// If samples or load ratios are not as many as the mask's points, or a load-invariant diagnoser
    /// gets no load ratio: uploads are checked against their mask, and the caller chooses the kind.
    pub fn diagnose(&self, gappy: &GappyPod, measurement: &Measurement) -> Outcome {
        match self.assess(gappy, measurement) {
            Err(valid_samples) => Outcome::Undiagnosable { valid_samples, needed: self.needed_samples() },
            Ok(assessment) => Outcome::Diagnosed(self.with_error_law(assessment, measurement)),
        }
    }

    /// The assessment with the law that holds for what was known of the load.
    fn with_error_law(&self, assessment: Assessment, measurement: &Measurement) -> Diagnosis {
        let law = match (&self.mean_load_error_law, measurement.load_ratio) {
            (Some(law), Some(LoadRatio::Mean(_))) => law,
            _ => &self.error_law,
        };
        let pairs = assessment.sampling_variance.iter().zip(&assessment.deviation).enumerate();
        Diagnosis {
            sigma: pairs.map(|(i, (variance, deviation))| law.sigma(i, *variance, *deviation)).collect(),
            fault_vector: assessment.fault_vector,
            fit: Some(MapFit {
                plausible: assessment.plausible,
                chi_square: assessment.chi_square,
                degrees_of_freedom: assessment.degrees_of_freedom,
                load_invariant: self.reader.kind == MapKind::LoadInvariant,
            }),
        }
    }

    /// Everything but the error law, or the number of usable samples where these are too few.
    pub(crate) fn assess(&self, gappy: &GappyPod, measurement: &Measurement) -> Result<Assessment, usize> {
        let mut reading = self.reader.read(measurement);
        let usable = reading.samples.iter().flatten().count();
        if usable < self.needed_samples() {
            return Err(usable);
        }
        let (residual, plausible) = self.judge(gappy, &mut reading.samples);
        let fit = gappy.fit(&reading.samples, self.prior);
        let (deviation, sampling_variance) = self.deviation(&fit, reading.pair_gain);
        let unclamped = self.fault_model.from_deviation(&deviation);
        let plausible = plausible && self.in_reach(&residual) && are_faults(&unclamped, &sampling_variance);
        let fault_vector = clamped(unclamped);
        Ok(Assessment {
            deviation: self.fault_model.deviation(&fault_vector),
            fault_vector,
            sampling_variance,
            plausible,
            chi_square: residual.chi_square,
            degrees_of_freedom: residual.degrees_of_freedom,
        })
    }

    /// The least-squares fit and whether it is plausible; takes out the one point that makes it so.
    fn judge(&self, gappy: &GappyPod, samples: &mut [Option<Sample>]) -> (GappyFit, bool) {
        let fit = gappy.fit(samples, Prior::Flat);
        if is_plausible(&fit) {
            return (fit, true);
        }
        let Some(worst) = worst_point(&fit).filter(|_| fit.degrees_of_freedom > 2) else {
            return (fit, false);
        };
        let suspect = samples[worst].take();
        let without = gappy.fit(samples, Prior::Flat);
        if is_plausible(&without) {
            return (without, true);
        }
        samples[worst] = suspect;
        (fit, false)
    }

    /// Whether maps like this one were learned from.
    fn in_reach(&self, fit: &GappyFit) -> bool {
        let variances = self.basis.prior_variance();
        let leading = LEADING * variances.iter().sum::<f64>();
        fit.coefficients.iter().zip(variances).enumerate().all(|(mode, (coefficient, variance))| {
            let sampling = fit.sampling_covariance.get(mode, mode);
            *variance < leading || coefficient * coefficient <= REACH * REACH * (variance + sampling)
        })
    }

    /// Deviations from nominal and the variance that the samples' noise causes in them.
    fn deviation(&self, fit: &GappyFit, pair_gain: f64) -> (Vec<f64>, Vec<f64>) {
        let linearisation = self.mlp.linearise(&fit.coefficients);
        let gains = fault_gains(&self.fault_model, pair_gain);
        let values = linearisation.outputs.iter().zip(&gains).map(|(x, gain)| x * gain).collect();
        let variance = |(row, gain): (&Vec<f64>, &f64)| gain * gain * fit.sampling_covariance.quadratic(row);
        (values, linearisation.jacobian.iter().zip(&gains).map(variance).collect())
    }
}

/// A factor for each fault: `pair_gain` for the entries of pairs, one for the others.
pub(crate) fn fault_gains(model: &FaultModel, pair_gain: f64) -> Vec<f64> {
    let mut gains = vec![1.0; model.len()];
    for group in &model.groups {
        if let FaultGroup::Pair { indices } = group {
            indices.iter().for_each(|index| gains[*index] = pair_gain);
        }
    }
    gains
}

/// Whether every entry is between 0 and 1, as nearly as it is known.
fn are_faults(unclamped: &FaultVector, sampling_variance: &[f64]) -> bool {
    unclamped.0.iter().zip(sampling_variance).all(|(k, variance)| {
        let slack = OVERSHOOT + CERTAIN * variance.sqrt();
        (-slack..=1.0 + slack).contains(k)
    })
}

fn is_plausible(fit: &GappyFit) -> bool {
    fit.chi_square <= chi_square::limit_999(fit.degrees_of_freedom)
}

/// The point with the largest studentised residual.
fn worst_point(fit: &GappyFit) -> Option<usize> {
    let sizes = fit.studentised.iter().enumerate().filter_map(|(i, t)| t.map(|t| (i, t.abs())));
    sizes.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

fn clamped(faults: FaultVector) -> FaultVector {
    FaultVector(faults.0.into_iter().map(|k| k.clamp(0.0, 1.0)).collect())
}
