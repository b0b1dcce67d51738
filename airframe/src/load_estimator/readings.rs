//! From wavelengths to strain and its noise.

use domain::{
    Strain, Timestamp,
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};

use super::{LoadEstimator, Vector};
use crate::{
    fbg::{self, Sensitivity},
    glue,
};

/// Compensated strain of every grating, and what its noise is.
pub(super) struct Readings {
    /// Strain; `None` where the grating or its station's free grating has no peak in its window.
    pub strain: [Option<f64>; STRAIN_SENSORS],
    /// Variance of each grating's own noise.
    own: Vector,
    /// Variance that the gratings of a station share: that of its temperature.
    shared: [f64; TEMPERATURE_SENSORS],
    station: [usize; STRAIN_SENSORS],
}

impl Readings {
    /// Reads all gratings. `expected` is the strain that the air data let expect; the gain noise of a
    /// grating is taken of the mean of what it shows and what is expected, because of its reading alone
    /// a dead grating would gain weight.
    pub fn new(
        estimator: &LoadEstimator,
        strain: &Strain,
        recorded_at: Option<Timestamp>,
        expected: Option<&Vector>,
    ) -> Self {
        let LoadEstimator { configuration, settings, .. } = estimator;
        let response = Sensitivity::BONDED_ON_ALUMINIUM;
        let peak = |peaks: &[Option<f64>], i: usize, reference_nm: f64| {
            let found_nm = peaks.get(i).copied().flatten()?;
            ((found_nm - reference_nm).abs() <= settings.peak_window_nm).then_some(found_nm)
        };
        let mut rise_k = [None; TEMPERATURE_SENSORS];
        let mut shared = [0.0; TEMPERATURE_SENSORS];
        for (s, reference_nm) in configuration.temperature_wavelengths_nm.iter().enumerate() {
            let peak_nm = peak(&strain.temperature_wavelengths_nm, s, *reference_nm);
            rise_k[s] = peak_nm.map(|peak_nm| fbg::temperature_rise_k(*reference_nm, peak_nm));
            let peak_k = settings.peak_sigma_nm / (Sensitivity::FREE.temperature_per_k * reference_nm);
            let variance_k2 = square(settings.station_temperature_sigma_k) + square(peak_k);
            shared[s] = square(response.temperature_per_k / response.strain) * variance_k2;
        }
        let mut readings = Self { strain: [None; _], own: [0.0; _], shared, station: [0; _] };
        for (i, grating) in configuration.strain_gratings.iter().enumerate() {
            let peak_nm = peak(&strain.wavelengths_nm, i, grating.wavelength_nm);
            readings.station[i] = grating.station;
            let (Some(peak_nm), Some(rise_k)) = (peak_nm, rise_k[grating.station]) else { continue };
            let shown = fbg::strain(grating.wavelength_nm, peak_nm, rise_k) - grating.tare;
            let size = expected.map_or(shown.abs(), |expected| 0.5 * (shown.abs() + expected[i].abs()));
            readings.strain[i] = Some(shown);
            readings.own[i] = square(configuration.gain_noise * size)
                + square(settings.peak_sigma_nm / (response.strain * grating.wavelength_nm))
                + square(settings.strain_floor)
                + square(glue::quarantine_sigma(grating.bonded_at, recorded_at));
        }
        readings
    }

    /// R_ij.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let own = if i == j { self.own[i] } else { 0.0 };
        let shared = if self.station[i] == self.station[j] { self.shared[self.station[i]] } else { 0.0 };
        own + shared
    }
}

fn square(x: f64) -> f64 {
    x * x
}
