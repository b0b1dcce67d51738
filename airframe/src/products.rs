//! The flight-condition products z = [q, q alpha, q p/V, q delta_f, q delta_a], in which strain and
//! hinge moment are linear (a flight condition itself cannot be had from them by eq. 4.13 of Berri 2021).
//!
//! Plain loops in a fixed order, so that online users get the same bits on any machine.

use domain::{
    AirData,
    sensor_configuration::{FLIGHT_PRODUCTS, Side},
};

/// Flight-condition products z of the right wing: Pa, Pa rad, Pa/m, Pa rad, Pa rad.
pub type Products = [f64; FLIGHT_PRODUCTS];

/// Air density at sea level, kg/m^3.
pub const SEA_LEVEL_DENSITY_KG_M3: f64 = 1.225;

/// Densities that air has where aircraft fly, kg/m^3, with 10 % of error in the airspeed.
const DENSITIES_KG_M3: std::ops::RangeInclusive<f64> = 0.05..=2.0;
/// The dynamic pressure below which, by either figure, errors of the instruments are as large as what they measure, Pa.
const SMALL_PRESSURE_PA: f64 = 100.0;

/// Whether dynamic pressure and airspeed, where both are given, are of one air: q = rho V^2/2.
pub fn is_of_air(air_data: &AirData) -> bool {
    let AirData { dynamic_pressure_pa: q, airspeed_m_s: v, .. } = *air_data;
    let at_sea_level_pa = 0.5 * SEA_LEVEL_DENSITY_KG_M3 * v * v;
    v <= 0.0 || q.max(at_sea_level_pa) <= SMALL_PRESSURE_PA || DENSITIES_KG_M3.contains(&(2.0 * q / (v * v)))
}

/// Airspeed of a dynamic pressure at sea level, m/s: V = sqrt(2 q/rho).
pub fn sea_level_airspeed_m_s(dynamic_pressure_pa: f64) -> f64 {
    libm::sqrt(2.0 * dynamic_pressure_pa.max(0.0) / SEA_LEVEL_DENSITY_KG_M3)
}

/// z of a flight condition. Without airspeed it is taken from the dynamic pressure; without either
/// nothing rolls against the air.
pub fn flight_products(air_data: &AirData) -> Products {
    let q = air_data.dynamic_pressure_pa;
    let airspeed_m_s = if air_data.airspeed_m_s > 0.0 { air_data.airspeed_m_s } else { sea_level_airspeed_m_s(q) };
    let roll = if airspeed_m_s > 0.0 { air_data.roll_rate_rad_s / airspeed_m_s } else { 0.0 };
    [q, q * air_data.angle_of_attack_rad, q * roll, q * air_data.flap_rad, q * air_data.aileron_rad]
}

/// z as the wing of this side feels it: to the left one, roll and ailerons are the other way round.
pub fn felt_by(side: Side, [q, q_alpha, q_roll, q_flap, q_aileron]: Products) -> Products {
    match side {
        Side::Right => [q, q_alpha, q_roll, q_flap, q_aileron],
        Side::Left => [q, q_alpha, -q_roll, q_flap, -q_aileron],
    }
}

/// One row of A_z or C_z times z.
pub fn response(row: &Products, products: &Products) -> f64 {
    row.iter().zip(products).fold(0.0, |sum, (factor, z)| sum + factor * z)
}
