//! What a simulation shows of each step, and who looks on.

/// What happens in one time step. Electrical values are those of the active pair, signed so that a
/// positive current makes a positive torque.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Length of the step, s.
    pub step_s: f64,
    /// Electrical degree of the rotor at the beginning.
    pub bin: usize,
    /// V_p - V_n during the step, V.
    pub voltage_v: f64,
    /// (i_p - i_n)/2 at the beginning, A.
    pub current_a: f64,
    /// The same at the end, A.
    pub next_current_a: f64,
    /// Motor speed at the beginning, rad/s.
    pub speed_rad_s: f64,
    /// Commanded output angle, rad.
    pub command_rad: f64,
    /// Output angle at the beginning, rad.
    pub output_rad: f64,
    /// Motor angle at the beginning, rad.
    pub motor_rad: f64,
}

/// Looks on while a simulation runs.
pub trait Observer {
    /// Sees every step, in order.
    fn observe(&mut self, sample: &Sample);

    /// Whether the simulation may stop; asked every ten microseconds.
    fn done(&self) -> bool {
        false
    }
}
