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
