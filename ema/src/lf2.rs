//! LF2: the actuator without stator inductance (Berri 2021, section 3.3), stepped in lanes.
//!
//! What: a single-phase motor whose current follows its reference at once, within what the supply
//! voltage leaves over the back-EMF; Coulomb friction, backlash, shorts and eccentricity as shape
//! functions of the electrical angle.
//! Update rule, every time step: lagged speed reference -> PI -> current limits (eqs. 3.54-3.58)
//! -> torque -> speed, with friction that catches at zero speed (Borello) -> angles -> backlash (eq. 3.16).
//! Requirements: a time step far below the mechanical time constant; 2e-4 s is enough.
//! Shapes: `N` actuators with the same faults side by side, so that loops over lanes vectorise.
//! Units: SI, at the motor shaft unless a name says otherwise.
//! Source: Berri 2021, eqs. 3.16, 3.26, 3.33-3.35, 3.46 (corrected: AB and AC swapped), 3.53-3.58.

use std::f64::consts::TAU;

use domain::FaultVector;

use crate::motor;

/// Faults of an actuator, dimensionless. Nominal is [`Faults::NOMINAL`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Faults {
    /// Shorted fraction of the windings of phases A, B and C, in [0, 1].
    pub shorts: [f64; 3],
    /// Static eccentricity ((1 + zeta cos phi)/2, (1 + zeta sin phi)/2), nominal 1/2 each.
    pub eccentricity: [f64; 2],
    /// Growth of friction: friction is multiplied by 1 + 4 times this; nominal 0.
    pub friction: f64,
    /// Growth of backlash: its half band is nominal + 4e-3 rad times this; nominal 0.
    pub backlash: f64,
    /// Drift of the position gain, which is multiplied by 1/2 + this; nominal 1/2.
    pub gain: f64,
}

/// A fault vector that is not one of an actuator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidFaults {
    /// Neither five nor eight entries.
    #[error("a fault vector has 5 or 8 entries, not {entries}")]
    Length {
        /// Entries given.
        entries: usize,
    },
    /// An entry outside [0, 1].
    #[error("fault {index} is {value}, outside 0 to 1")]
    Range {
        /// Which entry, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
}

impl Faults {
    /// No fault at all.
    pub const NOMINAL: Self =
        Self { shorts: [0.0; 3], eccentricity: [0.5; 2], friction: 0.0, backlash: 0.0, gain: 0.5 };

    /// The five electrical faults, as the fault vector orders them.
    pub fn electrical(k: [f64; 5]) -> Self {
        Self { shorts: [k[0], k[1], k[2]], eccentricity: [k[3], k[4]], ..Self::NOMINAL }
    }
}

impl TryFrom<&FaultVector> for Faults {
    type Error = InvalidFaults;

    /// Reads five (electrical) or eight entries (then friction, backlash, gain), each in [0, 1].
    fn try_from(faults: &FaultVector) -> Result<Self, InvalidFaults> {
        let k = faults.values();
        if let Some((index, &value)) = k.iter().enumerate().find(|(_, value)| !(0.0..=1.0).contains(*value)) {
            return Err(InvalidFaults::Range { index, value });
        }
        match *k {
            [a, b, c, d, e] => Ok(Self::electrical([a, b, c, d, e])),
            [a, b, c, d, e, friction, backlash, gain] => {
                Ok(Self { friction, backlash, gain, ..Self::electrical([a, b, c, d, e]) })
            }
            _ => Err(InvalidFaults::Length { entries: k.len() }),
        }
    }
}

/// Parameters of the model and of its controller. [`Parameters::assessment`] is the set by which
/// assessments are labelled; the maps and step responses of the other models have a set of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Supply voltage, V.
    pub supply_v: f64,
    /// Line-to-line resistance, ohm.
    pub resistance_ohm: f64,
    /// Line-to-line back-EMF constant, V s/rad (also N m/A).
    pub back_emf_v_s: f64,
    /// Greatest motor torque, N m; the current is limited to this over `back_emf_v_s`.
    pub torque_max_nm: f64,
    /// Inertia, kg m^2.
    pub inertia_kg_m2: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_nm_s: f64,
    /// Friction at rest, N m.
    pub friction_static_nm: f64,
    /// Friction in motion, N m.
    pub friction_dynamic_nm: f64,
    /// Gear ratio, motor over output.
    pub gear: f64,
    /// Half band of the backlash, rad at the output.
    pub backlash_rad: f64,
    /// Position gain, 1/s.
    pub position_gain: f64,
    /// Limit of the speed reference, rad/s.
    pub speed_reference_max_rad_s: f64,
    /// Proportional gain of the speed loop, A s/rad.
    pub speed_proportional: f64,
    /// Integral gain of the speed loop, A/rad.
    pub speed_integral: f64,
    /// First-order lag of the speed reference, s: what lets the phase pass -180 degrees.
    pub speed_lag_s: f64,
    /// Step of the integration, s.
    pub time_step_s: f64,
}

impl Parameters {
    /// The set of the assessment function for the reference actuator.
    pub fn assessment() -> Self {
        Self::assessment_of(&motor::Motor::default())
    }

    /// The set of the assessment function for an actuator with this motor: its electrical and
    /// mechanical constants, with friction, backlash and control loops of the assessment.
    pub fn assessment_of(motor: &motor::Motor) -> Self {
        Self {
            supply_v: motor.supply_v,
            resistance_ohm: motor.resistance_ohm,
            back_emf_v_s: motor.back_emf_v_s_rad,
            torque_max_nm: motor.torque_max_nm,
            inertia_kg_m2: motor.inertia_kg_m2,
            viscous_nm_s: motor.damping_nm_s_rad,
            friction_static_nm: 0.05 * motor.torque_max_nm,
            friction_dynamic_nm: 0.04 * motor.torque_max_nm,
            gear: motor.gear_ratio,
            backlash_rad: 2e-5,
            position_gain: 80.0,
            speed_reference_max_rad_s: 700.0,
            speed_proportional: 0.06,
            speed_integral: 4.0,
            speed_lag_s: 1.2e-3,
            time_step_s: 2e-4,
        }
    }
}

/// Bins of the back-EMF table over one electrical turn; commutations fall on their edges.
const BINS: usize = 360;

/// A motor with its faults: constants that depend on the electrical angle alone.
#[derive(Debug, Clone)]
pub struct Motor {
    parameters: Parameters,
    /// Back-EMF constant at the beginning of each bin and its slope per rad, V s/rad.
    back_emf: Vec<[f64; 2]>,
    /// 1/R of each bin, 1/ohm.
    conductance: Vec<f64>,
    viscous_nm_s: f64,
    friction_static_nm: f64,
    friction_dynamic_nm: f64,
    backlash_rad: f64,
    position_gain: f64,
}

impl Motor {
    /// The motor of these parameters with these faults.
    pub fn new(parameters: &Parameters, faults: &Faults) -> Self {
        let p = parameters;
        let width = TAU / BINS as f64;
        let shape =
            |bin: usize, angle: f64| p.back_emf_v_s * short_shape(faults, bin) * eccentricity_shape(faults, bin, angle);
        let back_emf = (0..BINS).map(|bin| {
            let start = bin as f64 * width;
            let (from, to) = (shape(bin, start), shape(bin, start + width));
            [from, (to - from) / width]
        });
        // Shorted turns brake like a generator (eq. 3.26); phase values are half the line-to-line ones.
        let (phase_back_emf, phase_resistance) = (p.back_emf_v_s / 2.0, p.resistance_ohm / 2.0);
        let braking = faults.shorts.iter().sum::<f64>() * phase_back_emf * phase_back_emf / phase_resistance;
        let friction = 1.0 + 4.0 * faults.friction;
        Self {
            back_emf: back_emf.collect(),
            conductance: (0..BINS).map(|bin| 1.0 / (p.resistance_ohm * short_shape(faults, bin))).collect(),
            viscous_nm_s: p.viscous_nm_s + braking,
            friction_static_nm: p.friction_static_nm * friction,
            friction_dynamic_nm: p.friction_dynamic_nm * friction,
            backlash_rad: p.backlash_rad + 4e-3 * faults.backlash,
            position_gain: p.position_gain * (0.5 + faults.gain),
            parameters: p.clone(),
        }
    }

    /// The parameters, without faults.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Load that a slow rotation just cannot carry through its weakest angle, N m: the least torque at
    /// full current over a turn, less friction in motion.
    pub fn holding_torque_nm(&self) -> f64 {
        let p = &self.parameters;
        let current_max = p.torque_max_nm / p.back_emf_v_s;
        let torque = |bin: usize| {
            let [start, slope] = self.back_emf[bin];
            let back_emf = start.min(start + slope * TAU / BINS as f64);
            back_emf * current_max.min(p.supply_v * self.conductance[bin])
        };
        let least = (0..BINS).map(torque).fold(f64::INFINITY, f64::min);
        (least - self.friction_dynamic_nm).max(0.0)
    }

    /// Speed reference of a position error at the output, rad/s.
    pub fn speed_reference_rad_s(&self, position_error_rad: f64) -> f64 {
        let limit = self.parameters.speed_reference_max_rad_s;
        (self.position_gain * self.parameters.gear * position_error_rad).clamp(-limit, limit)
    }
}

/// Mean of the healthy fractions of the two active phases (eq. 3.46, corrected), by bin.
fn short_shape(faults: &Faults, bin: usize) -> f64 {
    let [a, b, c] = faults.shorts;
    let shorted = match sector(bin) {
        0 => a + c,
        1 => b + c,
        _ => a + b,
    };
    // Two fully shorted phases have no resistance left; they are far beyond any failure.
    (1.0 - shorted / 2.0).max(0.01)
}

/// Mean of the factors 1 + zeta cos(angle + phi + shift) of the two active phases, at an electrical
/// angle in rad (eqs. 3.33-3.35). It replaces the fitted shape of eq. 3.48, whose minima are too shallow.
fn eccentricity_shape(faults: &Faults, bin: usize, angle: f64) -> f64 {
    let [cosine, sine] = faults.eccentricity.map(|k| 2.0 * k - 1.0);
    // zeta cos(x + phi) = cos x (zeta cos phi) - sin x (zeta sin phi).
    let phase = |shift: f64| libm::cos(angle + shift) * cosine - libm::sin(angle + shift) * sine;
    const THIRD: f64 = TAU / 3.0;
    let (a, b, c) = (0.0, THIRD, -THIRD);
    let (first, second) = match sector(bin) {
        0 => (a, c),
        1 => (b, c),
        _ => (a, b),
    };
    1.0 + (phase(first) + phase(second)) / 2.0
}

/// Which pair of phases is active in a bin: 0 for A and C, 1 for B and C, 2 for A and B.
fn sector(bin: usize) -> usize {
    (bin + BINS / 12) / (BINS / 6) % 3
}

/// State of `N` actuators.
#[derive(Debug, Clone)]
pub struct Lanes<const N: usize> {
    /// Motor speed, rad/s.
    pub speed_rad_s: [f64; N],
    /// Output angle behind the backlash, rad.
    pub output_rad: [f64; N],
    motor_rad: [f64; N],
    electrical_rad: [f64; N],
    lagged_rad_s: [f64; N],
    integral_a: [f64; N],
}

impl<const N: usize> Lanes<N> {
    /// Actuators at rest at electrical and output angle zero.
    pub fn at_rest() -> Self {
        let zero = [0.0; N];
        Self {
            speed_rad_s: zero,
            output_rad: zero,
            motor_rad: zero,
            electrical_rad: zero,
            lagged_rad_s: zero,
            integral_a: zero,
        }
    }

    /// One time step under speed references, rad/s, and loads at the motor shaft, N m (positive ones
    /// oppose positive motion).
    #[inline(always)]
    pub fn step(&mut self, motor: &Motor, reference_rad_s: &[f64; N], load_nm: &[f64; N]) {
        let p = &motor.parameters;
        let dt = p.time_step_s;
        let current_max = p.torque_max_nm / p.back_emf_v_s;
        let (lag, acceleration) = (dt / p.speed_lag_s, dt / p.inertia_kg_m2);
        let bins_per_rad = BINS as f64 / TAU;
        let (mut back_emf, mut conductance) = ([0.0; N], [0.0; N]);
        for j in 0..N {
            let bin = ((self.electrical_rad[j] * bins_per_rad) as usize).min(BINS - 1);
            let [value, slope] = motor.back_emf[bin];
            back_emf[j] = value + slope * (self.electrical_rad[j] - bin as f64 / bins_per_rad);
            conductance[j] = motor.conductance[bin];
        }
        for j in 0..N {
            let speed = self.speed_rad_s[j];
            self.lagged_rad_s[j] += lag * (reference_rad_s[j] - self.lagged_rad_s[j]);
            let error = self.lagged_rad_s[j] - speed;
            let wanted = p.speed_proportional * error + self.integral_a[j];
            // Conditional anti-windup: no integration that drives further into the current limit.
            let free = wanted.abs() < current_max || wanted * error < 0.0;
            self.integral_a[j] += if free { p.speed_integral * dt * error } else { 0.0 };
            let wanted = limit(wanted, -current_max, current_max);
            let emf = back_emf[j] * speed;
            let current = limit(wanted, (-p.supply_v - emf) * conductance[j], (p.supply_v - emf) * conductance[j]);
            let torque = back_emf[j] * current - motor.viscous_nm_s * speed - load_nm[j];
            self.speed_rad_s[j] = with_friction(motor, speed, torque, acceleration);
        }
        for j in 0..N {
            let turned = dt * self.speed_rad_s[j];
            self.motor_rad[j] += turned;
            let electrical = self.electrical_rad[j] + turned;
            let electrical = if electrical >= TAU { electrical - TAU } else { electrical };
            self.electrical_rad[j] = if electrical < 0.0 { electrical + TAU } else { electrical };
            let reduced = self.motor_rad[j] / p.gear;
            // Backlash (eq. 3.16): the output stays unless an end of the band pushes it.
            self.output_rad[j] = limit(self.output_rad[j], reduced - motor.backlash_rad, reduced + motor.backlash_rad);
        }
    }
}

#[inline(always)]
fn limit(x: f64, low: f64, high: f64) -> f64 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

/// Speed after one step of Coulomb friction that holds at rest and catches at zero speed (Borello).
#[inline(always)]
fn with_friction(motor: &Motor, speed: f64, torque_nm: f64, acceleration: f64) -> f64 {
    let direction = if speed != 0.0 { speed } else { torque_nm };
    let friction = motor.friction_dynamic_nm.copysign(direction);
    let next = speed + acceleration * (torque_nm - friction);
    let held = speed == 0.0 && torque_nm.abs() <= motor.friction_static_nm;
    if held || next * speed < 0.0 { 0.0 } else { next }
}
