//! Hinge moments from the strain of the wing and the air data, fused.
//!
//! What: linear minimum-mean-square estimate of the flight-condition products z from the strain of up to
//! twelve gratings, with air data as its prior; gratings that contradict the rest are left out.
//!
//! Update rule: eps = A z + noise, z ~ (mu, P), noise ~ (0, R);
//! v = eps - A mu, S = A P A' + R, w_i = (S^-1 v)_i / sqrt((S^-1)_ii).
//! Gratings without a usable peak are left out, then that of the largest abs(w) > 4 and S is inverted
//! anew, as long as no more than two are gone. z = mu + P A' S^-1 v with covariance P - P A' S^-1 A P,
//! and M_h = C z. With v' S^-1 v of the rest above the 99.9 % quantile of chi-square the gratings contradict the
//! air data. Ten of them or more that agree with one another, in the same sense, with the envelope of flights as
//! their prior, are believed: air data are one instrument, five products cannot make that many wrong gratings
//! agree. Otherwise, and with more than two unusable ones, the air data alone answer: z = mu with P.
//! Air data whose dynamic pressure and airspeed are of no air are none.
//!
//! Requires: a checked sensor configuration. z itself is no flight condition to publish: the strain
//! tells five products at best, and with axial gratings fewer.
//!
//! Online: plain loops over fixed arrays, the same bits on any machine; no input makes it panic, and
//! it answers with finite numbers or not at all.
//!
//! Source: Berri 2021, section 4.1.3, with z in place of the flight condition (eq. 4.12 and 4.13,
//! corrected); studentised innovations as in Rousseeuw and Leroy 1987, chapter 6.

mod prior;
mod readings;
mod settings;

use domain::{
    ContentHash, HingeLoad, Invalid, LoadSource, Position, SensorConfiguration, Timestamp, Upload,
    sensor_configuration::{Side, Surface},
    upload::{AirData, STRAIN_SENSORS, Strain},
};
use numerics::{FixedCholesky, chi_square};

pub use prior::{Covariance, FlightEnvelope, Prior};
pub use settings::EstimatorSettings;

use crate::products::{Products, felt_by, response};
use readings::Readings;

/// A vector with one entry per strain grating; only the first n count.
type Vector = [f64; STRAIN_SENSORS];

/// Reads loads by one sensor configuration.
#[derive(Debug, Clone)]
pub struct LoadEstimator {
    configuration: SensorConfiguration,
    id: ContentHash,
    settings: EstimatorSettings,
    envelope: Option<FlightEnvelope>,
}

/// What a load is read from.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadReading<'a> {
    /// Wavelengths of the gratings.
    pub strain: Option<&'a Strain>,
    /// Flight condition.
    pub air_data: Option<&'a AirData>,
    /// The time of the reading; without it no grating counts as newly bonded.
    pub recorded_at: Option<Timestamp>,
}

impl<'a> From<&'a Upload> for LoadReading<'a> {
    fn from(upload: &'a Upload) -> Self {
        Self {
            strain: upload.strain.as_ref(),
            air_data: upload.air_data.as_ref(),
            recorded_at: Some(upload.recorded_at),
        }
    }
}

/// The flight-condition products of one reading and what they rest on; every number is finite.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadEstimate {
    /// z as the right wing feels it.
    pub products: Products,
    /// Its covariance.
    pub covariance: Covariance,
    /// What it rests on.
    pub source: LoadSource,
    /// Gratings that were left out, 0-based, in the order of their exclusion; those without a usable
    /// peak come first.
    pub excluded_sensors: Vec<u8>,
}

/// A hinge moment, positive as the surface's lift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HingeMoment {
    /// M_h, N m.
    pub moment_nm: f64,
    /// Its standard deviation, N m.
    pub sigma_nm: f64,
}

impl LoadEstimator {
    /// Compiles a configuration; the envelope stands in for air data where an upload has none, without
    /// it such an upload has no load.
    pub fn new(
        configuration: SensorConfiguration,
        settings: EstimatorSettings,
        envelope: Option<FlightEnvelope>,
    ) -> Result<Self, Invalid> {
        configuration.check()?;
        settings.check()?;
        envelope.as_ref().map_or(Ok(()), FlightEnvelope::check)?;
        Ok(Self { id: configuration.id(), configuration, settings, envelope })
    }

    /// The configuration it reads by.
    pub fn configuration(&self) -> &SensorConfiguration {
        &self.configuration
    }

    /// The products of a reading; `None` where it tells nothing: neither strain nor air data, or strain
    /// that is not believed and no air data to fall back to.
    pub fn estimate(&self, reading: &LoadReading) -> Option<LoadEstimate> {
        let of_air = reading
            .air_data
            .and_then(|air| Prior::from_air_data(air, self.configuration.effectiveness, &self.settings));
        let (prior, source) = match (of_air, self.envelope) {
            (Some(prior), _) => (prior, LoadSource::StrainAndAirData),
            (None, Some(envelope)) => (envelope.prior(), LoadSource::Strain),
            (None, None) => return None,
        };
        let fused = reading.strain.map(|strain| {
            let expected = of_air.map(|prior| self.strain_of(&prior.mean));
            self.fuse(&prior, &Readings::new(self, strain, reading.recorded_at, expected.as_ref()))
        });
        let (posterior, source, excluded_sensors) = match (fused, of_air) {
            (Some(Fusion { posterior: Some(posterior), excluded }), _) => (posterior, source, excluded),
            (Some(Fusion { excluded, .. }), Some(air)) => match self.agreed(reading) {
                Some(Fusion { posterior: Some(strain), excluded }) => (strain, LoadSource::Strain, excluded),
                _ => (air, LoadSource::AirData, excluded),
            },
            (None, Some(air)) => (air, LoadSource::AirData, Vec::new()),
            (_, None) => return None,
        };
        let Prior { mean, covariance } = posterior;
        Some(LoadEstimate { products: mean, covariance, source, excluded_sensors })
    }

    /// What the gratings tell without the air data that they contradict.
    fn agreed(&self, reading: &LoadReading) -> Option<Fusion> {
        let readings = Readings::new(self, reading.strain?, reading.recorded_at, None);
        Some(self.fuse(&self.envelope?.prior(), &readings))
    }

    /// Hinge moment of a surface; `None` for `Surface::None` or where it is not finite.
    pub fn hinge_moment(&self, estimate: &LoadEstimate, surface: Surface, side: Side) -> Option<HingeMoment> {
        let row = match surface {
            Surface::Flap => &self.configuration.hinge_rows.flap,
            Surface::Aileron => &self.configuration.hinge_rows.aileron,
            Surface::None => return None,
        };
        // C (D z) = (C D) z, where D turns the products round for the left wing.
        let row = felt_by(side, *row);
        let moment_nm = response(&row, &estimate.products);
        let spread: Products = std::array::from_fn(|i| response(&estimate.covariance[i], &row));
        // What rounding leaves of a variance that is zero may be below it.
        let sigma_nm = response(&row, &spread).max(0.0).sqrt();
        (moment_nm.is_finite() && sigma_nm.is_finite()).then_some(HingeMoment { moment_nm, sigma_nm })
    }

    /// Load of the actuator at a position, relative to a reference moment in N m; `None` where the
    /// position is not listed, its surface is not modelled, or the reference gives no finite ratio.
    pub fn hinge_load(
        &self,
        estimate: &LoadEstimate,
        position: &Position,
        reference_moment_nm: f64,
    ) -> Option<HingeLoad> {
        let place = self.configuration.positions.get(position)?;
        let HingeMoment { moment_nm, sigma_nm } = self.hinge_moment(estimate, place.surface, place.side)?;
        let ratio = moment_nm.abs() / reference_moment_nm;
        (ratio.is_finite() && reference_moment_nm.is_finite() && reference_moment_nm > 0.0).then(|| HingeLoad {
            hinge_moment_nm: moment_nm,
            sigma_nm,
            ratio,
            source: estimate.source,
            excluded_sensors: estimate.excluded_sensors.clone(),
            sensor_configuration: self.id,
        })
    }

    /// A z.
    fn strain_of(&self, products: &Products) -> Vector {
        let mut strain = [0.0; STRAIN_SENSORS];
        for (strain, row) in strain.iter_mut().zip(&self.configuration.strain_map) {
            *strain = response(row, products);
        }
        strain
    }

    /// Posterior of z by the gratings that agree.
    fn fuse(&self, prior: &Prior, readings: &Readings) -> Fusion {
        let mut excluded = Vec::new();
        let posterior = self.posterior(prior, readings, &mut excluded);
        Fusion { posterior, excluded }
    }

    /// The posterior, or `None` where too many gratings are excluded.
    fn posterior(&self, prior: &Prior, readings: &Readings, excluded: &mut Vec<u8>) -> Option<Prior> {
        let expected = self.strain_of(&prior.mean);
        let mut active = Vec::with_capacity(STRAIN_SENSORS);
        for (i, strain) in readings.strain.iter().enumerate() {
            match strain {
                Some(_) => active.push(i),
                None => excluded.push(i as u8),
            }
        }
        loop {
            if excluded.len() > self.settings.max_exclusions || active.is_empty() {
                return None;
            }
            let innovation = Innovation::new(self, prior, readings, &expected, &active)?;
            let worst = innovation.worst();
            if worst.studentised > self.settings.exclusion_limit && excluded.len() < self.settings.max_exclusions {
                excluded.push(active.remove(worst.place) as u8);
            } else if innovation.chi_square() > chi_square::QUANTILES_999[active.len() - 1] {
                return None;
            } else {
                return innovation.posterior(prior);
            }
        }
    }
}

/// Strain and what was expected of it.
struct Fusion {
    /// `None` where too many gratings do not agree.
    posterior: Option<Prior>,
    /// Gratings that were left out.
    excluded: Vec<u8>,
}

/// The strain of the active gratings against what the prior expects.
struct Innovation {
    n: usize,
    /// S = A P A' + R, factored.
    factor: FixedCholesky<STRAIN_SENSORS>,
    /// A P, a row per active grating.
    gain: [Products; STRAIN_SENSORS],
    /// v.
    difference: Vector,
    /// S^-1 v.
    weighted: Vector,
}

/// The grating that contradicts the others most.
struct Worst {
    /// Its place among the active ones.
    place: usize,
    /// abs(w).
    studentised: f64,
}

impl Innovation {
    fn new(
        estimator: &LoadEstimator,
        prior: &Prior,
        readings: &Readings,
        expected: &Vector,
        active: &[usize],
    ) -> Option<Self> {
        let n = active.len();
        let map = &estimator.configuration.strain_map;
        let mut gain = [[0.0; _]; STRAIN_SENSORS];
        let mut difference = [0.0; STRAIN_SENSORS];
        for (a, i) in active.iter().enumerate() {
            gain[a] = std::array::from_fn(|k| response(&map[*i], &prior.covariance[k]));
            difference[a] = readings.strain[*i]? - expected[*i];
        }
        let factor = FixedCholesky::new(n, |a, b| {
            response(&map[active[b]], &gain[a]) + readings.covariance(active[a], active[b])
        })?;
        let weighted = factor.solve(&difference);
        Some(Self { n, factor, gain, difference, weighted })
    }

    fn worst(&self) -> Worst {
        let diagonal = self.factor.inverse_diagonal();
        let mut worst = Worst { place: 0, studentised: 0.0 };
        for (place, (weighted, diagonal)) in self.weighted[..self.n].iter().zip(&diagonal).enumerate() {
            let studentised = weighted.abs() / diagonal.sqrt();
            if studentised > worst.studentised {
                worst = Worst { place, studentised };
            }
        }
        worst
    }

    /// v' S^-1 v.
    fn chi_square(&self) -> f64 {
        self.difference[..self.n].iter().zip(&self.weighted).map(|(v, w)| v * w).sum()
    }

    /// mu + P A' S^-1 v and P - P A' S^-1 A P; `None` unless all of it is finite.
    fn posterior(&self, prior: &Prior) -> Option<Prior> {
        let mut posterior = *prior;
        for k in 0..posterior.mean.len() {
            let mut column = [0.0; STRAIN_SENSORS];
            for (entry, gain) in column.iter_mut().zip(&self.gain[..self.n]) {
                *entry = gain[k];
            }
            let weights = self.factor.solve(&column);
            for (gain, weight) in self.gain[..self.n].iter().zip(&weights) {
                for (covariance, gain) in posterior.covariance[k].iter_mut().zip(gain) {
                    *covariance -= weight * gain;
                }
            }
            posterior.mean[k] += column[..self.n].iter().zip(&self.weighted).map(|(g, w)| g * w).sum::<f64>();
        }
        let finite = posterior.mean.iter().chain(posterior.covariance.iter().flatten()).all(|x| x.is_finite());
        finite.then_some(posterior)
    }
}
