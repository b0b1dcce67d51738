//! From one upload to its estimate.

use diagnosis::Measurement;
use domain::{
    ContentHash, Diagnosis, Estimate, HingeLoad, Invalid, Mask, NUMERICS_VERSION, Outcome, SensorConfiguration, Upload,
};
use reduction::ReductionError;

use crate::Model;

/// Why an upload has no estimate: a reason to set it aside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// The mask belongs to another kind of map.
    #[error("mask: {0}")]
    Mask(#[from] ReductionError),
    /// Samples for a bundle that reads none.
    #[error("the model reads no samples: its uploads bring faults of their own")]
    NoMaps,
    /// The tail's sensor configuration cannot be used.
    #[error("sensor configuration: {0}")]
    Sensors(#[from] Invalid),
    /// An intermediate was not finite.
    #[error("{what} is {value}")]
    NotFinite {
        /// Which figure.
        what: String,
        /// Its value.
        value: f64,
    },
}

impl Model {
    /// What `upload`, sampled at `mask` and checked against it, says about the health of its actuator
    /// and, read by the tail's own sensor configuration or by the bundle's, about its load.
    pub fn estimate(
        &self,
        upload: &Upload,
        mask: &Mask,
        sensors: Option<&SensorConfiguration>,
    ) -> Result<Estimate, EstimateError> {
        let k_nom = self.bundle.maps().ok_or(EstimateError::NoMaps)?.motor.back_emf_v_s_rad;
        let samples: Vec<_> = upload.samples.iter().map(|y| y.map(|y| y / k_nom)).collect();
        let measurement =
            Measurement { samples: &samples, load_ratio: upload.load_ratio.as_ref(), noise: upload.sample_noise };
        let outcome = self.diagnose(&measurement, mask)?;
        Ok(Estimate {
            upload_id: upload.upload_id.clone(),
            flight_hours: upload.flight_hours,
            recorded_at: upload.recorded_at,
            mask_id: upload.mask_id,
            model: self.hash,
            numerics_version: NUMERICS_VERSION,
            measurement: Some(ContentHash::of_json(&upload.samples)),
            outcome,
            load: self.load(upload, sensors)?,
            temperature: self.temperature(upload),
        })
    }

    /// What samples at the points of `mask` say about the faults.
    ///
    /// # Panics
    /// If samples or load ratios are not as many as the mask's points.
    pub fn diagnose(&self, measurement: &Measurement, mask: &Mask) -> Result<Outcome, EstimateError> {
        let maps = self.bundle.maps().ok_or(EstimateError::NoMaps)?;
        let factors = self.factors(maps, mask)?;
        let outcome = match measurement.load_ratio {
            Some(_) => maps.with_load_ratio.diagnose(&factors.with_load_ratio, measurement),
            None => maps.without_load_ratio.diagnose(&factors.without_load_ratio, measurement),
        };
        if let Outcome::Diagnosed(diagnosis) = &outcome {
            check_finite(diagnosis)?;
        }
        Ok(outcome)
    }

    fn load(&self, upload: &Upload, sensors: Option<&SensorConfiguration>) -> Result<Option<HingeLoad>, EstimateError> {
        let (Some(loads), Some(own)) = (&self.bundle.loads, &self.load_estimator) else { return Ok(None) };
        Ok(match sensors {
            None => loads.load(own, upload),
            Some(_) => loads.load(&loads.estimator(sensors)?, upload),
        })
    }

    fn temperature(&self, upload: &Upload) -> Option<f64> {
        Some(self.bundle.loads.as_ref()?.temperature(upload.temperature_c?))
    }
}

fn check_finite(diagnosis: &Diagnosis) -> Result<(), EstimateError> {
    let faults = diagnosis.fault_vector.values().iter().map(|value| ("a fault", *value));
    let sigmas = diagnosis.sigma.iter().map(|value| ("the sigma of a fault", *value));
    let chi_square = [("the chi-square of the residual", diagnosis.chi_square)];
    match faults.chain(sigmas).chain(chi_square).find(|(_, value)| !value.is_finite()) {
        None => Ok(()),
        Some((what, value)) => Err(EstimateError::NotFinite { what: what.to_owned(), value }),
    }
}
