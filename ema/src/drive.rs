//! A model of motor and drive, as the simulation steps it.

/// What a model of motor and drive does in one step.
pub(crate) struct Electrical {
    pub torque_nm: f64,
    pub voltage_v: f64,
    pub current_a: f64,
    pub next_current_a: f64,
}

/// State of motor and drive at the beginning of a step.
#[derive(Clone, Copy)]
pub(crate) struct Terminal {
    pub current_reference_a: f64,
    pub speed_rad_s: f64,
    /// Way into the bin as a fraction of its width.
    pub way: f64,
    pub step_s: f64,
}

/// A model of motor and drive.
pub(crate) trait Drive {
    /// The rotor has entered a bin.
    fn enter(&mut self, bin: usize);

    /// Advances the currents by one step.
    fn step(&mut self, terminal: Terminal) -> Electrical;
}
