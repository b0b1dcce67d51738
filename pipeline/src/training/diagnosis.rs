//! From maps of known faults to masks and diagnosers, along the links of a chain.
//!
//! What: the mask by the chain's rule, a diagnoser for uploads with and one for uploads without load ratio, and
//! figures on maps that neither has seen.
//! A chain of the raw map has one diagnoser for both kinds of upload. So has every chain on a dataset that does
//! not say under which load its maps were made: to take the load as zero would turn every load into faults.
//! Loads of service: simulated maps for calibration and judgement are made under random command and load. Maps of
//! a dataset may all be of one load, so a diagnosis that is not told the load is calibrated and judged on
//! copies under varied ones.

use ::diagnosis::{
    Diagnoser, LoadInput, LoadVariation, MapKind, TrainingMap, TrainingSet, TrainingSettings, Validation,
    ValidationSettings, train, validate,
};
use domain::Mask;
use ema::simulation::Model as MotorModel;
use reduction::{MaskDesign, ModeCount, PodBasis, ReductionError, SelfOrganisingMap, condition_number};

use super::{TrainError, Training, maps};
use crate::{ChainSettings, Dataset, DiagnosisMetrics, Lf1Form, MaskRule};

/// High-fidelity maps that calibrate the error law.
const CALIBRATION_MAPS: usize = 100;
/// High-fidelity maps that judge the diagnosers.
const VALIDATION_MAPS: usize = 100;
/// The share of a dataset that calibrates, and the share that judges.
const HELD_OUT_SHARE: usize = 10;
/// Maps that calibrate, and maps that judge, at least.
const LEAST_HELD_OUT: usize = 10;
/// Copies of a dataset's map under loads of service.
const LOADS_PER_MAP: usize = 8;
/// Standard deviation of a sample in validation, units of k_nom.
const SAMPLE_NOISE: f64 = 0.01;
/// Noise realisations per map in validation.
const VALIDATION_REPEATS: usize = 10;

/// What a bundle gets of it.
pub struct Diagnosis {
    pub masks: Vec<Mask>,
    pub self_organising_map: Option<SelfOrganisingMap>,
    pub with_load_ratio: Diagnoser,
    pub without_load_ratio: Diagnoser,
    pub metrics: DiagnosisMetrics,
}

/// Maps, each used for one thing only.
struct Material {
    learn: Vec<TrainingMap>,
    calibration: Vec<TrainingMap>,
    validation: Vec<TrainingMap>,
    /// Whether load ratios are known.
    load_known: bool,
    /// Whether calibration and validation happen under loads of service already.
    loads_of_service: bool,
}

impl Training<'_> {
    /// Masks, diagnosers, and how good these are on maps that they have not seen.
    pub(super) fn diagnosis(&self, dataset: Option<&Dataset>) -> Result<Diagnosis, TrainError> {
        let material = match dataset {
            Some(dataset) => self.split(dataset),
            None => self.simulated()?,
        };
        let chain = ChainSettings {
            map: if material.load_known { self.settings.chain.map } else { MapKind::Raw },
            ..self.settings.chain
        };
        let (mask, self_organising_map) = self.mask(&chain, &material)?;
        self.progress.stage("training the diagnosis", if chain.map == MapKind::Raw { 1 } else { 2 });
        let without_load_ratio = self.diagnoser(MapKind::Raw, &mask, &material, "diagnosis without load ratio")?;
        let with_load_ratio = match chain.map {
            MapKind::Raw => without_load_ratio.clone(),
            MapKind::LoadInvariant => {
                self.diagnoser(MapKind::LoadInvariant, &mask, &material, "diagnosis with load ratio")?
            }
        };
        let metrics = self.judge(&mask, &material, &with_load_ratio, &without_load_ratio)?;
        let uniform = MaskDesign::default().uniform(mask.map_length())?;
        let masks = if uniform == mask { vec![mask] } else { vec![mask, uniform] };
        Ok(Diagnosis { masks, self_organising_map, with_load_ratio, without_load_ratio, metrics })
    }

    /// Maps of LF1 to learn from, of HF for the rest.
    fn simulated(&self) -> Result<Material, TrainError> {
        let form = match self.settings.chain.lf1 {
            Lf1Form::Pair => MotorModel::LowFidelity1,
            Lf1Form::Thesis => MotorModel::LowFidelity1Thesis,
        };
        Ok(Material {
            learn: self.maps("maps to learn from", form, self.settings.samples)?,
            calibration: self.maps("maps to calibrate with", MotorModel::HighFidelity, CALIBRATION_MAPS)?,
            validation: self.maps("maps to judge by", MotorModel::HighFidelity, VALIDATION_MAPS)?,
            load_known: true,
            loads_of_service: true,
        })
    }

    fn maps(&self, name: &'static str, model: MotorModel, count: usize) -> Result<Vec<TrainingMap>, TrainError> {
        self.progress.stage(name, count);
        let faults = self.samples(count, name);
        maps::simulate(&self.settings.motor, model, &faults, &self.stream(name), &|| self.progress.step())
    }

    /// The maps of a dataset: most to learn from, some held out to calibrate, some to judge.
    fn split(&self, dataset: &Dataset) -> Material {
        let mut learn = maps::of_dataset(dataset, self.settings.motor.back_emf_v_s_rad);
        let held_out = (learn.len() / HELD_OUT_SHARE).max(LEAST_HELD_OUT);
        self.stream("split of the dataset").shuffle(&mut learn);
        let validation = learn.split_off(learn.len() - held_out);
        let calibration = learn.split_off(learn.len() - held_out);
        Material { learn, calibration, validation, load_known: dataset.has_load_ratio(), loads_of_service: false }
    }

    /// The mask by the chain's rule, and the self-organising map behind it if that was the rule.
    fn mask(
        &self,
        chain: &ChainSettings,
        material: &Material,
    ) -> Result<(Mask, Option<SelfOrganisingMap>), ReductionError> {
        let design = MaskDesign::default();
        let snapshots: Vec<Vec<f64>> = material.learn.iter().map(|map| map.values(chain.map)).collect();
        let basis = PodBasis::train(&snapshots, ModeCount::Fixed(chain.modes))?;
        match chain.mask {
            MaskRule::DOptimal => Ok((design.d_optimal(&basis)?, None)),
            MaskRule::Qr => Ok((design.qr(&basis)?, None)),
            MaskRule::Uniform => Ok((design.uniform(basis.map_length())?, None)),
            MaskRule::Som => {
                let (mask, map) = design.som(&basis, &mut self.stream("self-organising map"))?;
                Ok((mask, Some(map)))
            }
        }
    }

    fn diagnoser(
        &self,
        kind: MapKind,
        mask: &Mask,
        material: &Material,
        purpose: &str,
    ) -> Result<Diagnoser, TrainError> {
        let calibration = self.under_loads_of_service(kind, material, &material.calibration, "calibration loads");
        let set = TrainingSet { fault_model: &self.faults, mask, maps: &material.learn, calibration: &calibration };
        let settings = training_settings(&self.settings.chain, kind, material.load_known);
        let diagnoser = train(&set, &settings, &self.stream(purpose))?;
        self.progress.step();
        Ok(diagnoser)
    }

    /// Figures on the maps held out for them.
    fn judge(
        &self,
        mask: &Mask,
        material: &Material,
        with: &Diagnoser,
        without: &Diagnoser,
    ) -> Result<DiagnosisMetrics, ReductionError> {
        let validate = |diagnoser: &Diagnoser, load: LoadInput| -> Result<Validation, ReductionError> {
            let kind = diagnoser.reader.kind;
            let maps = self.under_loads_of_service(kind, material, &material.validation, "validation loads");
            let load = if kind == MapKind::Raw { LoadInput::None } else { load };
            let settings = ValidationSettings { load, noise: SAMPLE_NOISE, repeats: VALIDATION_REPEATS };
            validate(diagnoser, mask, &maps, &settings, &self.stream("validation noise"))
        };
        Ok(DiagnosisMetrics {
            maps: material.validation.len(),
            condition_number: Some(condition_number(&with.basis, mask)?),
            load_ratio_per_sample: validate(with, LoadInput::PerSample)?,
            mean_load_ratio: validate(with, LoadInput::Mean)?,
            no_load_ratio: validate(without, LoadInput::None)?,
        })
    }

    /// The maps, or copies of them under other loads where their reader is not told the load.
    fn under_loads_of_service(
        &self,
        kind: MapKind,
        material: &Material,
        maps: &[TrainingMap],
        purpose: &str,
    ) -> Vec<TrainingMap> {
        if kind == MapKind::LoadInvariant || material.loads_of_service || !material.load_known {
            return maps.to_vec();
        }
        let stream = self.stream(purpose);
        let copy = |index: usize| {
            let mut stream = stream.substream(index as u64);
            maps[index % maps.len()].under_load(&LoadVariation::REFERENCE_ACTUATOR, &self.faults, &mut stream)
        };
        (0..LOADS_PER_MAP * maps.len()).map(copy).collect()
    }
}

/// The settings of a chain for one kind of map. Loads are varied from known ones only.
fn training_settings(chain: &ChainSettings, kind: MapKind, load_known: bool) -> TrainingSettings {
    let settings = TrainingSettings::new(kind);
    TrainingSettings {
        modes: ModeCount::Fixed(chain.modes),
        prior: chain.gappy,
        hidden: chain.hidden,
        noise_training: chain.noise_training,
        // Without noise and loads every copy of a map would be the same.
        realisations: if chain.noise_training { settings.realisations } else { 1 },
        load: if chain.noise_training && load_known { settings.load } else { LoadVariation::NONE },
        ..settings
    }
}
