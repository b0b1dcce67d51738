//! What is known of the flight-condition products before the strain is looked at.

use domain::{
    AirData, Invalid,
    sensor_configuration::{Effectiveness, FLIGHT_PRODUCTS},
};
use serde::{Deserialize, Serialize};

use super::EstimatorSettings;
use crate::products::{Products, flight_products, is_of_air};

/// Covariance of products.
pub type Covariance = [Products; FLIGHT_PRODUCTS];

/// Mean and covariance of z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean.
    pub mean: Products,
    /// Covariance.
    pub covariance: Covariance,
}

impl Prior {
    /// What the air data say. The errors of the products are taken as independent; `None` where the air
    /// data are not numbers, or of no air.
    pub fn from_air_data(air: &AirData, effectiveness: Effectiveness, settings: &EstimatorSettings) -> Option<Self> {
        if !is_of_air(air) {
            return None;
        }
        let measured = flight_products(air);
        let [q, q_alpha, _, q_flap, q_aileron] = measured;
        let deflection =
            |product: f64| square(settings.effectiveness_sigma * product) + square(settings.deflection_sigma_rad * q);
        let relative = settings.dynamic_pressure_relative_sigma;
        let variance = [
            square(relative * q),
            square(settings.angle_of_attack_sigma_rad * q) + square(relative * q_alpha),
            square(settings.roll_sigma_rad_m * q),
            deflection(q_flap),
            deflection(q_aileron),
        ];
        let mut mean = measured;
        mean[3] *= effectiveness.flap;
        mean[4] *= effectiveness.aileron;
        let mut covariance = [[0.0; FLIGHT_PRODUCTS]; FLIGHT_PRODUCTS];
        for (i, variance) in variance.into_iter().enumerate() {
            covariance[i][i] = variance;
        }
        (mean.iter().chain(&variance).all(|x| x.is_finite())).then_some(Self { mean, covariance })
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// The flight conditions that a fleet meets: mean and full covariance of z over training cases. It
/// stands in for the air data of an upload that carries none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightEnvelope {
    /// Mean of z.
    pub mean: Products,
    /// Covariance of z.
    pub covariance: Covariance,
}

impl FlightEnvelope {
    /// Mean and sample covariance of the products of cases; `None` for fewer than two.
    pub fn from_cases(cases: &[Products]) -> Option<Self> {
        if cases.len() < 2 {
            return None;
        }
        let n = cases.len() as f64;
        let mean: Products = std::array::from_fn(|i| cases.iter().map(|z| z[i]).sum::<f64>() / n);
        let covariance = std::array::from_fn(|i| {
            std::array::from_fn(|j| cases.iter().map(|z| (z[i] - mean[i]) * (z[j] - mean[j])).sum::<f64>() / (n - 1.0))
        });
        Some(Self { mean, covariance })
    }

    /// Checks that it is a mean and a covariance; pointers are relative to the envelope.
    pub fn check(&self) -> Result<(), Invalid> {
        let mut invalid = Invalid::default();
        for (i, mean) in self.mean.iter().enumerate().filter(|(_, mean)| !mean.is_finite()) {
            invalid.push(format!("#/mean/{i}"), format!("{mean} is not finite"));
        }
        for (i, row) in self.covariance.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let symmetric = (value - self.covariance[j][i]).abs() <= 1e-9 * value.abs();
                if !value.is_finite() || !symmetric || (i == j && *value < 0.0) {
                    invalid.push(format!("#/covariance/{i}/{j}"), format!("{value} does not fit a covariance"));
                }
            }
        }
        invalid.into_result(Some(()))
    }

    pub(super) fn prior(&self) -> Prior {
        Prior { mean: self.mean, covariance: self.covariance }
    }
}
