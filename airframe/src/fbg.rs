//! Fibre Bragg gratings: wavelength from strain and temperature, and back.
//!
//! A grating reflects at lambda = lambda_0 (1 + C_eps eps + C_T dT), with dT the temperature rise
//! above that of lambda_0 and eps the mechanical strain of what it is bonded to. Bonded to a
//! substrate it is stretched by the substrate's expansion too, so its C_T differs from a free
//! grating's. Source: Berri 2021, section 4.2.1 (eq. 4.17, 4.19, 4.23), with eq. 4.21 corrected: the
//! printed coefficient of the bonded fibre, alpha_m + zeta_f, leaves out that strain by the substrate
//! acts through C_eps too, and overcompensates by 63 microstrain per 10 K.
//!
//! | 1 pm at 1550 nm is | |
//! |---|---|
//! | strain | 0.827 microstrain |
//! | temperature, free | 0.097 K |
//! | temperature, bonded on aluminium | 0.027 K |

/// Effective photoelastic coefficient p_e of silica fibre, dimensionless: usual value, for Berri 2021, eq. 4.18.
pub const PHOTOELASTIC_COEFFICIENT: f64 = 0.22;
/// Thermal expansion alpha_f of silica fibre, 1/K: usual value, for Berri 2021, eq. 4.17.
pub const FIBRE_EXPANSION_PER_K: f64 = 0.55e-6;
/// Thermo-optic coefficient zeta_f of silica fibre, 1/K: usual value, for Berri 2021, eq. 4.17.
pub const THERMO_OPTIC_PER_K: f64 = 6.1e-6;
/// Thermal expansion alpha_m of aluminium, 1/K: usual value, for Berri 2021, eq. 4.21.
pub const ALUMINIUM_EXPANSION_PER_K: f64 = 23e-6;
/// Condition number, columns scaled to unit norm, above which two gratings do not tell strain from
/// temperature: their noise would exceed that of a grating with an isolated one several times.
pub const MAX_CONDITION_NUMBER: f64 = 9.0;

/// How a grating responds: relative change of wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// C_eps, per unit of strain.
    pub strain: f64,
    /// C_T, 1/K.
    pub temperature_per_k: f64,
}

impl Sensitivity {
    /// A grating that nothing strains but its own expansion: C_T = alpha_f + zeta_f = 6.65e-6 /K.
    pub const FREE: Self =
        Self { strain: 1.0 - PHOTOELASTIC_COEFFICIENT, temperature_per_k: FIBRE_EXPANSION_PER_K + THERMO_OPTIC_PER_K };

    /// A grating bonded on aluminium: C_T = C_eps (alpha_m - alpha_f) + alpha_f + zeta_f = 24.161e-6 /K
    /// (Berri 2021, eq. 4.21, corrected).
    pub const BONDED_ON_ALUMINIUM: Self = Self {
        strain: Self::FREE.strain,
        temperature_per_k: Self::FREE.strain * (ALUMINIUM_EXPANSION_PER_K - FIBRE_EXPANSION_PER_K)
            + Self::FREE.temperature_per_k,
    };
}

/// Wavelength, nm, of a grating bonded on aluminium: lambda_0 (1 + 0.78 eps + 24.161e-6 dT).
pub fn wavelength_nm(reference_nm: f64, strain: f64, temperature_rise_k: f64) -> f64 {
    let response = Sensitivity::BONDED_ON_ALUMINIUM;
    reference_nm * (1.0 + response.strain * strain + response.temperature_per_k * temperature_rise_k)
}

/// Wavelength, nm, of a free grating: lambda_0 (1 + 6.65e-6 dT).
pub fn free_wavelength_nm(reference_nm: f64, temperature_rise_k: f64) -> f64 {
    reference_nm * (1.0 + Sensitivity::FREE.temperature_per_k * temperature_rise_k)
}

/// Temperature rise, K, that a free grating shows: the inverse of [`free_wavelength_nm`].
pub fn temperature_rise_k(reference_nm: f64, wavelength_nm: f64) -> f64 {
    (wavelength_nm / reference_nm - 1.0) / Sensitivity::FREE.temperature_per_k
}

/// Strain that a grating bonded on aluminium shows, its temperature rise known from the station's
/// free grating: the inverse of [`wavelength_nm`].
pub fn strain(reference_nm: f64, wavelength_nm: f64, temperature_rise_k: f64) -> f64 {
    let response = Sensitivity::BONDED_ON_ALUMINIUM;
    (wavelength_nm / reference_nm - 1.0 - response.temperature_per_k * temperature_rise_k) / response.strain
}

/// Strain and temperature at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainAndTemperature {
    /// Strain, dimensionless.
    pub strain: f64,
    /// Temperature rise above that of the reference wavelengths, K.
    pub temperature_rise_k: f64,
}

/// Two gratings respond too much alike.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "two gratings whose condition number is {condition_number:.1} (at most {MAX_CONDITION_NUMBER}) do not tell strain from temperature"
)]
pub struct Indistinguishable {
    /// Condition number of the scaled system; infinite when it is singular.
    pub condition_number: f64,
}

/// Strain and temperature from the relative shifts lambda/lambda_0 - 1 of two gratings of unlike
/// sensitivity at the same place (Berri 2021, eq. 4.24): solves
/// shift_i = C_eps,i eps + C_T,i dT with columns scaled to unit norm.
pub fn separate(shifts: [f64; 2], gratings: [Sensitivity; 2]) -> Result<StrainAndTemperature, Indistinguishable> {
    let norm = |column: [f64; 2]| libm::sqrt(column[0] * column[0] + column[1] * column[1]);
    let strain_column = gratings.map(|grating| grating.strain);
    let temperature_column = gratings.map(|grating| grating.temperature_per_k);
    let (strain_norm, temperature_norm) = (norm(strain_column), norm(temperature_column));
    let a = strain_column.map(|c| c / strain_norm);
    let b = temperature_column.map(|c| c / temperature_norm);
    // Two unit columns at an angle of cosine c have the singular values sqrt(1 +- c); the determinant,
    // the sine, is the accurate way to the smaller one.
    let cosine = (a[0] * b[0] + a[1] * b[1]).abs();
    let determinant = a[0] * b[1] - a[1] * b[0];
    let condition_number = (1.0 + cosine) / determinant.abs();
    if condition_number.is_nan() {
        return Err(Indistinguishable { condition_number: f64::INFINITY });
    }
    if condition_number > MAX_CONDITION_NUMBER {
        return Err(Indistinguishable { condition_number });
    }
    Ok(StrainAndTemperature {
        strain: (shifts[0] * b[1] - shifts[1] * b[0]) / determinant / strain_norm,
        temperature_rise_k: (a[0] * shifts[1] - a[1] * shifts[0]) / determinant / temperature_norm,
    })
}
