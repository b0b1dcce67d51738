//! The law by which one life wears, drawn from those of a fleet.
//!
//! What: the matrices A and B of the damage propagation, and how growth changes over the life.
//! Rule: log-normal rates and strengths, one dominant fault a life, couplings of either sign.
//! Shapes: five entries, in the order of the electrical fault model. Units: flight hours; the rest is dimensionless.
//! Source: Berri 2021, eq. 2.26, with one dominant fault a life, and growth that may change.

use numerics::Stream;

/// Entries of the fault vector: three shorts and the two axes of the eccentricity.
pub const FAULTS: usize = 5;

/// The kind of growth: the same all life, or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Regime {
    /// g = 1.
    Constant,
    /// g starts at 3/4 and jumps up one to three times.
    Varying,
}

impl Regime {
    /// The name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Varying => "varying",
        }
    }
}

/// The law by which one life wears; 1/h.
#[derive(Debug, Clone, PartialEq)]
pub struct WearLaw {
    /// A.
    pub state_matrix: [[f64; FAULTS]; FAULTS],
    /// B, columns as u = [1, load, temperature].
    pub control_matrix: [[f64; 3]; FAULTS],
    /// The dominant mode: 0 to 2 a short, 3 the eccentricity.
    pub dominant_mode: usize,
    /// Growth from each time on, flight hours, in ascending order; the first is at zero.
    pub growth: Vec<(f64, f64)>,
}

impl WearLaw {
    /// Draws the law of a life from those of the fleet.
    pub fn draw(stream: &mut Stream, regime: Regime) -> Self {
        let state_matrix = draw_state_matrix(stream);
        let dominant_mode = if stream.uniform() < 0.5 { 3 } else { stream.below(3) };
        let control_matrix = draw_control_matrix(stream, dominant_mode);
        let growth = match regime {
            Regime::Constant => vec![(0.0, 1.0)],
            Regime::Varying => draw_growth(stream),
        };
        Self { state_matrix, control_matrix, dominant_mode, growth }
    }

    /// The growth multiplier g at a time, flight hours since new.
    pub fn growth_at(&self, t_fh: f64) -> f64 {
        let begun = self.growth.partition_point(|&(from_fh, _)| from_fh <= t_fh);
        self.growth[begun.max(1) - 1].1
    }
}

/// exp of a normal with this median and standard deviation of the logarithm.
fn log_normal(stream: &mut Stream, median: f64, sd: f64) -> f64 {
    median * libm::exp(sd * stream.normal())
}

fn draw_state_matrix(stream: &mut Stream) -> [[f64; FAULTS]; FAULTS] {
    let mut a = [[0.0; FAULTS]; FAULTS];
    for (i, row) in a.iter_mut().enumerate() {
        let rate = log_normal(stream, if i < 3 { 5e-4 } else { 4.6e-4 }, 0.35);
        for (j, entry) in row.iter_mut().enumerate() {
            // Shorts heat each other; couplings across kinds have either sign and are weaker.
            *entry = match (i, j) {
                _ if i == j => rate,
                (0..3, 0..3) => 0.08 * rate * stream.normal().abs(),
                (0..3, _) => 0.04 * rate * stream.normal(),
                (_, 0..3) => 0.02 * rate * stream.normal(),
                _ => 0.08 * rate * stream.normal(),
            };
        }
    }
    // Eccentricity grows alike in every direction and may turn.
    a[4][4] = a[3][3];
    a[4][3] = -a[3][4];
    a
}

fn draw_control_matrix(stream: &mut Stream, dominant_mode: usize) -> [[f64; 3]; FAULTS] {
    let load_share = 0.2 + 0.4 * stream.uniform();
    let temperature_share = 0.3 * stream.uniform();
    let mut total = [0.0; 4];
    for (mode, total) in total.iter_mut().enumerate() {
        let strength = log_normal(stream, if mode < 3 { 1.9e-5 } else { 1.3e-5 }, 0.35);
        let minor = 0.25 * (0.4 + 1.2 * stream.uniform());
        *total = strength * if mode == dominant_mode { 1.0 } else { minor };
    }
    let direction_rad = std::f64::consts::TAU * stream.uniform();
    let (sin, cos) = libm::sincos(direction_rad);
    let b = [total[0], total[1], total[2], total[3] * cos, total[3] * sin];
    b.map(|b| [b * (1.0 - load_share), b * load_share, b * temperature_share])
}

fn draw_growth(stream: &mut Stream) -> Vec<(f64, f64)> {
    let jumps = 1 + stream.below(3);
    let mut times_fh: Vec<f64> = (0..jumps).map(|_| 300.0 + 4200.0 * stream.uniform()).collect();
    times_fh.sort_unstable_by(f64::total_cmp);
    let mut growth = vec![(0.0, 0.75)];
    for time_fh in times_fh {
        let factor = (1.0 + 0.7 * stream.exponential()).min(3.0);
        growth.push((time_fh, growth[growth.len() - 1].1 * factor));
    }
    growth
}
