//! Uploads as an aircraft would send them, of maps of known faults.

use domain::{LoadRatio, Mask};
use numerics::Stream;
use serde::{Deserialize, Serialize};

use crate::{Measurement, TrainingMap};

/// The load as far as a diagnosis is told of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LoadInput {
    /// The load ratio at every sample.
    PerSample,
    /// The mean of the map.
    Mean,
    /// Nothing.
    None,
}

/// What an aircraft would send of a map.
pub(crate) struct SimulatedUpload {
    pub samples: Vec<Option<f64>>,
    pub load_ratio: Option<LoadRatio>,
    pub noise: f64,
}

impl SimulatedUpload {
    /// Samples of `map` at `mask` with independent noise.
    pub fn new(map: &TrainingMap, mask: &Mask, load: LoadInput, noise: f64, stream: &mut Stream) -> Self {
        let at_mask = |values: &[f64]| mask.bins().iter().map(|bin| Some(values[*bin])).collect();
        let samples = mask.bins().iter().map(|bin| Some(map.y[*bin] + noise * stream.normal())).collect();
        let load_ratio = match load {
            LoadInput::PerSample => Some(LoadRatio::PerSample(at_mask(&map.r))),
            LoadInput::Mean => Some(LoadRatio::Mean(map.mean_r)),
            LoadInput::None => None,
        };
        Self { samples, load_ratio, noise }
    }

    /// The measurement as a diagnoser takes it.
    pub fn measurement(&self) -> Measurement<'_> {
        Measurement { samples: &self.samples, load_ratio: self.load_ratio.as_ref(), noise: Some(self.noise) }
    }
}
