//! The load that the motor itself tells, where no strain does.
//!
//! - What: a line r = offset + slope L between the mean size r of the load ratio (R i over k w, for the healthy share of the
//!   windings) and the load L = abs(M_h)/M_ref that the wing tells of the same flights. The offset is friction, the slope
//!   the way from the hinge to the shaft: gear ratio and efficiency.
//! - Update rule: one robust line through all flights. sigma is the median spread of units about their own lines; how far
//!   units lie apart is the spread of these lines less what their noise makes of it.
//! - Requirements: flights of one kind of motor, measured in one way, under loads that differ. None is told where r follows L
//!   too loosely.

use numerics::{RobustLine, quantile};
use serde::{Deserialize, Serialize};

/// Fewest flights that teach a line.
const MIN_FLIGHTS: usize = 50;
/// Fewest flights of one unit whose own line counts.
const MIN_UNIT_FLIGHTS: usize = 30;
/// Fewest units whose lines tell how far units lie apart.
const MIN_UNITS: usize = 5;
/// Below this correlation the motor tells too little of the load.
const MIN_CORRELATION: f64 = 0.7;
/// Spread of the slope from unit to unit, relative, where too few units tell it: the tolerance of R and k.
const UNIT_SLOPE_SD: f64 = 0.03;
/// Median of the absolute value of a standard normal number.
pub(crate) const MEDIAN: f64 = 0.674_489_75;

/// What wing and motor tell of one flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPair {
    /// abs(M_h) over the reference moment, by the wing.
    pub load: f64,
    /// Mean size of the load ratio, for the healthy share of the windings.
    pub ratio: f64,
}

/// The line that turns load ratios of a motor into loads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorCalibration {
    /// Load ratio of an unloaded actuator: friction.
    pub offset: f64,
    /// Load ratio per load.
    pub slope: f64,
    /// Standard deviation of one load ratio about the line of its unit.
    pub sigma: f64,
    /// Standard deviation of the offset from unit to unit.
    pub unit_offset_sd: f64,
    /// Standard deviation of the slope from unit to unit.
    pub unit_slope_sd: f64,
    /// Correlation of load ratio and load: how well the motor tells it.
    pub correlation: f64,
    /// Flights that taught it.
    pub flights: usize,
    /// Least and greatest load among them.
    pub loads: [f64; 2],
}

impl MotorCalibration {
    /// Learned from flights of several units that wing and motor tell of; `None` where they are too few, or the ratio does not
    /// follow the load.
    pub fn fit(units: &[Vec<LoadPair>]) -> Option<Self> {
        let all: Vec<LoadPair> = units.iter().flatten().copied().filter(LoadPair::is_finite).collect();
        let line = line(&all)?;
        if all.len() < MIN_FLIGHTS || line.slope <= 0.0 || line.correlation < MIN_CORRELATION {
            return None;
        }
        let own: Vec<RobustLine> =
            units.iter().filter(|unit| unit.len() >= MIN_UNIT_FLIGHTS).filter_map(|unit| self::line(unit)).collect();
        let known = own.len() >= MIN_UNITS;
        let loads = quantile::sorted(all.iter().map(|pair| pair.load).collect());
        Some(Self {
            offset: line.offset,
            slope: line.slope,
            sigma: median(own.iter().map(|unit| unit.sigma)).unwrap_or(line.sigma),
            unit_offset_sd: if known { apart(&own, |unit| (unit.offset, unit.offset_variance)) } else { 0.0 },
            unit_slope_sd: if known {
                apart(&own, |unit| (unit.slope, unit.slope_variance))
            } else {
                UNIT_SLOPE_SD * line.slope
            },
            correlation: line.correlation,
            flights: all.len(),
            loads: [loads[0], loads[loads.len() - 1]],
        })
    }

    /// The load of a flight whose load ratio is `ratio`; zero where the motor feels friction alone.
    pub fn load(&self, ratio: f64) -> f64 {
        ((ratio - self.offset) / self.slope).max(0.0)
    }

    /// Standard deviation of that load.
    pub fn load_sigma(&self, ratio: f64) -> f64 {
        let sloping = self.unit_slope_sd * self.load(ratio);
        let variance = self.sigma * self.sigma + self.unit_offset_sd * self.unit_offset_sd + sloping * sloping;
        variance.sqrt() / self.slope
    }
}

impl LoadPair {
    fn is_finite(&self) -> bool {
        self.load.is_finite() && self.ratio.is_finite()
    }
}

fn line(flights: &[LoadPair]) -> Option<RobustLine> {
    RobustLine::through(&flights.iter().map(|pair| (pair.load, pair.ratio)).collect::<Vec<_>>())
}

/// Standard deviation of what units have of their own, from values with their variances.
fn apart(units: &[RobustLine], of: impl Fn(&RobustLine) -> (f64, f64)) -> f64 {
    let Some(centre) = median(units.iter().map(|unit| of(unit).0)) else { return 0.0 };
    let size = median(units.iter().map(|unit| (of(unit).0 - centre).abs())).unwrap_or(0.0) / MEDIAN;
    let noise = median(units.iter().map(|unit| of(unit).1)).unwrap_or(0.0);
    (size * size - noise).max(0.0).sqrt()
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    quantile::median(&quantile::sorted(values.collect()))
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    /// Units whose offset and slope differ by `apart`, relative.
    fn units(count: usize, flights: usize, apart: f64, noise: f64) -> Vec<Vec<LoadPair>> {
        let mut stream = Stream::new(count as u64, &["motor"]);
        let mut unit = |_| {
            let [offset, slope] = [0.08, 0.3].map(|value| value * (1.0 + apart * stream.normal()));
            let mut flight = |_| {
                let load = 0.3 + 1.5 * stream.uniform();
                LoadPair { load, ratio: offset + slope * load + noise * stream.normal() }
            };
            (0..flights).map(&mut flight).collect()
        };
        (0..count).map(&mut unit).collect()
    }

    #[test]
    fn the_motor_tells_the_load_within_its_sigma() {
        let motor = MotorCalibration::fit(&units(100, 100, 0.04, 0.01)).unwrap();
        assert!((motor.offset - 0.08).abs() < 0.01 && (motor.slope - 0.3).abs() < 0.01, "{motor:?}");
        assert!((motor.sigma / 0.01 - 1.0).abs() < 0.1 && motor.correlation > 0.98, "{motor:?}");
        assert!((0.7..1.4).contains(&(motor.unit_slope_sd / 0.012)), "{motor:?}");
        assert!((0.7..1.4).contains(&(motor.unit_offset_sd / 0.0032)), "{motor:?}");
        let fresh = units(60, 40, 0.04, 0.01);
        let off = |pair: &LoadPair| (motor.load(pair.ratio) - pair.load) / motor.load_sigma(pair.ratio);
        let within = fresh.iter().flatten().filter(|pair| off(pair).abs() < 2.0).count() as f64 / 2400.0;
        assert!((0.9..0.99).contains(&within), "{within}");
    }

    #[test]
    fn alike_units_lie_apart_by_nothing_and_few_by_the_tolerance() {
        let motor = MotorCalibration::fit(&units(30, 100, 0.0, 0.01)).unwrap();
        assert!(motor.unit_slope_sd < 0.02 * motor.slope && motor.unit_offset_sd < 0.003, "{motor:?}");
        let motor = MotorCalibration::fit(&units(2, 100, 0.0, 0.01)).unwrap();
        assert_eq!(motor.unit_slope_sd, UNIT_SLOPE_SD * motor.slope);
    }

    #[test]
    fn a_motor_that_does_not_follow_the_load_and_too_few_flights_tell_nothing() {
        assert_eq!(MotorCalibration::fit(&units(10, 100, 0.0, 1.0)), None);
        assert_eq!(MotorCalibration::fit(&units(1, 49, 0.0, 0.01)), None);
        assert_eq!(MotorCalibration::fit(&[]), None);
        let mut falling = units(10, 100, 0.0, 0.01);
        falling.iter_mut().flatten().for_each(|pair| pair.ratio = -pair.ratio);
        assert_eq!(MotorCalibration::fit(&falling), None);
        let still = vec![vec![LoadPair { load: 1.0, ratio: 0.4 }; 100]; 6];
        assert_eq!(MotorCalibration::fit(&still), None);
    }

    #[test]
    fn it_is_kept_and_read_again() {
        let motor = MotorCalibration::fit(&units(6, 40, 0.04, 0.01)).unwrap();
        let json = serde_json::to_string(&motor).unwrap();
        assert_eq!(serde_json::from_str::<MotorCalibration>(&json).unwrap(), motor);
        assert_eq!(motor.load(0.0), 0.0);
    }
}
