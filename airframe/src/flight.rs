//! Random flights of an instrumented wing: the truth, and what the aircraft sends of it.
//!
//! - What: draws a steady flight condition, the loads and strains that follow from it, and the readings
//!   of air data and gratings with their errors.
//! - The truth is the linear model of a [`SensorConfiguration`]: strain A_z z plus tares, hinge moments
//!   C_z z, with z the flight-condition products in the real air (gust included) under surfaces of real
//!   effectiveness. The aircraft measures neither gust nor effectiveness.
//! - A draw depends on its stream alone: each kind of chance has a substream, so that flights of the
//!   same stream under other settings stay comparable. Bit-reproducible on any x86-64.

use std::f64::consts::PI;

use domain::{
    AirData, SensorConfiguration, Strain,
    sensor_configuration::{Effectiveness, HingePosition, HingeRows, Side, Surface},
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};
use numerics::Stream;

use crate::{
    fbg,
    products::{Products, SEA_LEVEL_DENSITY_KG_M3, felt_by, flight_products, response, sea_level_airspeed_m_s},
    strain::strains,
};

const DEGREE: f64 = PI / 180.0;
/// Airspeeds flown, m/s.
const AIRSPEED_M_S: [f64; 2] = [30.0, 60.0];
/// Angles of attack flown, rad.
const ANGLE_OF_ATTACK_RAD: [f64; 2] = [-2.0 * DEGREE, 8.0 * DEGREE];
/// Roll rates flown, rad/s.
const ROLL_RATE_RAD_S: [f64; 2] = [-0.6, 0.6];
/// Deflections of the flaps, rad.
const FLAP_RAD: [f64; 2] = [0.0, 20.0 * DEGREE];
/// Deflections of the ailerons, rad.
const AILERON_RAD: [f64; 2] = [-15.0 * DEGREE, 15.0 * DEGREE];

/// Standard errors of the air data.
const DYNAMIC_PRESSURE_RELATIVE_ERROR: f64 = 0.01;
const ANGLE_OF_ATTACK_ERROR_RAD: f64 = 0.3 * DEGREE;
const ROLL_RATE_ERROR_RAD_S: f64 = 0.005;
const DEFLECTION_ERROR_RAD: f64 = 0.2 * DEGREE;
/// Standard deviation of the free grating's temperature about that of its station's bonded ones, K.
const GRATING_TEMPERATURE_ERROR_K: f64 = 0.3;
/// Standard error of a wavelength, nm.
const WAVELENGTH_ERROR_NM: f64 = 1e-3;
/// Offset of a grating that has failed to a bias, either sign.
const FAILED_BIAS: f64 = 200e-6;

/// How far flights depart from the model, and readings from the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightSettings {
    /// Standard deviation of the surfaces' effectiveness from flight to flight, relative.
    pub effectiveness_sd: f64,
    /// Standard deviation of the angle of attack that gusts add, rad; the vane does not show it.
    pub gust_sd_rad: f64,
    /// Relative gain noise of a strain reading.
    pub gain_noise: f64,
    /// Least and greatest temperature rise of a flight over that of the reference wavelengths, K.
    pub temperature_rise_k: [f64; 2],
    /// Standard deviation of the stations about the flight's temperature, K.
    pub station_temperature_sd_k: f64,
    /// Probability that one strain grating has failed.
    pub failure_probability: f64,
}

impl FlightSettings {
    /// The air and the surfaces are as modelled, and every grating works.
    pub fn as_modelled() -> Self {
        Self {
            effectiveness_sd: 0.0,
            gust_sd_rad: 0.0,
            gain_noise: 0.01,
            temperature_rise_k: [-40.0, 20.0],
            station_temperature_sd_k: 1.0,
            failure_probability: 0.0,
        }
    }

    /// Surfaces 15 % off, gusts of a degree, wide temperatures, and a failed grating in 30 % of flights.
    pub fn hard() -> Self {
        Self {
            effectiveness_sd: 0.15,
            gust_sd_rad: DEGREE,
            gain_noise: 0.02,
            temperature_rise_k: [-60.0, 25.0],
            station_temperature_sd_k: 2.0,
            failure_probability: 0.3,
        }
    }
}

/// A hinge moment that a flight is to have, by the deflection of that surface and, where this does not
/// suffice, by airspeed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HingeTarget {
    /// The hinge.
    pub position: HingePosition,
    /// Size of the moment, N m. What cannot be flown is approached as far as it goes.
    pub size_nm: f64,
}

/// How a strain grating has failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GratingFailure {
    /// It shows no load.
    Dead,
    /// It has come off in part and shows half of the strain.
    Debonded,
    /// It is off by 200 microstrain.
    Biased,
}

/// Hinge moments of one wing, N m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HingeMoments {
    /// The moment of the flap, M_f.
    pub flap_nm: f64,
    /// The moment of the aileron, M_a.
    pub aileron_nm: f64,
}

/// A flight: the truth and what is sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// True flight-condition products of the right wing, gust and effectiveness included.
    pub products: Products,
    /// True strains without tares.
    pub strains: [f64; STRAIN_SENSORS],
    /// True hinge moments of the right wing.
    pub right: HingeMoments,
    /// True hinge moments of the left wing.
    pub left: HingeMoments,
    /// True temperature rise of the bonded gratings at each station, K.
    pub temperature_rises_k: [f64; TEMPERATURE_SENSORS],
    /// Which strain grating has failed, and how.
    pub failure: Option<(usize, GratingFailure)>,
    /// What the aircraft sends of the flight condition.
    pub air_data: AirData,
    /// What it sends of the gratings.
    pub strain: Strain,
}

/// The substreams of a flight, one per kind of chance.
#[derive(Clone, Copy)]
enum Chance {
    Condition,
    Target,
    Mismatch,
    AirData,
    Temperature,
    Reading,
    Failure,
}

impl Flight {
    /// Draws a flight of a wing that is as `configuration` says, gratings, tares and mean effectiveness
    /// of its surfaces included. With a target the deflection of that surface is not drawn.
    ///
    /// # Panics
    /// If the configuration does not have 12 strain gratings at 4 stations.
    pub fn draw(
        configuration: &SensorConfiguration,
        settings: &FlightSettings,
        target: Option<&HingeTarget>,
        stream: &Stream,
    ) -> Self {
        let chance = |chance: Chance| stream.substream(chance as u64);
        let mut condition = draw_condition(&mut chance(Chance::Condition));
        let mismatch = Mismatch::draw(configuration.effectiveness, settings, &mut chance(Chance::Mismatch));
        if let Some(target) = target {
            let down = chance(Chance::Target).uniform() < 0.5;
            mismatch.aim(&mut condition, &configuration.hinge_rows, target, down);
        }
        let products = mismatch.products(&condition);
        let strains = strains(&configuration.strain_map, &products);
        let temperatures = draw_temperatures(settings, &mut chance(Chance::Temperature));
        let failed = draw_failure(settings, &mut chance(Chance::Failure));
        let readings = Readings {
            configuration,
            settings,
            strains: &strains,
            temperatures: &temperatures,
            failed: failed.as_ref(),
        };
        Self {
            products,
            strains,
            right: hinge_moments(&configuration.hinge_rows, &felt_by(Side::Right, products)),
            left: hinge_moments(&configuration.hinge_rows, &felt_by(Side::Left, products)),
            air_data: measure(&condition, &mut chance(Chance::AirData)),
            strain: readings.draw(&mut chance(Chance::Reading)),
            temperature_rises_k: temperatures.bonded_k,
            failure: failed.map(|failed| (failed.grating, failed.failure)),
        }
    }

    /// True hinge moment at a position, N m; none where it is not modelled.
    pub fn hinge_moment_nm(&self, position: HingePosition) -> Option<f64> {
        let wing = match position.side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        };
        match position.surface {
            Surface::Flap => Some(wing.flap_nm),
            Surface::Aileron => Some(wing.aileron_nm),
            Surface::None => None,
        }
    }
}

fn hinge_moments(rows: &HingeRows, products: &Products) -> HingeMoments {
    HingeMoments { flap_nm: response(&rows.flap, products), aileron_nm: response(&rows.aileron, products) }
}

fn between([least, greatest]: [f64; 2], stream: &mut Stream) -> f64 {
    least + (greatest - least) * stream.uniform()
}

fn dynamic_pressure_pa(airspeed_m_s: f64) -> f64 {
    0.5 * SEA_LEVEL_DENSITY_KG_M3 * airspeed_m_s * airspeed_m_s
}

/// A true flight condition in still air.
fn draw_condition(stream: &mut Stream) -> AirData {
    let airspeed_m_s = between(AIRSPEED_M_S, stream);
    AirData {
        dynamic_pressure_pa: dynamic_pressure_pa(airspeed_m_s),
        airspeed_m_s,
        angle_of_attack_rad: between(ANGLE_OF_ATTACK_RAD, stream),
        roll_rate_rad_s: between(ROLL_RATE_RAD_S, stream),
        flap_rad: between(FLAP_RAD, stream),
        aileron_rad: between(AILERON_RAD, stream),
    }
}

/// What the aircraft measures of it.
fn measure(condition: &AirData, stream: &mut Stream) -> AirData {
    let q = condition.dynamic_pressure_pa * (1.0 + DYNAMIC_PRESSURE_RELATIVE_ERROR * stream.normal());
    let mut with_error = |value: f64, sd: f64| value + sd * stream.normal();
    AirData {
        dynamic_pressure_pa: q,
        airspeed_m_s: sea_level_airspeed_m_s(q),
        angle_of_attack_rad: with_error(condition.angle_of_attack_rad, ANGLE_OF_ATTACK_ERROR_RAD),
        roll_rate_rad_s: with_error(condition.roll_rate_rad_s, ROLL_RATE_ERROR_RAD_S),
        flap_rad: with_error(condition.flap_rad, DEFLECTION_ERROR_RAD),
        aileron_rad: with_error(condition.aileron_rad, DEFLECTION_ERROR_RAD),
    }
}

/// How this flight departs from the model.
struct Mismatch {
    gust_rad: f64,
    effectiveness: Effectiveness,
}

impl Mismatch {
    fn draw(mean: Effectiveness, settings: &FlightSettings, stream: &mut Stream) -> Self {
        let gust_rad = settings.gust_sd_rad * stream.normal();
        let mut factor = |mean: f64| mean * (1.0 + settings.effectiveness_sd * stream.normal());
        Self { gust_rad, effectiveness: Effectiveness { flap: factor(mean.flap), aileron: factor(mean.aileron) } }
    }

    /// z in the real air, under surfaces of real effectiveness.
    fn products(&self, condition: &AirData) -> Products {
        flight_products(&AirData {
            angle_of_attack_rad: condition.angle_of_attack_rad + self.gust_rad,
            flap_rad: self.effectiveness.flap * condition.flap_rad,
            aileron_rad: self.effectiveness.aileron * condition.aileron_rad,
            ..condition.clone()
        })
    }

    /// Deflects the target's surface, `down` or up if it goes both ways, for a moment of the size asked for,
    /// and flies faster if the largest deflection does not suffice.
    fn aim(&self, condition: &mut AirData, rows: &HingeRows, target: &HingeTarget, down: bool) {
        let HingePosition { surface, side } = target.position;
        let (row, [least, greatest], down) = match surface {
            Surface::Flap => (&rows.flap, FLAP_RAD, true),
            Surface::Aileron => (&rows.aileron, AILERON_RAD, down),
            Surface::None => return,
        };
        let wanted_nm = if down { target.size_nm } else { -target.size_nm };
        let moment_nm = |condition: &AirData, deflection_rad| {
            response(row, &felt_by(side, self.products(&deflected(condition, surface, deflection_rad))))
        };
        // The moment is linear in the deflection.
        let solve = |condition: &AirData| {
            let neutral_nm = moment_nm(condition, 0.0);
            let slope_nm = moment_nm(condition, 1.0) - neutral_nm;
            let deflection_rad = if slope_nm == 0.0 { 0.0 } else { (wanted_nm - neutral_nm) / slope_nm };
            deflection_rad.clamp(least, greatest)
        };
        let shortfall = wanted_nm / moment_nm(condition, solve(condition));
        if shortfall > 1.0 {
            condition.airspeed_m_s = (condition.airspeed_m_s * libm::sqrt(shortfall)).min(AIRSPEED_M_S[1]);
            condition.dynamic_pressure_pa = dynamic_pressure_pa(condition.airspeed_m_s);
        }
        *condition = deflected(condition, surface, solve(condition));
    }
}

fn deflected(condition: &AirData, surface: Surface, deflection_rad: f64) -> AirData {
    let mut deflected = condition.clone();
    match surface {
        Surface::Flap => deflected.flap_rad = deflection_rad,
        Surface::Aileron => deflected.aileron_rad = deflection_rad,
        Surface::None => {}
    }
    deflected
}

/// Temperature rises at the stations, K.
struct Temperatures {
    bonded_k: [f64; TEMPERATURE_SENSORS],
    free_k: [f64; TEMPERATURE_SENSORS],
}

fn draw_temperatures(settings: &FlightSettings, stream: &mut Stream) -> Temperatures {
    let flight_k = between(settings.temperature_rise_k, stream);
    let bonded_k = std::array::from_fn(|_| flight_k + settings.station_temperature_sd_k * stream.normal());
    Temperatures { bonded_k, free_k: bonded_k.map(|rise_k| rise_k + GRATING_TEMPERATURE_ERROR_K * stream.normal()) }
}

/// A failed grating.
struct Failed {
    grating: usize,
    failure: GratingFailure,
    /// Its offset, if it is biased.
    bias: f64,
}

fn draw_failure(settings: &FlightSettings, stream: &mut Stream) -> Option<Failed> {
    let failed = stream.uniform() < settings.failure_probability;
    let grating = stream.below(STRAIN_SENSORS);
    let failure = [GratingFailure::Dead, GratingFailure::Debonded, GratingFailure::Biased][stream.below(3)];
    let bias = if stream.uniform() < 0.5 { FAILED_BIAS } else { -FAILED_BIAS };
    failed.then_some(Failed { grating, failure, bias })
}

/// What the gratings are read under.
struct Readings<'a> {
    configuration: &'a SensorConfiguration,
    settings: &'a FlightSettings,
    strains: &'a [f64; STRAIN_SENSORS],
    temperatures: &'a Temperatures,
    failed: Option<&'a Failed>,
}

impl Readings<'_> {
    fn draw(&self, stream: &mut Stream) -> Strain {
        let gratings = self.configuration.strain_gratings.iter().enumerate();
        let wavelengths_nm = gratings.map(|(i, grating)| {
            let strain = self.shown_strain(i, self.settings.gain_noise * stream.normal()) + grating.tare;
            let rise_k = self.temperatures.bonded_k[grating.station];
            Some(fbg::wavelength_nm(grating.wavelength_nm, strain, rise_k) + WAVELENGTH_ERROR_NM * stream.normal())
        });
        let wavelengths_nm = wavelengths_nm.collect();
        let references = self.configuration.temperature_wavelengths_nm.iter().zip(self.temperatures.free_k);
        let temperature_wavelengths_nm = references.map(|(reference_nm, rise_k)| {
            Some(fbg::free_wavelength_nm(*reference_nm, rise_k) + WAVELENGTH_ERROR_NM * stream.normal())
        });
        Strain { wavelengths_nm, temperature_wavelengths_nm: temperature_wavelengths_nm.collect() }
    }

    /// Strain that a grating shows under load, its gain off by `gain_error`.
    fn shown_strain(&self, grating: usize, gain_error: f64) -> f64 {
        let strain = self.strains[grating] * (1.0 + gain_error);
        match self.failed.filter(|failed| failed.grating == grating) {
            None => strain,
            Some(failed) => match failed.failure {
                GratingFailure::Dead => 0.0,
                GratingFailure::Debonded => 0.5 * strain,
                GratingFailure::Biased => strain + failed.bias,
            },
        }
    }
}
