//! A bundle tried out before it judges anything.
//!
//! A file may be well-formed and yet hold parts that do not work together: matrices of other sizes, figures
//! that lead to no number, or to a wrong one. A rehearsal looks at every figure by itself, then takes every online step
//! on what is known beforehand: maps of known faults, faults that end a life and such that do not, a life without a
//! fault, one whose fault grows, and one that is over. Maps and verdicts of a bundle that learned from a dataset are
//! not known here; of faults of an own diagnosis only what the bundle says of their limits.

mod own_faults;

use std::{
    ops::RangeInclusive,
    panic::{AssertUnwindSafe, catch_unwind},
};

use diagnosis::Measurement;
use domain::{
    Ahead, Component, Diagnosis, Estimate, FaultGroup, FaultModel, FaultVector, Invalid, Life, LoadRatio, Mask,
    NUMERICS_VERSION, Outcome, Timestamp, prognosis::Forecast,
};
use ema::{
    assessment::assess,
    faults::ElectricalFaults,
    lf2::Parameters,
    life::DIAGNOSIS_SD,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{self, Settings, simulate_map},
};
use numerics::Stream;
use prognosis::Boundary;

use crate::{Assessment, EstimateError, Lf1Form, LifeContext, MapChain, Model, OutlookError, sense};

/// Standard deviation of a sample, in k_nom.
const NOISE: f64 = 0.01;
/// Simulated time of a map, s.
const DURATION_S: f64 = 2.0;
/// Faults that a diagnosis must recognise: none, each short, an eccentricity, several at once.
const KNOWN: [[f64; 5]; 6] = [
    [0.0, 0.0, 0.0, 0.5, 0.5],
    [0.2, 0.0, 0.0, 0.5, 0.5],
    [0.0, 0.2, 0.0, 0.5, 0.5],
    [0.0, 0.0, 0.2, 0.5, 0.5],
    [0.0, 0.0, 0.0, 0.65, 0.4],
    [0.08, 0.03, 0.12, 0.45, 0.58],
];
/// How far a diagnosis may be off, besides what its own sigma explains.
const OFF: f64 = 0.03;
/// Sigma that a diagnosis at that noise may state.
const SIGMA: RangeInclusive<f64> = 3e-4..=0.12;
/// Mean square of errors relative to their sigma: around one for a calibrated law.
const MEAN_SQUARE: RangeInclusive<f64> = 0.05..=12.0;
/// A verdict is known where the least figure is so far from its requirement.
const CLEAR: f64 = 0.06;
/// Standard deviation of a margin where the surrogate was taught.
const SURE: f64 = 0.02;

/// Flight hours between two uploads of a made-up life.
const STEP_FH: f64 = 5.0;
/// Uploads of the life without a fault: enough for ten closed blocks.
const UPLOADS: u32 = 44;
/// Deviation of the fault that grows, at the start of its life, and its growth rate.
const FIRST: f64 = 0.02;
const RATE_PER_H: f64 = 1e-3;
/// No such fault is without effect for so long, flight hours.
const LONGEST_FH: f64 = 3900.0;
/// Remaining life of that unit when it is forecast, and how many times as long or short a median may be.
const LEFT_FH: f64 = 300.0;
const TIMES: f64 = 3.0;
/// A unit without a fault lasts at least so long, flight hours, at P10.
const NEW_FH: f64 = 300.0;

/// Why a bundle cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RehearsalError {
    /// Figures that make no sense.
    #[error("{0}")]
    Senseless(#[from] Invalid),
    /// A diagnosis failed.
    #[error("a diagnosis by mask {mask} fails: {error}")]
    Estimate {
        /// The mask.
        mask: domain::ContentHash,
        /// Why.
        error: EstimateError,
    },
    /// Known faults are not recognised.
    #[error("{which} load ratio: {found}, on the map of an actuator with faults {faults:?}")]
    Diagnosis {
        /// The part of the bundle: `with` or `without`.
        which: &'static str,
        /// What is wrong.
        found: String,
        /// The faults.
        faults: Vec<f64>,
    },
    /// The surrogate contradicts what is known.
    #[error("surrogate: {found} at faults {faults:?}")]
    Boundary {
        /// What it says.
        found: String,
        /// The faults.
        faults: Vec<f64>,
    },
    /// The outlook of a life failed.
    #[error("the outlook of a life fails: {0}")]
    Outlook(#[from] OutlookError),
    /// A made-up life has no forecast, or one that cannot be.
    #[error("prior: a life {life}: {found}")]
    Forecast {
        /// Which life.
        life: &'static str,
        /// What its forecast says.
        found: String,
    },
    /// Loads that no hinge has.
    #[error("loads: {0}")]
    Loads(String),
    /// Parts of it do not fit together.
    #[error("its parts do not fit together: a calculation ended abnormally")]
    Abnormal,
}

impl Model {
    /// Looks at every figure, and tries every online step on actuators and lives that are made up; seconds at most.
    pub fn rehearse(&self) -> Result<(), RehearsalError> {
        catch_unwind(AssertUnwindSafe(|| self.try_out())).unwrap_or(Err(RehearsalError::Abnormal))
    }

    fn try_out(&self) -> Result<(), RehearsalError> {
        sense::check(&self.bundle)?;
        self.hold_loads()?;
        match &self.bundle.assessment {
            Assessment::Maps(maps) => {
                self.recognise(maps)?;
                self.judge(maps)?;
                self.look_ahead()
            }
            Assessment::Own(measure) => self.look_ahead_of_own(measure),
        }
    }

    /// Whether what is known of the electrical actuator can be asked of this bundle.
    fn is_of_known_actuators(&self) -> bool {
        self.bundle.provenance.dataset.is_none() && self.bundle.faults == FaultModel::electrical()
    }

    /// Every kind of diagnosis by every mask, on maps of known faults; on the mean map where those are not known.
    fn recognise(&self, maps: &MapChain) -> Result<(), RehearsalError> {
        let known = if self.is_of_known_actuators() { self.known_maps(&maps.motor) } else { Vec::new() };
        if known.is_empty() {
            let mean = maps.without_load_ratio.basis.mean();
            return self.diagnoses(&KnownMap { faults: None, y: mean.to_vec(), r: vec![0.1; mean.len()] }).map(|_| ());
        }
        let mut squares: [Vec<f64>; 3] = Default::default();
        let (mut implausible, mut all) = (0, 0);
        for map in &known {
            for (input, diagnosis) in self.diagnoses(map)? {
                squares[input].extend(self.judged(map, input, &diagnosis)?);
                implausible += usize::from(!diagnosis.is_plausible());
                all += 1;
            }
        }
        let refuse = |which, found| Err(RehearsalError::Diagnosis { which, found, faults: KNOWN[0].to_vec() });
        if 3 * implausible > all {
            return refuse("with and without", format!("{implausible} of {all} diagnoses are implausible"));
        }
        for (input, squares) in squares.iter().enumerate() {
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            if !MEAN_SQUARE.contains(&mean) {
                let found = format!("squares of errors are {mean:.3} times what error_law says");
                return refuse(which(input), found);
            }
        }
        Ok(())
    }

    /// Squares of errors relative to their sigma, unless a diagnosis is off.
    fn judged(&self, map: &KnownMap, input: usize, found: &Diagnosis) -> Result<Vec<f64>, RehearsalError> {
        let Some(faults) = &map.faults else { return Ok(Vec::new()) };
        let refuse = |found: String| {
            Err(RehearsalError::Diagnosis { which: which(input), found, faults: faults.values().to_vec() })
        };
        let mut squares = Vec::new();
        for (i, name) in self.bundle.faults.names.iter().enumerate() {
            let (value, sigma) = (found.fault_vector.values()[i], found.sigma[i]);
            if !SIGMA.contains(&sigma) {
                return refuse(format!("the sigma of {name} is {sigma:.6}"));
            }
            let error = value - faults.values()[i];
            if error.abs() > OFF + 4.0 * sigma.min(OFF) {
                return refuse(format!("{name} is diagnosed as {value:.4}"));
            }
            squares.push((error / sigma) * (error / sigma));
        }
        Ok(squares)
    }

    /// The diagnoses of a map by every mask, each with the number of its load input.
    fn diagnoses(&self, map: &KnownMap) -> Result<Vec<(usize, Diagnosis)>, RehearsalError> {
        let mut stream = Stream::new(1, &["rehearsal"]);
        let mut diagnoses = Vec::new();
        for mask in self.bundle.masks() {
            let samples: Vec<_> = mask.bins().iter().map(|&bin| Some(map.y[bin] + NOISE * stream.normal())).collect();
            let of_points: Vec<f64> = mask.bins().iter().map(|&bin| map.r[bin]).collect();
            let mean = map.r.iter().sum::<f64>() / map.r.len() as f64;
            let per_sample = LoadRatio::PerSample(of_points.into_iter().map(Some).collect());
            for (input, load_ratio) in [None, Some(LoadRatio::Mean(mean)), Some(per_sample)].into_iter().enumerate() {
                let measurement =
                    Measurement { samples: &samples, load_ratio: load_ratio.as_ref(), noise: Some(NOISE) };
                let outcome = self.diagnose(&measurement, mask);
                let outcome = outcome.map_err(|error| RehearsalError::Estimate { mask: mask.id(), error })?;
                if let Outcome::Diagnosed(diagnosis) = outcome {
                    diagnoses.push((input, diagnosis));
                }
            }
        }
        Ok(diagnoses)
    }

    /// Maps of the bundle's motor with known faults, as those from which it learned; none if the motor does not turn.
    fn known_maps(&self, motor: &Motor) -> Vec<KnownMap> {
        let kind = match self.bundle.provenance.chain.lf1 {
            Lf1Form::Pair => simulation::Model::LowFidelity1,
            Lf1Form::Thesis => simulation::Model::LowFidelity1Thesis,
        };
        let settings = Settings::new(kind, DURATION_S);
        let map = |faults: [f64; 5]| {
            let faults = FaultVector(faults.to_vec());
            let electrical = ElectricalFaults::try_from(&faults).expect("five faults");
            let map = simulate_map(kind, motor, &electrical, &Manoeuvre::acquisition(), &settings);
            let values = |values: &[Option<f64>]| values.iter().copied().collect::<Option<Vec<f64>>>();
            Some(KnownMap { faults: Some(faults), y: values(&map.y)?, r: values(&map.r)? })
        };
        KNOWN.into_iter().filter_map(map).collect()
    }

    /// The surrogate at faults whose verdict is known.
    fn judge(&self, maps: &MapChain) -> Result<(), RehearsalError> {
        let (surrogate, faults) = (&maps.surrogate, &self.bundle.faults);
        let refuse = |found: String, k: &[f64]| Err(RehearsalError::Boundary { found, faults: k.to_vec() });
        let mut gradient = vec![0.0; faults.len()];
        let nominal = surrogate.look(&faults.nominal, &mut gradient);
        let is_sound = nominal.value > 0.0 && (0.0..=SURE).contains(&nominal.sigma);
        if !(is_sound && gradient.iter().all(|slope| slope.is_finite())) {
            let found = format!("the margin is {:.4} +- {:.4} without a fault", nominal.value, nominal.sigma);
            return refuse(found, &faults.nominal);
        }
        if !self.is_of_known_actuators() {
            return Ok(());
        }
        let parameters = Parameters::assessment_of(&maps.motor);
        for k in verdicts() {
            let truth = assess(&parameters, &FaultVector(k.to_vec())).expect("five faults").min_margin();
            let found = surrogate.look(&k, &mut gradient);
            if truth.abs() > CLEAR && found.value * truth < 0.0 {
                return refuse(
                    format!("the margin is {:.3} where the assessment function has {truth:.3}", found.value),
                    &k,
                );
            }
            if !(found.sigma.is_finite() && (0.0..=5.0).contains(&found.sigma)) {
                return refuse(format!("the sigma of the margin is {}", found.sigma), &k);
            }
        }
        Ok(())
    }

    /// Loads of the flights to expect, against what they are measured by.
    fn hold_loads(&self) -> Result<(), RehearsalError> {
        let Some(loads) = &self.bundle.loads else { return Ok(()) };
        let (configuration, envelope) = (&loads.sensor_configuration, &loads.envelope);
        let refuse = |found: String| Err(RehearsalError::Loads(found));
        let sd = |i: usize| envelope.covariance[i][i].sqrt();
        let (q_pa, q_sd_pa) = (envelope.mean[0], sd(0));
        if !(1.0..=1e5).contains(&q_pa) || !(0.01 * q_pa..=3.0 * q_pa).contains(&q_sd_pa) {
            return refuse(format!("envelope: a dynamic pressure of {q_pa:.1} +- {q_sd_pa:.1} Pa"));
        }
        let usual: [f64; 5] = std::array::from_fn(|i| envelope.mean[i].abs() + sd(i));
        let size = |row: &[f64; 5]| row.iter().zip(&usual).map(|(a, z)| a.abs() * z).sum::<f64>();
        let strain = configuration.strain_map.iter().map(size).fold(0.0, f64::max);
        if !(1e-5..=0.02).contains(&strain) {
            return refuse(format!("sensor_configuration/strain_map: strains of {strain:e}"));
        }
        for (surface, row, reference_nm) in [
            ("flap", &configuration.hinge_rows.flap, loads.references.flap_nm),
            ("aileron", &configuration.hinge_rows.aileron, loads.references.aileron_nm),
        ] {
            let times = size(row) / reference_nm;
            if !(0.02..=50.0).contains(&times) {
                return refuse(format!(
                    "references/{surface}_nm: usual loads are {times:.4} times the {reference_nm} N m"
                ));
            }
        }
        Ok(())
    }

    /// Forecasts of lives whose end is known by the surrogate.
    fn look_ahead(&self) -> Result<(), RehearsalError> {
        let refuse = |life, found: String| Err(RehearsalError::Forecast { life, found });
        let new = self.foretold(UPLOADS, |_| 0.0)?;
        let p10 = new.rul.quantile_fh(0.1);
        if new.probability_failed > 0.05 || p10.is_some_and(|fh| fh.is_nan() || fh < NEW_FH) || !new.doubts.is_empty() {
            return refuse("without a fault", words(&new));
        }
        let end_fh = self.end_of_growth()?;
        let growing = |t_fh: f64| FIRST * libm::exp(RATE_PER_H * t_fh);
        let uploads = |t_fh: f64| (t_fh / STEP_FH) as u32;
        let late = self.foretold(uploads((end_fh - LEFT_FH).max(100.0)), growing)?;
        let left_fh = end_fh - (end_fh - LEFT_FH).max(100.0);
        let median = late.rul.quantile_fh(0.5).unwrap_or(f64::INFINITY);
        if late.probability_failed > 0.4 || !(left_fh / TIMES..=left_fh * TIMES).contains(&median) {
            return refuse("with a growing fault", format!("{}; {left_fh:.0} h are left", words(&late)));
        }
        let over = self.foretold(uploads(end_fh + LEFT_FH), growing)?;
        if over.probability_failed < 0.6 {
            return refuse("that is over", words(&over));
        }
        Ok(())
    }

    /// When the fault that grows ends its life, by the surrogate.
    fn end_of_growth(&self) -> Result<f64, RehearsalError> {
        let at = |t_fh: f64| self.with_fault(FIRST * libm::exp(RATE_PER_H * t_fh));
        let times = (0..(LONGEST_FH / STEP_FH) as u32).map(|i| STEP_FH * f64::from(i));
        let end = times.into_iter().find(|&t_fh| self.boundary().margin(&at(t_fh).0) < 0.0);
        end.filter(|&end_fh| end_fh > LEFT_FH).ok_or_else(|| RehearsalError::Boundary {
            found: "a fault that grows to this ends a life at once or never".to_owned(),
            faults: at(LONGEST_FH).0,
        })
    }

    /// The faults with so much of the first one-sided fault.
    fn with_fault(&self, deviation: f64) -> FaultVector {
        let faults = &self.bundle.faults;
        let one_sided = faults.groups.iter().find_map(|group| match group {
            FaultGroup::OneSided { index } => Some(*index),
            FaultGroup::Free { .. } | FaultGroup::Pair { .. } => None,
        });
        let mut deviations = vec![0.0; faults.len()];
        deviations[one_sided.unwrap_or(0)] = deviation;
        faults.from_deviation(&deviations)
    }

    /// The forecast of a life of so many uploads whose fault has the deviation `growth` of its hours.
    fn foretold(&self, uploads: u32, growth: impl Fn(f64) -> f64) -> Result<Forecast, RehearsalError> {
        let mut stream = Stream::new(1, &["rehearsal", "life"]);
        let mask = &self.bundle.masks()[0];
        let history: Vec<Estimate> = (1..=uploads)
            .map(|number| {
                self.estimate_of(mask, number, self.with_fault(growth(STEP_FH * f64::from(number))), &mut stream)
            })
            .collect();
        self.forecast_of(&history)
    }

    /// The forecast of a made-up life with these estimates.
    fn forecast_of(&self, history: &[Estimate]) -> Result<Forecast, RehearsalError> {
        let component = Component {
            operator: "rehearsal".parse().expect("a name"),
            part_number: "rehearsal".parse().expect("a name"),
            serial_number: "1".parse().expect("a name"),
        };
        let life = Life { component, overhaul_index: 0 };
        let context = LifeContext { life: &life, generation: 1, prior: self.prior(), began_fh: 0.0 };
        let outlook = self.outlook(&context, &self.course(&context, history), &[], None, false, &Ahead::default())?;
        let none = |found: String| RehearsalError::Forecast { life: "with a history has no forecast", found };
        match outlook.prognosis.map(|prognosis| prognosis.forecast) {
            Some(Ok(forecast)) => Ok(forecast),
            Some(Err(history)) => Err(none(history.missing)),
            None => Err(none("no estimate counts".to_owned())),
        }
    }

    /// What a diagnosis says of `faults`, with the error that is usual.
    fn estimate_of(&self, mask: &Mask, number: u32, faults: FaultVector, stream: &mut Stream) -> Estimate {
        let sigma: Vec<f64> = (0..faults.0.len()).map(|i| DIAGNOSIS_SD.get(i).copied().unwrap_or(0.02)).collect();
        let noisy = |(k, sigma): (f64, &f64)| (k + sigma * stream.normal()).clamp(0.0, 1.0);
        let flight_hours = STEP_FH * f64::from(number);
        Estimate {
            upload_id: format!("rehearsal-{number:04}").parse().expect("a name"),
            flight_hours,
            recorded_at: Timestamp::from_micros(0).plus_hours(3.0 * flight_hours),
            mask_id: Some(mask.id()),
            model: self.hash,
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome: Outcome::Diagnosed(Diagnosis {
                fault_vector: FaultVector(faults.0.into_iter().zip(&sigma).map(noisy).collect()),
                sigma,
                fit: None,
            }),
            load: None,
            temperature: None,
            load_ratio: None,
            on_ground: false,
        }
    }
}

/// A map and the load ratio at its bins, and the faults that made it where they are known.
struct KnownMap {
    faults: Option<FaultVector>,
    y: Vec<f64>,
    r: Vec<f64>,
}

/// The part of the bundle that reads a load input.
fn which(input: usize) -> &'static str {
    if input == 0 { "without" } else { "with" }
}

/// What a forecast says, in a few words.
fn words(forecast: &Forecast) -> String {
    let hours =
        |level: f64| forecast.rul.quantile_fh(level).map_or("beyond the horizon".to_owned(), |fh| format!("{fh:.0} h"));
    let doubts = if forecast.doubts.is_empty() { "" } else { ", and is doubted" };
    format!("P10 is {}, the median {}, P(failed) {:.2}{doubts}", hours(0.1), hours(0.5), forecast.probability_failed)
}

/// Faults of all sizes: shorts alone and together, eccentricities, both.
fn verdicts() -> Vec<[f64; 5]> {
    let sizes = [0.03, 0.06, 0.1, 0.15, 0.25, 0.4];
    let mut all = Vec::new();
    for size in sizes {
        let half = 0.5 * size;
        all.extend([
            [size, 0.0, 0.0, 0.5, 0.5],
            [0.0, size, 0.0, 0.5, 0.5],
            [0.0, 0.0, size, 0.5, 0.5],
            [half, half, half, 0.5, 0.5],
            [0.0, 0.0, 0.0, 0.5 + half, 0.5],
            [0.0, 0.0, 0.0, 0.5, 0.5 - half],
            [half, 0.0, 0.0, 0.5 - half, 0.5 + half],
        ]);
    }
    all
}
