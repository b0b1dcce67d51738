//! The file of a bundle: flat, and of either kind whole.
//!
//! What: fields of maps, or the measure of own faults; never some of each, and no other field.

use diagnosis::Diagnoser;
use domain::{FaultMeasure, FaultModel, Mask};
use ema::motor::Motor;
use prognosis::{LifePrior, surrogate::Surrogate};
use reduction::SelfOrganisingMap;
use serde::{Deserialize, Serialize};

use super::{Assessment, Bundle, MapChain, Provenance};
use crate::{LoadModel, Metrics};

/// The fields in the order of the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BundleFile {
    format: u32,
    provenance: Provenance,
    faults: FaultModel,
    #[serde(skip_serializing_if = "Option::is_none")]
    motor: Option<Motor>,
    #[serde(skip_serializing_if = "Option::is_none")]
    masks: Option<Vec<Mask>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    self_organising_map: Option<SelfOrganisingMap>,
    #[serde(skip_serializing_if = "Option::is_none")]
    with_load_ratio: Option<Diagnoser>,
    #[serde(skip_serializing_if = "Option::is_none")]
    without_load_ratio: Option<Diagnoser>,
    #[serde(skip_serializing_if = "Option::is_none")]
    surrogate: Option<Surrogate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measure: Option<FaultMeasure>,
    #[serde(skip_serializing_if = "Option::is_none")]
    loads: Option<LoadModel>,
    prior: LifePrior,
    #[serde(skip_serializing_if = "Option::is_none")]
    metrics: Option<Metrics>,
}

/// A file that is no whole bundle of either kind.
#[derive(Debug, thiserror::Error)]
pub enum Half {
    /// A part of a bundle of maps is missing.
    #[error(
        "missing field `{0}`: a bundle has all parts that read maps, or else `measure` for faults of an own diagnosis"
    )]
    Missing(&'static str),
    /// A part of each kind.
    #[error("both `measure` and `{0}`: a bundle reads maps or takes faults of an own diagnosis, not both")]
    Both(&'static str),
}

impl BundleFile {
    /// The first part that only a bundle of maps has.
    fn part_of_maps(&self) -> Option<&'static str> {
        let parts = [
            ("motor", self.motor.is_some()),
            ("masks", self.masks.is_some()),
            ("self_organising_map", self.self_organising_map.is_some()),
            ("with_load_ratio", self.with_load_ratio.is_some()),
            ("without_load_ratio", self.without_load_ratio.is_some()),
            ("surrogate", self.surrogate.is_some()),
            ("metrics", self.metrics.is_some()),
        ];
        parts.into_iter().find_map(|(name, is_there)| is_there.then_some(name))
    }
}

impl TryFrom<BundleFile> for Bundle {
    type Error = Half;

    fn try_from(file: BundleFile) -> Result<Self, Half> {
        let part_of_maps = file.part_of_maps();
        let assessment = match (file.measure, part_of_maps) {
            (Some(_), Some(part)) => return Err(Half::Both(part)),
            (Some(measure), None) => Assessment::Own(measure),
            (None, _) => Assessment::Maps(Box::new(MapChain {
                motor: there("motor", file.motor)?,
                masks: there("masks", file.masks)?,
                self_organising_map: file.self_organising_map,
                with_load_ratio: there("with_load_ratio", file.with_load_ratio)?,
                without_load_ratio: there("without_load_ratio", file.without_load_ratio)?,
                surrogate: there("surrogate", file.surrogate)?,
                metrics: there("metrics", file.metrics)?,
            })),
        };
        let BundleFile { format, provenance, faults, loads, prior, .. } = file;
        Ok(Self { format, provenance, faults, assessment, loads, prior })
    }
}

fn there<T>(name: &'static str, part: Option<T>) -> Result<T, Half> {
    part.ok_or(Half::Missing(name))
}

impl From<Bundle> for BundleFile {
    fn from(Bundle { format, provenance, faults, assessment, loads, prior }: Bundle) -> Self {
        let (maps, measure) = match assessment {
            Assessment::Maps(maps) => (Some(*maps), None),
            Assessment::Own(measure) => (None, Some(measure)),
        };
        let mut file = Self {
            format,
            provenance,
            faults,
            motor: None,
            masks: None,
            self_organising_map: None,
            with_load_ratio: None,
            without_load_ratio: None,
            surrogate: None,
            measure,
            loads,
            prior,
            metrics: None,
        };
        if let Some(maps) = maps {
            file.motor = Some(maps.motor);
            file.masks = Some(maps.masks);
            file.self_organising_map = maps.self_organising_map;
            file.with_load_ratio = Some(maps.with_load_ratio);
            file.without_load_ratio = Some(maps.without_load_ratio);
            file.surrogate = Some(maps.surrogate);
            file.metrics = Some(maps.metrics);
        }
        file
    }
}
