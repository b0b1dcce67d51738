//! Training a diagnoser from maps of known faults.
//!
//! What: basis, floor, network and error law of one kind of map.
//! Rule: POD of the maps (raw ones under varied load); the floor is the rms residual that the basis
//! leaves on the calibration maps at the mask; the network learns deviations from nominal from MAP
//! (or least-squares) coefficients of noisy samples, several realisations of noise (and load) per map, by
//! Levenberg-Marquardt with a held-out part of the maps deciding when to stop; the error law is
//! fitted to noisy diagnoses of the calibration maps.
//! Requires: maps of one length, in units of k_nom; calibration maps from a better model than the
//! training maps where there is one, else the held-out maps serve.
//! Source: Berri 2021, sections 2.3 and 6.2-6.3.

use domain::{FaultModel, Mask};
use numerics::Stream;
use rayon::prelude::*;
use reduction::{GappyPod, ModeCount, PodBasis, Prior, ReductionError, Sample};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    Diagnoser, ErrorLaw, LoadInput, LoadVariation, MapKind, MapReader, Measurement, Mlp, TrainingMap,
    diagnoser::fault_gains,
    error_law::CalibrationPoint,
    levenberg_marquardt::StopRule,
    mlp_fit::{Examples, FitSettings, fit},
    simulated_upload::SimulatedUpload,
};

/// Noise of the calibration diagnoses over the nominal one, so that the law follows the noise of an upload.
const CALIBRATION_NOISES: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// The material of a training.
#[derive(Debug, Clone, Copy)]
pub struct TrainingSet<'a> {
    /// Names and nominal values of the faults.
    pub fault_model: &'a FaultModel,
    /// The mask whose noise the network learns.
    pub mask: &'a Mask,
    /// Maps to learn from.
    pub maps: &'a [TrainingMap],
    /// Maps of the best model there is, for floor and error law; empty: held-out training maps.
    pub calibration: &'a [TrainingMap],
}

/// The settings of a training.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrainingSettings {
    /// Which map to read.
    pub kind: MapKind,
    /// Modes of the basis.
    pub modes: ModeCount,
    /// What is taken as known of the coefficients before the samples.
    pub prior: Prior,
    /// Hidden units.
    pub hidden: usize,
    /// Standard deviation of a sample, units of k_nom.
    pub noise: f64,
    /// Whether the network learns from samples with that noise; without it, from clean ones.
    pub noise_training: bool,
    /// The least floor, units of k_nom: what a model of the motor never explains.
    pub least_floor: f64,
    /// Noisy copies of each map.
    pub realisations: usize,
    /// Random starts of the network.
    pub restarts: usize,
    /// Steps of Levenberg-Marquardt at most.
    pub steps: usize,
    /// Fraction of the maps that decides when to stop.
    pub held_out: f64,
    /// Loads of service that the training maps do not cover; used by raw maps only.
    pub load: LoadVariation,
}

impl TrainingSettings {
    /// The recommended settings for a kind of map, at 1 % noise.
    pub fn new(kind: MapKind) -> Self {
        Self {
            kind,
            modes: ModeCount::Fixed(9),
            prior: Prior::Pod,
            hidden: 14,
            noise: 0.01,
            noise_training: true,
            least_floor: 0.001,
            realisations: 8,
            restarts: 4,
            steps: 100,
            held_out: 0.15,
            load: LoadVariation::REFERENCE_ACTUATOR,
        }
    }
}

/// Why a training failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrainingError {
    /// The maps do not make a basis, or not for this mask.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// A network needs examples to fit and others to stop by.
    #[error("{0} maps are too few to train from, at least {LEAST_MAPS} are needed")]
    TooFewMaps(usize),
    /// A map's fault vector is not one of the model's.
    #[error("map {index} has {found} faults where the model has {expected}")]
    Faults {
        /// Which map.
        index: usize,
        /// Its number of faults.
        found: usize,
        /// The model's number of faults.
        expected: usize,
    },
    /// A map's load ratios are not as many as its values.
    #[error("map {index} has {found} load ratios where it has {expected} values")]
    LoadRatios {
        /// Which map.
        index: usize,
        /// Its number of load ratios.
        found: usize,
        /// Its number of values.
        expected: usize,
    },
}

/// Diagnoses at each noise from which an error law is fitted.
const CALIBRATION_DIAGNOSES: usize = 3000;
/// Number of maps below which a split leaves nothing to stop by.
const LEAST_MAPS: usize = 20;

/// What a random stream serves; every purpose and index has its own.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Split,
    Load,
    Noise,
    HeldOutLoad,
    HeldOutNoise,
    Start,
    Calibration,
}

fn stream_of(stream: &Stream, purpose: Purpose, index: usize) -> Stream {
    stream.substream(((purpose as u64) << 32) + index as u64)
}

/// Trains a diagnoser; the same set, settings and stream give the same diagnoser on one machine.
pub fn train(set: &TrainingSet, settings: &TrainingSettings, stream: &Stream) -> Result<Diagnoser, TrainingError> {
    check(set)?;
    let trainer = Trainer { set, settings, stream };
    let (fitted, held_out) = trainer.split();
    let fitted = trainer.copies(&fitted, Purpose::Load);
    let held_out = trainer.copies(&held_out, Purpose::HeldOutLoad);
    let calibration = if set.calibration.is_empty() { &held_out } else { set.calibration };

    // The first copy of every map; the others differ by their load only.
    let snapshots = &fitted[..fitted.len() / settings.realisations];
    let values: Vec<Vec<f64>> = snapshots.iter().map(|map| map.values(settings.kind)).collect();
    let basis = PodBasis::train(&values, settings.modes)?;
    let gappy = GappyPod::new(&basis, set.mask)?;
    let reader = MapReader {
        kind: settings.kind,
        noise: settings.noise,
        floor: trainer.floor(&gappy, calibration),
        mean_load_offset: mean_load_offset(set.maps),
    };
    let fitted = trainer.examples(&gappy, &reader, &fitted, Purpose::Noise);
    let held_out = trainer.examples(&gappy, &reader, &held_out, Purpose::HeldOutNoise);
    let mlp = trainer.network(&basis, &fitted, &held_out);
    let diagnoser = Diagnoser {
        fault_model: set.fault_model.clone(),
        reader,
        basis,
        prior: settings.prior,
        mlp,
        error_law: ErrorLaw::linearised(set.fault_model.len()),
        mean_load_error_law: None,
    };
    let law = |load| trainer.error_law(&diagnoser, &gappy, calibration, load);
    let error_law = law(trainer.load_input());
    let mean_load_error_law = (settings.kind == MapKind::LoadInvariant).then(|| law(LoadInput::Mean));
    Ok(Diagnoser { error_law, mean_load_error_law, ..diagnoser })
}

/// Lengths that everything below relies on.
fn check(set: &TrainingSet) -> Result<(), TrainingError> {
    if set.maps.len() < LEAST_MAPS {
        return Err(TrainingError::TooFewMaps(set.maps.len()));
    }
    let expected = set.fault_model.len();
    for (index, map) in set.maps.iter().chain(set.calibration).enumerate() {
        if map.faults.0.len() != expected {
            return Err(TrainingError::Faults { index, found: map.faults.0.len(), expected });
        }
        if map.r.len() != map.y.len() {
            return Err(TrainingError::LoadRatios { index, found: map.r.len(), expected: map.y.len() });
        }
        if map.y.len() != set.mask.map_length() {
            return Err(ReductionError::MapLength { mask: set.mask.map_length(), basis: map.y.len() }.into());
        }
    }
    Ok(())
}

/// Mean over the maps of mean of the bins' load ratios less the map's mean load ratio.
fn mean_load_offset(maps: &[TrainingMap]) -> f64 {
    let offset = |map: &TrainingMap| map.r.iter().sum::<f64>() / map.r.len() as f64 - map.mean_r;
    maps.iter().map(offset).sum::<f64>() / maps.len() as f64
}

/// One training: its material, settings and random numbers.
struct Trainer<'a> {
    set: &'a TrainingSet<'a>,
    settings: &'a TrainingSettings,
    stream: &'a Stream,
}

impl<'a> Trainer<'a> {
    /// What a diagnosis of this kind is told of the load at best.
    fn load_input(&self) -> LoadInput {
        match self.settings.kind {
            MapKind::LoadInvariant => LoadInput::PerSample,
            MapKind::Raw => LoadInput::None,
        }
    }

    /// Maps to fit and maps held out, by a random split.
    fn split(&self) -> (Vec<&'a TrainingMap>, Vec<&'a TrainingMap>) {
        let mut maps: Vec<&TrainingMap> = self.set.maps.iter().collect();
        stream_of(self.stream, Purpose::Split, 0).shuffle(&mut maps);
        let held_out = (self.settings.held_out * maps.len() as f64).round() as usize;
        let fitted = maps.split_off(held_out.clamp(1, maps.len() / 2));
        (fitted, maps)
    }

    /// As many copies of the maps as realisations; raw ones each under its own load.
    fn copies(&self, maps: &[&TrainingMap], purpose: Purpose) -> Vec<TrainingMap> {
        let copy = |index: usize| {
            let map = maps[index % maps.len()];
            match self.settings.kind {
                MapKind::LoadInvariant => map.clone(),
                MapKind::Raw => {
                    let mut stream = stream_of(self.stream, purpose, index);
                    map.under_load(&self.settings.load, self.set.fault_model, &mut stream)
                }
            }
        };
        (0..maps.len() * self.settings.realisations).map(copy).collect()
    }

    /// Root mean square of what the basis leaves unexplained on noise-free samples.
    fn floor(&self, gappy: &GappyPod, maps: &[TrainingMap]) -> f64 {
        let sd = self.settings.noise;
        let unexplained = |map: &TrainingMap| {
            let values = map.values(self.settings.kind);
            let sample = |bin: &usize| Some(Sample { value: values[*bin], sd });
            let samples: Vec<_> = self.set.mask.bins().iter().map(sample).collect();
            let fit = gappy.fit(&samples, Prior::Flat);
            fit.chi_square * sd * sd / fit.degrees_of_freedom.max(1) as f64
        };
        let mean_square = maps.iter().map(unexplained).sum::<f64>() / maps.len() as f64;
        mean_square.sqrt().max(self.settings.least_floor)
    }

    /// Coefficients of noisy samples, and the deviations from nominal that the map shows.
    fn examples(&self, gappy: &GappyPod, reader: &MapReader, maps: &[TrainingMap], purpose: Purpose) -> Examples {
        let example = |(index, map): (usize, &TrainingMap)| {
            let mut stream = stream_of(self.stream, purpose, index);
            let noise = if self.settings.noise_training { reader.noise } else { 0.0 };
            let upload = SimulatedUpload::new(map, self.set.mask, self.load_input(), noise, &mut stream);
            // The weight of a sample is that of service, whatever noise the network learns from.
            let reading = reader.read(&Measurement { noise: Some(reader.noise), ..upload.measurement() });
            let gains = fault_gains(self.set.fault_model, reading.pair_gain);
            let deviation = self.set.fault_model.deviation(&map.faults);
            let target = deviation.iter().zip(gains).map(|(x, gain)| x / gain).collect();
            (gappy.fit(&reading.samples, self.settings.prior).coefficients, target)
        };
        let (inputs, targets) = maps.par_iter().enumerate().map(example).unzip();
        Examples { inputs, targets }
    }

    /// The best network of several starts; inputs are scaled so that the first has unit variance.
    fn network(&self, basis: &PodBasis, fitted: &Examples, held_out: &Examples) -> Mlp {
        let fit_settings = FitSettings {
            hidden: self.settings.hidden,
            input_scale: 1.0 / basis.prior_variance()[0].sqrt(),
            stop: StopRule { steps: self.settings.steps, patience: 8 },
        };
        let starts = (0..self.settings.restarts).map(|i| stream_of(self.stream, Purpose::Start, i)).collect();
        fit(fitted, held_out, &fit_settings, starts).0
    }

    /// The error law of diagnoses of the calibration maps, told this much of the load.
    fn error_law(&self, diagnoser: &Diagnoser, gappy: &GappyPod, maps: &[TrainingMap], load: LoadInput) -> ErrorLaw {
        let repeats = CALIBRATION_DIAGNOSES.div_ceil(maps.len());
        let points = |(index, map): (usize, &TrainingMap)| {
            let mut stream = stream_of(self.stream, Purpose::Calibration, index);
            let mut points = Vec::new();
            for factor in CALIBRATION_NOISES.repeat(repeats) {
                let upload =
                    SimulatedUpload::new(map, self.set.mask, load, factor * diagnoser.reader.noise, &mut stream);
                if let Ok(found) = diagnoser.assess(gappy, &upload.measurement()) {
                    points.push(
                        (0..map.faults.0.len())
                            .map(|i| CalibrationPoint {
                                error: found.fault_vector.0[i] - map.faults.0[i],
                                sampling_variance: found.sampling_variance[i],
                                deviation: found.deviation[i],
                                nominal_noise: factor == 1.0,
                            })
                            .collect::<Vec<_>>(),
                    );
                }
            }
            points
        };
        let diagnoses: Vec<Vec<CalibrationPoint>> = maps.par_iter().enumerate().flat_map_iter(points).collect();
        let faults = self.set.fault_model.len();
        let by_fault: Vec<Vec<_>> = (0..faults).map(|i| diagnoses.iter().map(|points| points[i]).collect()).collect();
        ErrorLaw::fit(&by_fault)
    }
}
