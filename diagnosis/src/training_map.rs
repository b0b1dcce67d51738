//! Maps of known faults, which a training learns from and a validation judges by.

use domain::{FaultModel, FaultVector};
use numerics::Stream;
use reduction::load_invariant;

use crate::{LoadVariation, MapKind, diagnoser::fault_gains};

/// A map of known faults.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingMap {
    /// Raw back-EMF map in units of k_nom, one value per bin.
    pub y: Vec<f64>,
    /// Load ratio of each bin; the mean in every bin where no more is known.
    pub r: Vec<f64>,
    /// Mean load ratio of the map.
    pub mean_r: f64,
    /// The faults.
    pub faults: FaultVector,
}

impl TrainingMap {
    /// y' = (y + r)/(1 + r), bin by bin.
    pub fn load_invariant(&self) -> Vec<f64> {
        self.y.iter().zip(&self.r).map(|(y, r)| load_invariant::from_raw(*y, *r)).collect()
    }

    /// The values that a diagnoser of this kind reads.
    pub fn values(&self, kind: MapKind) -> Vec<f64> {
        match kind {
            MapKind::LoadInvariant => self.load_invariant(),
            MapKind::Raw => self.y.clone(),
        }
    }

    /// The same load-invariant map under another load.
    pub fn under_load(&self, variation: &LoadVariation, model: &FaultModel, stream: &mut Stream) -> Self {
        let r = variation.vary(&self.r, stream);
        let shift = (r.iter().sum::<f64>() - self.r.iter().sum::<f64>()) / r.len() as f64;
        let raw = |(y, r): (&f64, &f64)| load_invariant::to_raw(*y, *r);
        let gains = fault_gains(model, (1.0 + self.mean_r + shift) / (1.0 + self.mean_r));
        let deviation: Vec<f64> = model.deviation(&self.faults).iter().zip(gains).map(|(x, gain)| x * gain).collect();
        Self {
            y: self.load_invariant().iter().zip(&r).map(raw).collect(),
            r,
            mean_r: self.mean_r + shift,
            faults: model.from_deviation(&deviation),
        }
    }
}
