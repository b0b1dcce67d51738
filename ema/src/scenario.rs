//! Harder fleets: lives that break one assumption each of a prognosis.
//!
//! What: how the life of a unit, or what is seen of it, departs from the standard fleet.
//! Update rule: a course is drawn for each life and changes growth, noise, or the observations; it has
//! a stream of its own, so that one life is the same in every scenario up to what the scenario changes.
//! Requirements: every life still ends, if not within the range of the standard fleet.
//! Units: flight hours; the rest is dimensionless.

use std::ops::RangeInclusive;

use numerics::Stream;

use crate::wear_law::{FAULTS, WearLaw};

/// Dominant drive of a sleeping fault, and of an awake one, relative to the standard.
const SLEEPING_DRIVE: f64 = 0.1;
const AWAKE_DRIVE: f64 = 2.5;
/// What a fault jumps by when it wakes up.
const ONSET_DEVIATION: f64 = 0.03;
/// Damage of this size grows at the same rate whatever the exponent.
const POWER_REFERENCE: f64 = 0.1;
/// How much heavier the noise is.
const HEAVY: f64 = 2.0;
/// Standard deviation over the fleet of the drift of a diagnosis, 1/h, relative to its own standard
/// deviation: after 3000 h four times that.
const DRIFT_PER_H: f64 = 4.0 / 3000.0;
/// Mean lengths of what is flown with and without a recorder, flight hours.
const RECORDED_FH: f64 = 150.0;
const MISSING_FH: f64 = 100.0;
/// Share of single flights that are lost in addition.
const LOST: f64 = 0.2;
/// Strength of a minor mode that becomes a second dominant one.
const SECOND: f64 = 4.0;

/// A kind of fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scenario {
    /// The fleet of [`simulate_life`](crate::life::simulate_life).
    Standard,
    /// Stretches without any record, and single flights lost.
    MissingFlights,
    /// Diagnoses move away from the truth in proportion to time.
    SensorDrift,
    /// The dominant fault is repaired once, and starts to grow again.
    Maintenance,
    /// Two dominant faults.
    TwoFaults,
    /// The dominant fault sleeps, jumps, and then grows fast.
    SuddenOnset,
    /// Damage grows with its power 3/2 rather than in proportion to itself.
    PowerLaw,
    /// Twice the process noise and twice the error of a diagnosis.
    HeavyNoise,
}

impl Scenario {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Standard,
        Self::MissingFlights,
        Self::SensorDrift,
        Self::Maintenance,
        Self::TwoFaults,
        Self::SuddenOnset,
        Self::PowerLaw,
        Self::HeavyNoise,
    ];

    /// Lives outside are drawn again, hours. Where only the observations are harder, the lives are those
    /// of the standard fleet.
    pub(crate) fn life_range_fh(self) -> RangeInclusive<f64> {
        match self {
            Self::Standard | Self::MissingFlights | Self::SensorDrift => 2000.0..=6000.0,
            _ => 1000.0..=10_000.0,
        }
    }

    /// Draws what happens to one life.
    pub(crate) fn course(self, law: &mut WearLaw, sd: &[f64; FAULTS], stream: &mut Stream) -> Course {
        let mut course = Course::default();
        match self {
            Self::Standard => {}
            Self::MissingFlights => course.gaps = Some(stream.clone()),
            Self::SensorDrift => course.drift_per_h = sd.map(|sd| DRIFT_PER_H * sd * stream.normal()),
            Self::Maintenance => course.repair_fh = Some(600.0 + 1000.0 * stream.uniform()),
            Self::TwoFaults => {
                let second = (law.dominant_mode + 1 + stream.below(3)) % 4;
                entries(second).for_each(|entry| law.control_matrix[entry].iter_mut().for_each(|b| *b *= SECOND));
            }
            Self::SuddenOnset => course.onset_fh = Some(500.0 + 2000.0 * stream.uniform()),
            Self::PowerLaw => course.exponent = 1.5,
            Self::HeavyNoise => course.noise = HEAVY,
        }
        course
    }
}

/// The entries of the fault vector that belong to a mode: a short, or both axes of the eccentricity.
pub(crate) fn entries(mode: usize) -> std::ops::Range<usize> {
    if mode < 3 { mode..mode + 1 } else { 3..FAULTS }
}

/// What is special about one life.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    /// Process noise and error of a diagnosis, relative to the standard.
    pub noise: f64,
    /// Damage grows with this power of itself.
    pub exponent: f64,
    /// The time at which the dominant fault wakes up; `None` when it never slept.
    pub onset_fh: Option<f64>,
    /// The time at which the dominant fault is repaired.
    pub repair_fh: Option<f64>,
    /// Drift of the diagnosis, 1/h.
    pub drift_per_h: [f64; FAULTS],
    /// Chance of what is not recorded.
    gaps: Option<Stream>,
}

impl Default for Course {
    fn default() -> Self {
        Self { noise: 1.0, exponent: 1.0, onset_fh: None, repair_fh: None, drift_per_h: [0.0; FAULTS], gaps: None }
    }
}

impl Course {
    /// Strength of the drive of a fault at a time, relative to the law.
    pub fn drive(&self, dominant: bool, t_fh: f64) -> f64 {
        match self.onset_fh {
            Some(onset_fh) if dominant && t_fh < onset_fh => SLEEPING_DRIVE,
            Some(_) if dominant => AWAKE_DRIVE,
            _ => 1.0,
        }
    }

    /// The damage that grows in proportion to itself, for a deviation.
    pub fn growing(&self, deviation: f64) -> f64 {
        if self.exponent == 1.0 {
            return deviation;
        }
        deviation * libm::pow(deviation.abs() / POWER_REFERENCE, self.exponent - 1.0)
    }

    /// What happens to the dominant fault in the step that ends at `t_fh` and began `step_fh` before.
    pub fn strike(&self, law: &WearLaw, deviation: &mut [f64; FAULTS], t_fh: f64, step_fh: f64) {
        let falls = |event_fh: &f64| (t_fh - step_fh..t_fh).contains(event_fh);
        if self.repair_fh.as_ref().is_some_and(falls) {
            entries(law.dominant_mode).for_each(|entry| deviation[entry] = 0.0);
        }
        if self.onset_fh.as_ref().is_some_and(falls) {
            let drive = |entry: usize| law.control_matrix[entry][0];
            let size = entries(law.dominant_mode).map(|entry| drive(entry) * drive(entry)).sum::<f64>().sqrt();
            entries(law.dominant_mode).for_each(|entry| deviation[entry] += ONSET_DEVIATION * drive(entry) / size);
        }
    }

    /// Which observations of a life are recorded: the first and the one at failure always. `None` where all are.
    pub fn recorded(&mut self, t_fh: &[f64]) -> Option<Vec<bool>> {
        let stream = self.gaps.as_mut()?;
        let last = t_fh.len() - 1;
        let (mut recorded, mut until_fh) = (true, RECORDED_FH * stream.exponential());
        let mut keep = Vec::with_capacity(t_fh.len());
        for (i, t_fh) in t_fh.iter().enumerate() {
            while *t_fh >= until_fh {
                recorded = !recorded;
                until_fh += stream.exponential() * if recorded { RECORDED_FH } else { MISSING_FH };
            }
            let lost = stream.uniform() < LOST;
            keep.push(i == 0 || i == last || (recorded && !lost));
        }
        Some(keep)
    }
}
