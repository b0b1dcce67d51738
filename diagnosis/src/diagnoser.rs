//! From the samples of one upload to the fault vector.
//!
//! What: Gappy POD, network, calibrated uncertainty, plausibility.
//! Rule: samples, as load-invariant values where the load ratio is known, with sd
//! sqrt((noise/(1 + r))^2 + floor^2) -> MAP coefficients -> network -> deviation from nominal. The
//! load-invariant map shows eccentricity as zeta/(1 + r), so pairs are multiplied back by 1 + mean r.
//! Plausibility: chi-square of the least-squares residual within its 99.9 % limit. Where it is not, the
//! worst studentised point is left out, once; a diagnosis that passes then is plausible, else all
//! points are kept and it is not. Blind to what lies inside the subspace of the modes.
//! Requires: valid samples >= modes + 2.
//! Source: Berri 2021, sections 2.3 and 6.2-6.4.

use domain::{Diagnosis, FaultGroup, FaultModel, FaultVector, LoadRatio, Mask, Outcome};
use reduction::{GappyFit, GappyPod, PodBasis, Prior, ReductionError, Sample, load_invariant};
use serde::{Deserialize, Serialize};

use crate::{ErrorLaw, Mlp, chi_square};

/// A point whose 1 + r is below this carries next to no information on the load-invariant map.
const SMALLEST_LOAD_GAIN: f64 = 0.25;

/// Which map a diagnoser reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapKind {
    /// y' = (y + r)/(1 + r): the upload gives the load ratio.
    LoadInvariant,
    /// The raw map y: the load is unknown, and trained as a nuisance.
    Raw,
}

/// What one upload measured at the points of a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<'a> {
    /// Back-EMF samples in units of k_nom, in the mask's order; `None` where no pass gave a value.
    pub samples: &'a [Option<f64>],
    /// Load ratio; a load-invariant diagnoser needs it, a raw one ignores it.
    pub load_ratio: Option<&'a LoadRatio>,
    /// Standard deviation of a sample in units of k_nom, where the upload states it.
    pub noise: Option<f64>,
}

/// A trained diagnosis: everything that turns samples into a fault vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnoser {
    /// Names and nominal values of the faults.
    pub fault_model: FaultModel,
    /// Which map it reads.
    pub kind: MapKind,
    /// POD basis of that map, in units of k_nom.
    pub basis: PodBasis,
    /// From coefficients to deviations from nominal.
    pub mlp: Mlp,
    /// Standard deviation of a sample in training, units of k_nom: assumed where an upload states none.
    pub noise: f64,
    /// Standard deviation of a map value that the basis does not explain, units of k_nom.
    pub floor: f64,
    /// Error law with a load ratio per sample, or of the raw map.
    pub error_law: ErrorLaw,
    /// Error law with the mean load ratio only.
    pub mean_load_error_law: ErrorLaw,
}

/// Samples in the coordinates of the diagnoser's map.
struct Prepared {
    samples: Vec<Option<Sample>>,
    /// Factor on the eccentricity that the map shows, 1 + mean r.
    pair_gain: f64,
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
        let load_invariant = self.kind == MapKind::LoadInvariant;
        let law = match measurement.load_ratio {
            Some(LoadRatio::Mean(_)) if load_invariant => &self.mean_load_error_law,
            _ => &self.error_law,
        };
        let pairs = assessment.sampling_variance.iter().zip(&assessment.deviation).enumerate();
        Diagnosis {
            sigma: pairs.map(|(i, (variance, deviation))| law.sigma(i, *variance, *deviation)).collect(),
            fault_vector: assessment.fault_vector,
            plausible: assessment.plausible,
            chi_square: assessment.chi_square,
            degrees_of_freedom: assessment.degrees_of_freedom,
            load_invariant,
        }
    }

    /// Everything but the error law, or the number of usable samples where these are too few.
    pub(crate) fn assess(&self, gappy: &GappyPod, measurement: &Measurement) -> Result<Assessment, usize> {
        let mut prepared = prepare(self.kind, self.noise, self.floor, measurement);
        let usable = prepared.samples.iter().flatten().count();
        if usable < self.needed_samples() {
            return Err(usable);
        }
        let (residual, plausible) = self.judge(gappy, &mut prepared.samples);
        let fit = gappy.fit(&prepared.samples, Prior::Pod);
        let (deviation, sampling_variance) = self.deviation(&fit, prepared.pair_gain);
        let fault_vector = clamped(self.fault_model.from_deviation(&deviation));
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

    /// Deviations from nominal and the variance that the samples' noise causes in them.
    fn deviation(&self, fit: &GappyFit, pair_gain: f64) -> (Vec<f64>, Vec<f64>) {
        let linearisation = self.mlp.linearise(&fit.coefficients);
        let gains = fault_gains(&self.fault_model, pair_gain);
        let values = linearisation.outputs.iter().zip(&gains).map(|(x, gain)| x * gain).collect();
        let variance = |(row, gain): (&Vec<f64>, &f64)| gain * gain * fit.sampling_covariance.quadratic(row);
        (values, linearisation.jacobian.iter().zip(&gains).map(variance).collect())
    }
}

/// The coefficients that a network of this kind of map sees for a measurement, with the factor on pairs.
pub(crate) fn coefficients(
    gappy: &GappyPod,
    kind: MapKind,
    (noise, floor): (f64, f64),
    measurement: &Measurement,
) -> (Vec<f64>, f64) {
    let prepared = prepare(kind, noise, floor, measurement);
    (gappy.fit(&prepared.samples, Prior::Pod).coefficients, prepared.pair_gain)
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

/// Values of the diagnoser's map with their standard deviations.
fn prepare(kind: MapKind, noise: f64, floor: f64, measurement: &Measurement) -> Prepared {
    let noise = measurement.noise.unwrap_or(noise);
    let sample = |value: f64, gain: f64| Sample { value, sd: (noise * noise / (gain * gain) + floor * floor).sqrt() };
    if kind == MapKind::Raw {
        let samples = measurement.samples.iter().map(|y| y.map(|y| sample(y, 1.0))).collect();
        return Prepared { samples, pair_gain: 1.0 };
    }
    let ratios = load_ratios(measurement);
    assert_eq!(ratios.len(), measurement.samples.len(), "load ratios of another mask");
    let at = |(y, r): (&Option<f64>, &Option<f64>)| {
        let (y, r) = ((*y)?, (*r)?);
        (1.0 + r >= SMALLEST_LOAD_GAIN).then(|| sample(load_invariant::from_raw(y, r), 1.0 + r))
    };
    let samples: Vec<Option<Sample>> = measurement.samples.iter().zip(&ratios).map(at).collect();
    let used: Vec<f64> = ratios.iter().zip(&samples).filter_map(|(r, sample)| r.filter(|_| sample.is_some())).collect();
    let mean_ratio = used.iter().fold(0.0, |sum, r| sum + r) / used.len().max(1) as f64;
    Prepared { samples, pair_gain: 1.0 + mean_ratio }
}

/// The load ratio at each point; a mean serves all of them.
fn load_ratios(measurement: &Measurement) -> Vec<Option<f64>> {
    match measurement.load_ratio.expect("a load-invariant diagnosis needs the load ratio") {
        LoadRatio::Mean(r) => vec![Some(*r); measurement.samples.len()],
        LoadRatio::PerSample(ratios) => ratios.clone(),
    }
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
