//! The assessment function: what an actuator with given faults can still do, and whether that is enough.
//!
//! What: no-load speed, stall load, gain and phase margin of LF2 with the parameter set
//! [`Parameters::assessment_of`] a motor, against [`Requirements`].
//! How: one large step in each direction, speed averaged while it is saturated; the load that a slow
//! rotation cannot carry through the weakest angle; 44 sines of two amplitudes in open position loop,
//! whose Fourier coefficients (eqs. 5.16-5.25) give the Bode curves. Of directions and amplitudes the
//! worst counts.
//! The stall load is the limit of ever slower load ramps. A ramp of finite slope meets the weakest angle
//! up to a turn late, and the turns lengthen as the motor slows: its result jumps by a per cent or two
//! under the smallest change of the faults, on which no surrogate and no failure time can rest.
//! Requirements: faults in [0, 1]. Cost: about 100,000 lane steps.
//! Units: figures at the output shaft. Source: Berri 2021, section 3.4 and eqs. 5.16-5.25.

use std::f64::consts::{PI, TAU};

use domain::FaultVector;

use crate::lf2::{Faults, InvalidFaults, Lanes, Motor, Parameters};

/// What an actuator can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assessment {
    /// Speed at the output in a large step without load, rad/s, in the slower direction.
    pub no_load_speed_rad_s: f64,
    /// Least load at the output that stops a slow rotation for good, N m.
    pub stall_load_nm: f64,
    /// Least gain margin over amplitudes, dB; `None` when the phase stays above -180 degrees.
    pub gain_margin_db: Option<f64>,
    /// Least phase margin over amplitudes, degrees; `None` when the gain does not cross 0 dB.
    pub phase_margin_deg: Option<f64>,
}

/// What an actuator must be able to do to be healthy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Requirements {
    /// Least no-load speed, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Least stall load, N m.
    pub stall_load_nm: f64,
    /// Least gain margin, dB.
    pub gain_margin_db: f64,
    /// Least phase margin, degrees.
    pub phase_margin_deg: f64,
}

impl Default for Requirements {
    fn default() -> Self {
        Self { no_load_speed_rad_s: 1.145, stall_load_nm: 660.0, gain_margin_db: 12.0, phase_margin_deg: 57.0 }
    }
}

/// Margin of a figure that has no crossing: as if it were twice what is required.
const NO_CROSSING_MARGIN: f64 = 1.0;

impl Assessment {
    /// Distances from requirements, value / requirement - 1, negative = not met: no-load speed, stall
    /// load, gain margin, phase margin.
    pub fn margins_to(&self, requirements: &Requirements) -> [f64; 4] {
        let crossing = |value: Option<f64>, required: f64| match value {
            Some(value) => value / required - 1.0,
            None => NO_CROSSING_MARGIN,
        };
        [
            self.no_load_speed_rad_s / requirements.no_load_speed_rad_s - 1.0,
            self.stall_load_nm / requirements.stall_load_nm - 1.0,
            crossing(self.gain_margin_db, requirements.gain_margin_db),
            crossing(self.phase_margin_deg, requirements.phase_margin_deg),
        ]
    }

    /// Distances from the default requirements.
    pub fn margins(&self) -> [f64; 4] {
        self.margins_to(&Requirements::default())
    }

    /// The least distance from the default requirements.
    pub fn min_margin(&self) -> f64 {
        self.margins().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Whether the default requirements are met.
    pub fn is_healthy(&self) -> bool {
        self.min_margin() >= 0.0
    }
}

/// Assesses an actuator of these parameters with five electrical or eight faults, each in [0, 1].
pub fn assess(parameters: &Parameters, faults: &FaultVector) -> Result<Assessment, InvalidFaults> {
    Ok(assess_faults(parameters, &faults.try_into()?))
}

/// Assesses an actuator of these parameters with these faults.
pub fn assess_faults(parameters: &Parameters, faults: &Faults) -> Assessment {
    let motor = Motor::new(parameters, faults);
    let (gain_margin_db, phase_margin_deg) = stability_margins(&motor);
    Assessment {
        no_load_speed_rad_s: no_load_speed(parameters, faults),
        stall_load_nm: motor.holding_torque_nm() * parameters.gear,
        gain_margin_db,
        phase_margin_deg,
    }
}

/// Both directions of motion.
const DIRECTIONS: [f64; 2] = [1.0, -1.0];

/// Speed at the output after a step of 1 rad, averaged from 0.12 to 0.20 s, in the slower direction.
fn no_load_speed(parameters: &Parameters, faults: &Faults) -> f64 {
    // At the time step of the other runs a turn of the motor is some 55 steps, and the speed locks
    // to whole numbers of them.
    let parameters = Parameters { time_step_s: 2.5e-5, ..parameters.clone() };
    let motor = Motor::new(&parameters, faults);
    let steps = |seconds: f64| (seconds / parameters.time_step_s).round() as usize;
    let mut lanes = Lanes::<2>::at_rest();
    let mut run = |steps: usize| {
        let mut sum = [0.0; 2];
        for _ in 0..steps {
            let reference = [0, 1].map(|j| motor.speed_reference_rad_s(DIRECTIONS[j] - lanes.output_rad[j]));
            lanes.step(&motor, &reference, &[0.0; 2]);
            for j in 0..2 {
                sum[j] += lanes.speed_rad_s[j] * DIRECTIONS[j];
            }
        }
        sum.map(|sum| sum / steps as f64)
    };
    run(steps(0.12));
    let [forward, backward] = run(steps(0.08));
    forward.min(backward) / parameters.gear
}

/// Frequencies of the Bode curves, log-spaced over [`FREQUENCY_RANGE_HZ`].
const FREQUENCIES: usize = 22;
/// First and last frequency, Hz.
const FREQUENCY_RANGE_HZ: [f64; 2] = [2.5, 60.0];
/// Amplitudes of the position error, rad at the output.
const AMPLITUDES_RAD: [f64; 2] = [0.003, 0.009];

/// One sine: its amplitude and its period in time steps, so that windows hold whole periods.
#[derive(Debug, Clone, Copy)]
struct Sine {
    amplitude_rad: f64,
    period_steps: usize,
}

/// Gain and phase of the open position loop at one sine.
#[derive(Debug, Clone, Copy, Default)]
struct Response {
    gain_db: f64,
    phase_deg: f64,
}

/// Least gain margin, dB, and phase margin, degrees, over amplitudes.
fn stability_margins(motor: &Motor) -> (Option<f64>, Option<f64>) {
    let [low, high] = FREQUENCY_RANGE_HZ;
    let sine = |amplitude_rad: f64, f: usize| {
        let frequency_hz = low * libm::pow(high / low, f as f64 / (FREQUENCIES - 1) as f64);
        let period_steps = (1.0 / (frequency_hz * motor.parameters().time_step_s)).round() as usize;
        Sine { amplitude_rad, period_steps }
    };
    let mut curves = AMPLITUDES_RAD.map(|_| Vec::with_capacity(FREQUENCIES));
    for f in (0..FREQUENCIES).step_by(2) {
        // Neighbouring frequencies at both amplitudes make four lanes of about equal length.
        let [small, large] = AMPLITUDES_RAD;
        let sines = [sine(small, f), sine(small, f + 1), sine(large, f), sine(large, f + 1)];
        let measured = frequency_responses(motor, &sines);
        curves[0].extend_from_slice(&measured[..2]);
        curves[1].extend_from_slice(&measured[2..]);
    }
    curves.iter_mut().for_each(|curve| unwrap_phase(curve));
    let least =
        |margin: fn(&[Response]) -> Option<f64>| curves.iter().filter_map(|curve| margin(curve)).reduce(f64::min);
    (least(gain_margin_db), least(phase_margin_deg))
}

/// Whole periods that settle, and as many again that are measured: at least this long, s.
const WINDOW_S: f64 = 0.05;

/// Responses of the output to sines of the position error, by Fourier coefficients over whole periods.
fn frequency_responses<const N: usize>(motor: &Motor, sines: &[Sine; N]) -> [Response; N] {
    let windows = sines.map(|sine| {
        let period_s = sine.period_steps as f64 * motor.parameters().time_step_s;
        sine.period_steps * (WINDOW_S / period_s).ceil() as usize
    });
    let rotation = sines.map(|sine| {
        let angle = TAU / sine.period_steps as f64;
        [libm::cos(angle), libm::sin(angle)]
    });
    let mut lanes = Lanes::<N>::at_rest();
    let (mut cosine, mut sine) = ([1.0; N], [0.0; N]);
    let (mut re, mut im, mut begin, mut end) = ([0.0; N], [0.0; N], [0.0; N], [0.0; N]);
    let last = 2 * windows.into_iter().max().unwrap_or(0);
    for step in 1..=last {
        let mut reference = [0.0; N];
        for j in 0..N {
            reference[j] = motor.speed_reference_rad_s(sines[j].amplitude_rad * sine[j]);
        }
        lanes.step(motor, &reference, &[0.0; N]);
        for j in 0..N {
            let [c, s] = rotation[j];
            (cosine[j], sine[j]) = (cosine[j] * c - sine[j] * s, sine[j] * c + cosine[j] * s);
            let output = lanes.output_rad[j];
            begin[j] = if step == windows[j] { output } else { begin[j] };
            end[j] = if step == 2 * windows[j] { output } else { end[j] };
            let measured = if step > windows[j] && step <= 2 * windows[j] { output } else { 0.0 };
            re[j] += measured * sine[j];
            im[j] += measured * cosine[j];
        }
    }
    let mut responses = [Response::default(); N];
    for j in 0..N {
        let drift = (end[j] - begin[j]) / windows[j] as f64;
        responses[j] = response(&sines[j], windows[j], [re[j], im[j]], drift);
    }
    responses
}

/// Gain and phase (eqs. 5.20-5.25) from the sums of output times sine and cosine over a window of
/// whole periods, without the output's drift, rad per step.
fn response(sine: &Sine, window: usize, [re, im]: [f64; 2], drift: f64) -> Response {
    // The sums of a ramp i over i = 1..n: with the sine -n/2 cot(pi/period), with the cosine n/2.
    let half = window as f64 / 2.0;
    let angle = PI / sine.period_steps as f64;
    let re = (re + drift * half * libm::cos(angle) / libm::sin(angle)) / half;
    let im = (im - drift * half) / half;
    // A motor that does not move at all has no phase; its gain is far below any crossing.
    let gain = (libm::hypot(re, im) / sine.amplitude_rad).max(1e-9);
    Response { gain_db: 20.0 * libm::log10(gain), phase_deg: libm::atan2(im, re).to_degrees() }
}

/// Makes a phase continuous over frequency.
fn unwrap_phase(curve: &mut [Response]) {
    for i in 1..curve.len() {
        let turns = ((curve[i].phase_deg - curve[i - 1].phase_deg) / 360.0).round();
        curve[i].phase_deg -= 360.0 * turns;
    }
}

/// The place where a quantity first falls below zero between neighbours: their index and the share of the way.
fn first_fall(curve: &[Response], value: impl Fn(&Response) -> f64) -> Option<(usize, f64)> {
    curve.windows(2).enumerate().find_map(|(i, pair)| {
        let (before, after) = (value(&pair[0]), value(&pair[1]));
        (before >= 0.0 && after < 0.0).then(|| (i, before / (before - after)))
    })
}

/// Distance of the gain from 0 dB where the phase falls below -180 degrees.
fn gain_margin_db(curve: &[Response]) -> Option<f64> {
    let (i, share) = first_fall(curve, |response| response.phase_deg + 180.0)?;
    Some(-(curve[i].gain_db + share * (curve[i + 1].gain_db - curve[i].gain_db)))
}

/// Distance of the phase from -180 degrees where the gain falls below 0 dB.
fn phase_margin_deg(curve: &[Response]) -> Option<f64> {
    let (i, share) = first_fall(curve, |response| response.gain_db)?;
    Some(180.0 + curve[i].phase_deg + share * (curve[i + 1].phase_deg - curve[i].phase_deg))
}
