//! First low-fidelity model of motor and drive: the active pair as one phase.
//!
//! What: a single RL circuit between +V_s and -V_s, relay-controlled, whose parameters follow the rotor.
//! Update rule, explicit: V = V_s sign(i_ref - i); L di/dt = V - k w - R i; T = k i, limited; for the active pair
//! (p, n) k = k_nom/2 sum N_j (1 + zeta cos(...)), R = R_nom/2 sum N_j, L = L_nom/2 sum N_j^2.
//! That sum is what the high-fidelity model does between commutations. The thesis has fitted shape functions
//! in its place, kept as a baseline: k = k_nom phi_SC phi_E, R = R_nom phi_SC, L = L_nom phi_SC^2 with
//! phi_SC = (N_p + N_n)/2 and phi_E = 1 - zeta_LF (cos(theta_e + psi) + sigma sin(theta_e + psi)), where sigma
//! rises from 0 to 1 over each sector. One sawtooth cannot follow three pairs: about 38 % of the eccentricity's
//! part of the map is left over.
//! Requirements: time step of 2 microseconds, at most 5.
//! Source: Berri 2021, section 3.2 (eq. 3.37, 3.38, 3.40; 3.46 with the pairs AB and AC exchanged, 3.48, 3.49).

use crate::{
    clip::clip,
    commutation::{ACTIVE_PAIRS, BINS, FIRST_COMMUTATION_BIN, SECTOR_BINS, bin_edge_rad, sector},
    controller::AntiWindup,
    drive::{Drive, Electrical, Terminal},
    faults::ElectricalFaults,
    motor::Motor,
};

/// How the faults of three phases act on one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// The sum over the active pair.
    Pair,
    /// The shape functions of the thesis.
    Thesis,
}

/// zeta_LF over zeta in eq. 3.48: the least-squares fit to high-fidelity maps, 0.42 in the thesis.
const SHAPE_AMPLITUDE: f64 = 0.400;
/// psi + phi in eq. 3.48, deg: from the direction of the minimum gap to the axis that the shape function has.
const SHAPE_AXIS_DEG: f64 = -97.2;

/// Single-phase motor and relay.
#[derive(Debug, Clone)]
pub(crate) struct LowFidelity1 {
    bins: Vec<PairInBin>,
    supply: f64,
    torque_max: f64,
    current: f64,
    pair: PairInBin,
}

/// The active pair within one bin.
#[derive(Debug, Clone, Copy)]
struct PairInBin {
    back_emf: f64,
    back_emf_slope: f64,
    resistance: f64,
    inverse_inductance: f64,
}

impl LowFidelity1 {
    /// The integral of the speed loop is never stopped.
    pub const ANTI_WINDUP: AntiWindup = AntiWindup::None;

    /// A motor without current.
    pub fn new(motor: &Motor, faults: &ElectricalFaults, form: Form) -> Self {
        let in_bin = match form {
            Form::Pair => PairInBin::sum,
            Form::Thesis => PairInBin::shaped,
        };
        let bins: Vec<_> = (0..BINS).map(|bin| in_bin(motor, faults, bin)).collect();
        Self { pair: bins[0], bins, supply: motor.supply_v, torque_max: motor.torque_max_nm, current: 0.0 }
    }
}

impl Drive for LowFidelity1 {
    #[inline]
    fn enter(&mut self, bin: usize) {
        self.pair = self.bins[bin];
    }

    #[inline]
    fn step(&mut self, terminal: Terminal) -> Electrical {
        let Terminal { current_reference_a, speed_rad_s, way, step_s } = terminal;
        let current_a = self.current;
        let error = current_reference_a - current_a;
        let voltage_v = if error == 0.0 { 0.0 } else { self.supply.copysign(error) };
        let k = self.pair.back_emf + way * self.pair.back_emf_slope;
        let slope = (voltage_v - k * speed_rad_s - self.pair.resistance * current_a) * self.pair.inverse_inductance;
        self.current += step_s * slope;
        Electrical {
            torque_nm: clip(k * current_a, self.torque_max),
            voltage_v,
            current_a,
            next_current_a: self.current,
        }
    }
}

impl PairInBin {
    /// The sum over the pair.
    fn sum(motor: &Motor, faults: &ElectricalFaults, bin: usize) -> Self {
        let healthy = faults.healthy();
        let (p, n) = ACTIVE_PAIRS[sector(bin)];
        let back_emf = |edge: usize| {
            let flux = faults.flux_factors(bin_edge_rad(edge));
            motor.phase_back_emf_v_s_rad() * (healthy[p] * flux[p] + healthy[n] * flux[n])
        };
        let inductance = motor.phase_inductance_h() * (healthy[p] * healthy[p] + healthy[n] * healthy[n]);
        Self {
            back_emf: back_emf(bin),
            back_emf_slope: back_emf(bin + 1) - back_emf(bin),
            resistance: motor.phase_resistance_ohm() * (healthy[p] + healthy[n]),
            inverse_inductance: 1.0 / inductance,
        }
    }
    /// The shape functions 3.46 and 3.48.
    fn shaped(motor: &Motor, faults: &ElectricalFaults, bin: usize) -> Self {
        let healthy = faults.healthy();
        let (p, n) = ACTIVE_PAIRS[sector(bin)];
        let short = 0.5 * (healthy[p] + healthy[n]);
        let way_into_sector = (bin + FIRST_COMMUTATION_BIN) % SECTOR_BINS;
        let back_emf = |steps: usize| {
            let sawtooth = (way_into_sector + steps) as f64 / SECTOR_BINS as f64;
            motor.back_emf_v_s_rad * short * eccentricity_shape(faults, bin_edge_rad(bin + steps), sawtooth)
        };
        Self {
            back_emf: back_emf(0),
            back_emf_slope: back_emf(1) - back_emf(0),
            resistance: motor.resistance_ohm * short,
            inverse_inductance: 1.0 / (motor.inductance_h * short * short),
        }
    }
}

/// phi_E of eq. 3.48 at an electrical angle, given the sawtooth there.
fn eccentricity_shape(faults: &ElectricalFaults, angle_rad: f64, sawtooth: f64) -> f64 {
    let psi = SHAPE_AXIS_DEG.to_radians() - faults.eccentricity_phase_rad();
    let (sin, cos) = libm::sincos(angle_rad + psi);
    1.0 - SHAPE_AMPLITUDE * faults.eccentricity() * (cos + sawtooth * sin)
}
