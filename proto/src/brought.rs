//! What an upload brings, as either transport has it: samples with their mask, or an own diagnosis.

use domain::{Invalid, LoadRatio, MapSamples, OwnDiagnosis, Reading};

/// The fields of both; `None` where they are not given.
pub(crate) struct Brought {
    pub mask_id: Option<String>,
    pub samples: Option<Vec<Option<f64>>>,
    pub load_ratio: Option<LoadRatio>,
    pub sample_noise: Option<f64>,
    pub faults: Option<OwnDiagnosis>,
}

impl Brought {
    /// The noun, or what is missing of one or stands beside the other.
    pub(crate) fn into_reading(self, invalid: &mut Invalid) -> Option<Reading> {
        match (self.samples.is_some(), self.faults.is_some()) {
            (true, false) => self.into_samples(invalid).map(Reading::Samples),
            (false, true) => self.into_faults(invalid).map(|faults| Reading::Own { faults }),
            (true, true) => {
                invalid.push("#/faults", "given beside samples: an upload brings samples or an own diagnosis");
                None
            }
            (false, false) => {
                invalid.push("#/samples", "missing: an upload brings samples, or an own diagnosis as `faults`");
                None
            }
        }
    }

    fn into_samples(self, invalid: &mut Invalid) -> Option<MapSamples> {
        let Some(mask_id) = self.mask_id else {
            invalid.push("#/mask_id", "missing: samples are read by the mask by which they were taken");
            return None;
        };
        let mask_id = invalid.check("#/mask_id", mask_id.parse());
        let Self { samples, load_ratio, sample_noise, .. } = self;
        Some(MapSamples { mask_id: mask_id?, samples: samples?, load_ratio, sample_noise })
    }

    fn into_faults(self, invalid: &mut Invalid) -> Option<OwnDiagnosis> {
        let of_samples = [
            ("#/mask_id", self.mask_id.is_some()),
            ("#/load_ratio", self.load_ratio.is_some()),
            ("#/sample_noise", self.sample_noise.is_some()),
        ];
        for (pointer, _) in of_samples.into_iter().filter(|(_, given)| *given) {
            invalid.push(pointer, "given beside an own diagnosis: it belongs to samples");
        }
        self.faults
    }
}
