//! From one upload to its estimate.

use diagnosis::Measurement;
use domain::{
    ContentHash, Diagnosis, Estimate, HingeLoad, Invalid, MapSamples, Mask, NUMERICS_VERSION, Outcome, Reading,
    SensorConfiguration, Upload,
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
    #[error("samples: the bundle reads no maps, it takes own diagnoses")]
    NoMaps,
    /// Its own diagnosis is of other faults than the bundle's, or such as they cannot be.
    #[error("own diagnosis: {0}")]
    Faults(Invalid),
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
    /// What `upload` says about the health of its actuator and, read by the tail's own sensor configuration or by the
    /// bundle's, about its load. Its samples were taken at `mask` and checked against it; an own diagnosis needs none.
    ///
    /// # Panics
    /// If it has samples and there is no mask.
    pub fn estimate(
        &self,
        upload: &Upload,
        mask: Option<&Mask>,
        sensors: Option<&SensorConfiguration>,
    ) -> Result<Estimate, EstimateError> {
        let (outcome, measurement) = match &upload.reading {
            Reading::Samples(reading) => {
                let mask = mask.expect("samples come with their mask");
                (self.of_samples(reading, mask)?, ContentHash::of_json(&reading.samples))
            }
            Reading::Own { faults } => {
                let diagnosis = faults.diagnosis(&self.summary()).map_err(EstimateError::Faults)?;
                (Outcome::Diagnosed(diagnosis), ContentHash::of_json(faults))
            }
        };
        Ok(Estimate {
            upload_id: upload.upload_id.clone(),
            flight_hours: upload.flight_hours,
            recorded_at: upload.recorded_at,
            mask_id: upload.reading.mask_id(),
            model: self.hash,
            numerics_version: NUMERICS_VERSION,
            measurement: Some(measurement),
            outcome,
            load: self.load(upload, sensors)?,
            temperature: self.temperature(upload),
            load_ratio: upload.reading.samples().and_then(|reading| reading.load_ratio.as_ref()?.mean_size()),
            on_ground: upload.on_ground == Some(true),
        })
    }

    fn of_samples(&self, reading: &MapSamples, mask: &Mask) -> Result<Outcome, EstimateError> {
        let k_nom = self.bundle.maps().ok_or(EstimateError::NoMaps)?.motor.back_emf_v_s_rad;
        let samples: Vec<_> = reading.samples.iter().map(|y| y.map(|y| y / k_nom)).collect();
        let (load_ratio, noise) = (reading.load_ratio.as_ref(), reading.sample_noise);
        self.diagnose(&Measurement { samples: &samples, load_ratio, noise }, mask)
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
    let chi_square = diagnosis.fit.iter().map(|fit| ("the chi-square of the residual", fit.chi_square));
    match faults.chain(sigmas).chain(chi_square).find(|(_, value)| !value.is_finite()) {
        None => Ok(()),
        Some((what, value)) => Err(EstimateError::NotFinite { what: what.to_owned(), value }),
    }
}
