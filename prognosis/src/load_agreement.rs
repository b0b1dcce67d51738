//! Whether motor and wing tell of the same load, and since when they do not.
//!
//! - What: changes of the line between load ratio and load within a life, against the motor's calibration: of its slope (the
//!   motor works more for every moment: efficiency) and of its offset (whatever the moment: friction).
//! - Update rule: residuals u = r - offset - slope L follow u = slope ((a + da) + (e + de) L) + noise; a and e are what units
//!   have of their own, normal with the spread of units; one of the changes da, de begins at one of the flights.
//!   Generalised likelihood ratio: over all beginnings and both kinds the greatest abs(z) of the change, by least
//!   squares with the unit's own a and e as nuisances. It is taken in if it is sure and large enough, and the next one
//!   is sought beside it. Flights that are far off their neighbours weigh nothing.
//! - Requirements: flights in the order of the life. A change that was there from the first flight on must stand out from
//!   the spread of units; a later one from the life itself.
//! - Source: Willsky, Jones 1976 for the test; Page 1954 for cumulative sums of repeated events.

use numerics::{Cholesky, RobustLine, Symmetric, quantile, symmetric::dot};

use crate::motor_load::{MEDIAN, MotorCalibration};

/// Flights from one candidate for the beginning of a change to the next, and the fewest flights behind one.
const STRIDE: usize = 5;
/// Least abs(z) of a change: of 2,000 healthy lives of 200 flights none gets there.
const SURE: f64 = 5.0;
/// Least change of the slope, relative, and of the offset, in reference loads, that is worth telling.
const LEAST: [f64; 2] = [0.08, 0.08];
/// Most changes of one life.
const MOST: usize = 3;
/// Units are never taken to be more alike than this, relative and in reference loads.
const LEAST_APART: f64 = 0.01;
/// Flights before or after one whose median tells whether it is far off, how far that is in standard deviations, and by how
/// much residuals may differ per difference of load because the slope has changed.
const NEIGHBOURS: usize = 5;
const FAR: f64 = 4.0;
const STEEP: f64 = 0.25;
/// Flights of a window over which the motor follows the wing or not.
const WINDOW: usize = 30;
/// Scatter about a window's own line, in expected standard deviations, from which on the motor does not follow.
const SCATTER: f64 = 3.0;

/// What wing and motor tell of one flight, and how well the wing does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFlight {
    /// Load by the wing.
    pub load: f64,
    /// Its standard deviation.
    pub load_sigma: f64,
    /// Load ratio of the motor.
    pub ratio: f64,
}

/// What has changed between hinge and motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeKind {
    /// The motor works more or less whatever the moment.
    Friction,
    /// The motor works more or less for every moment.
    Efficiency,
}

/// A change of the line of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// What has changed.
    pub kind: ChangeKind,
    /// First flight behind it.
    pub from: usize,
    /// By how much: of the slope relative to the calibration, of the offset in reference loads.
    pub size: f64,
    /// Standard deviation of the size.
    pub sigma: f64,
    /// How many nats likelier it is than the likeliest change of the other kind.
    pub lead_nats: f64,
}

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// How motor and wing compare at the newest flight, and how they came to that.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadAgreement {
    /// Slope now, relative to the calibration, less one.
    pub slope: Known,
    /// Offset now less that of the calibration, in reference loads.
    pub offset: Known,
    /// Changes that stand out, in the order of their finding.
    pub changes: Vec<Change>,
    /// First flight from which on the motor does not follow the wing at all.
    pub adrift_from: Option<usize>,
}

impl LoadAgreement {
    /// Compares flights in the order of a life with what the motor's calibration lets expect; `None` of fewer than five.
    pub fn of(flights: &[JointFlight], motor: &MotorCalibration) -> Option<Self> {
        let adrift_from = adrift(flights, motor);
        let followed = &flights[..adrift_from.unwrap_or(flights.len())];
        if flights.len() < STRIDE {
            return None;
        }
        let sums = Sums::of(followed, motor);
        let mut steps =
            vec![Step { from: 0, kind: ChangeKind::Friction }, Step { from: 0, kind: ChangeKind::Efficiency }];
        let mut found: Vec<(Step, f64)> = Vec::new();
        while let Some(next) = sums.fit(&steps, motor)?.change().filter(|_| found.len() < MOST) {
            steps.push(next.0);
            found.push(next);
        }
        let fit = sums.fit(&steps, motor)?;
        let changes = found.iter().enumerate().map(|(i, (step, lead_nats))| {
            let Known { value, sigma } = fit.value(|j| j == i + 2);
            Change { kind: step.kind, from: step.from, size: value, sigma, lead_nats: *lead_nats }
        });
        Some(Self {
            slope: fit.value(|j| steps[j].kind == ChangeKind::Efficiency),
            offset: fit.value(|j| steps[j].kind == ChangeKind::Friction),
            changes: changes.collect(),
            adrift_from,
        })
    }
}

/// First event of a run in which events are repeated again and again; `None` where they are not by now.
///
/// A cumulative sum of log-likelihood ratios of the shares `bad` against `usual`, never below zero, is at `sure` nats or more; it
/// goes no higher than twice that, so that good flights bring it down again.
pub fn repeated(events: impl Iterator<Item = bool>, [usual, bad]: [f64; 2], sure: f64) -> Option<usize> {
    let (seen, not) = (libm::log(bad / usual), libm::log((1.0 - bad) / (1.0 - usual)));
    let (mut sum, mut from) = (0.0, 0);
    for (index, event) in events.enumerate() {
        if sum == 0.0 {
            from = index;
        }
        sum = (sum + if event { seen } else { not }).clamp(0.0, 2.0 * sure);
    }
    (sum >= sure).then_some(from)
}

/// A column of the regression: one from some flight on, or the load.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    from: usize,
    kind: ChangeKind,
}

impl Step {
    /// Power of the load in it.
    fn power(self) -> usize {
        self.kind as usize
    }
}

/// Sums over all flights from each one on, in units of the calibration's slope.
struct Sums {
    /// Of w, w L and w L^2.
    loads: Vec<[f64; 3]>,
    /// Of w u and w u L.
    residuals: Vec<[f64; 2]>,
}

impl Sums {
    fn of(flights: &[JointFlight], motor: &MotorCalibration) -> Self {
        let residual = |flight: &JointFlight| (flight.ratio - motor.offset) / motor.slope - flight.load;
        let points: Vec<(f64, f64)> = flights.iter().map(|flight| (flight.load, residual(flight))).collect();
        let sigma = |flight: &JointFlight| libm::hypot(motor.sigma / motor.slope, flight.load_sigma).max(1e-6);
        let sigmas: Vec<f64> = flights.iter().map(sigma).collect();
        let near = near(&points, &sigmas);
        let mut sums = Self { loads: vec![[0.0; 3]; flights.len() + 1], residuals: vec![[0.0; 2]; flights.len() + 1] };
        for i in (0..flights.len()).rev() {
            let ((load, residual), weight) = (points[i], if near[i] { 1.0 / (sigmas[i] * sigmas[i]) } else { 0.0 });
            let powers = [1.0, load, load * load];
            sums.loads[i] = std::array::from_fn(|k| sums.loads[i + 1][k] + weight * powers[k]);
            sums.residuals[i] = std::array::from_fn(|k| sums.residuals[i + 1][k] + weight * powers[k] * residual);
        }
        sums
    }

    fn product(&self, a: Step, b: Step) -> f64 {
        self.loads[a.from.max(b.from)][a.power() + b.power()]
    }

    fn moment(&self, step: Step) -> f64 {
        self.residuals[step.from][step.power()]
    }

    /// Least squares with these columns, the first two of which are the unit's own; `None` where they cannot be told apart.
    fn fit<'a>(&'a self, steps: &'a [Step], motor: &MotorCalibration) -> Option<Fit<'a>> {
        let apart = [motor.unit_offset_sd, motor.unit_slope_sd].map(|sd| (sd / motor.slope).max(LEAST_APART));
        let mut information = Symmetric::diagonal(&vec![0.0; steps.len()]);
        for (i, a) in steps.iter().enumerate() {
            for (j, b) in steps.iter().enumerate() {
                information.add(i, j, self.product(*a, *b));
            }
            if let Some(apart) = apart.get(i) {
                information.add(i, i, 1.0 / (apart * apart));
            }
        }
        let factor = information.cholesky()?;
        let solution = factor.solve(&steps.iter().map(|step| self.moment(*step)).collect::<Vec<_>>());
        Some(Fit { sums: self, steps, factor, solution })
    }
}

/// A regression, ready for one more column.
struct Fit<'a> {
    sums: &'a Sums,
    steps: &'a [Step],
    factor: Cholesky,
    solution: Vec<f64>,
}

impl Fit<'_> {
    /// The sum of the coefficients that are chosen.
    fn value(&self, chosen: impl Fn(usize) -> bool) -> Known {
        let weights: Vec<f64> = (0..self.steps.len()).map(|j| if chosen(j) { 1.0 } else { 0.0 }).collect();
        let variance = dot(&weights, &self.factor.solve(&weights)).max(0.0);
        Known { value: dot(&weights, &self.solution), sigma: variance.sqrt() }
    }

    /// The likeliest change that is sure and large enough, with its lead over the other kind.
    fn change(&self) -> Option<(Step, f64)> {
        let flights = self.sums.loads.len() - 1;
        let candidates =
            |kind| (0..=flights.saturating_sub(STRIDE)).step_by(STRIDE).map(move |from| Step { from, kind });
        let best = |kind: ChangeKind| {
            let tried = candidates(kind).filter_map(|step| Some((step, self.add(step)?)));
            let large = tried.filter(|(_, change)| change.value.abs() >= LEAST[kind as usize]);
            let sure = |change: Known| change.value.abs() / change.sigma;
            large.map(|(step, change)| (step, sure(change))).max_by(|a, b| a.1.total_cmp(&b.1))
        };
        let [friction, efficiency] = [ChangeKind::Friction, ChangeKind::Efficiency].map(best);
        let z = |found: &Option<(Step, f64)>| found.map_or(0.0, |(_, z)| z);
        let lead = 0.5 * (z(&efficiency) * z(&efficiency) - z(&friction) * z(&friction));
        let found = if lead >= 0.0 { efficiency } else { friction };
        found.filter(|(_, z)| *z >= SURE).map(|(step, _)| (step, lead.abs()))
    }

    /// The coefficient of one more column; `None` where those before tell all of it.
    fn add(&self, step: Step) -> Option<Known> {
        let products: Vec<f64> = self.steps.iter().map(|other| self.sums.product(*other, step)).collect();
        let explained = dot(&products, &self.factor.solve(&products));
        let own = self.sums.product(step, step) - explained;
        let moment = self.sums.moment(step) - dot(&products, &self.solution);
        (own > 1e-9 * explained.abs().max(1.0)).then(|| Known { value: moment / own, sigma: 1.0 / own.sqrt() })
    }
}

/// Which flights are not far off both those before and those after them, (load, residual) by (load, residual).
fn near(points: &[(f64, f64)], sigmas: &[f64]) -> Vec<bool> {
    let near = |index: usize| {
        let (load, residual) = points[index];
        let after = index + 1..(index + 1 + NEIGHBOURS).min(points.len());
        let sides = [&points[index.saturating_sub(NEIGHBOURS)..index], &points[after]];
        sides.iter().filter(|side| 2 * side.len() > NEIGHBOURS).any(|side| {
            let (of_load, of_residual) = (median(side.iter().map(|p| p.0)), median(side.iter().map(|p| p.1)));
            (residual - of_residual).abs() <= FAR * sigmas[index] + STEEP * (load - of_load).abs()
        })
    };
    (0..points.len()).map(near).collect()
}

/// First flight from which on the scatter about its own line is that of a motor that does not follow.
fn adrift(flights: &[JointFlight], motor: &MotorCalibration) -> Option<usize> {
    let is_adrift = |window: &[JointFlight]| {
        let points: Vec<(f64, f64)> = window.iter().map(|flight| (flight.load, flight.ratio)).collect();
        let centre = median(points.iter().map(|point| point.1));
        let flat = || median(points.iter().map(|point| (point.1 - centre).abs())) / MEDIAN;
        let scatter = RobustLine::through(&points).map_or_else(flat, |line| line.sigma);
        let wing = median(window.iter().map(|flight| motor.slope * flight.load_sigma));
        scatter > SCATTER * libm::hypot(motor.sigma, wing)
    };
    let windows = flights.rchunks_exact(WINDOW).take_while(|window| is_adrift(window)).count();
    (windows > 0).then(|| flights.len() - windows * WINDOW)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile::median(&quantile::sorted(values.collect())).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    const MOTOR: MotorCalibration = MotorCalibration {
        offset: 0.1,
        slope: 0.24,
        sigma: 0.006,
        unit_offset_sd: 0.003,
        unit_slope_sd: 0.005,
        correlation: 0.99,
        flights: 10_000,
        loads: [0.3, 2.5],
    };

    /// Flights of a healthy unit whose slope and offset change by factors from some flight on.
    fn flights(unit: u64, count: usize, from: usize, [slope, offset]: [f64; 2]) -> Vec<JointFlight> {
        let mut stream = Stream::new(unit, &["agreement"]);
        let own_offset = MOTOR.offset + MOTOR.unit_offset_sd * stream.normal();
        let own_slope = MOTOR.slope + MOTOR.unit_slope_sd * stream.normal();
        let mut level = 0.0;
        let mut flight = |i: usize| {
            level = 0.9 * level + 0.1 * stream.normal();
            let load = 0.9 * libm::exp(level);
            let [slope, offset] = if i < from { [1.0, 1.0] } else { [slope, offset] };
            let ratio = offset * own_offset + slope * own_slope * load + MOTOR.sigma * stream.normal();
            let seen = load * (1.0 + 0.015 * stream.normal());
            // One strain in fifty is astray.
            let astray = if stream.uniform() < 0.02 { 0.5 } else { 0.0 };
            JointFlight { load: seen + astray, load_sigma: 0.015 * load, ratio }
        };
        (0..count).map(&mut flight).collect()
    }

    #[test]
    fn healthy_units_are_not_accused() {
        let accused = |unit: &u64| {
            let agreement = LoadAgreement::of(&flights(*unit, 200, 0, [1.0, 1.0]), &MOTOR).unwrap();
            !agreement.changes.is_empty() || agreement.adrift_from.is_some()
        };
        assert_eq!((0..2000).filter(accused).collect::<Vec<_>>(), Vec::<u64>::new());
    }

    #[test]
    fn a_loss_of_efficiency_is_dated_and_measured() {
        for from in [0, 60, 150] {
            let agreements =
                (0..100).map(|unit| LoadAgreement::of(&flights(unit, 200, from, [1.0 / 0.85, 1.0]), &MOTOR));
            let mut right = 0;
            for agreement in agreements {
                let agreement = agreement.unwrap();
                let Some(change) = agreement.changes.first() else { continue };
                let size = (change.size - (1.0 / 0.85 - 1.0)).abs();
                right += usize::from(
                    change.kind == ChangeKind::Efficiency
                        && change.from.abs_diff(from) <= 2 * STRIDE
                        && size < (4.0 * change.sigma).max(0.03),
                );
            }
            assert!(right >= 97, "{right} of 100 from {from}");
        }
    }

    #[test]
    fn more_friction_is_not_taken_for_a_loss_of_efficiency() {
        let mut right = 0;
        for unit in 0..100 {
            let agreement = LoadAgreement::of(&flights(unit, 200, 100, [1.0, 1.5]), &MOTOR).unwrap();
            let expected = 0.5 * MOTOR.offset / MOTOR.slope;
            let change = agreement.changes.first().expect("found");
            right +=
                usize::from(change.kind == ChangeKind::Friction && (change.size - expected).abs() < 0.1 * expected);
            assert!(agreement.slope.value.abs() < LEAST[1], "{agreement:?}");
        }
        assert!(right >= 95, "{right} of 100");
    }

    #[test]
    fn a_motor_that_follows_another_surface_is_adrift() {
        let (mut flights, other) = (flights(1, 200, 0, [1.0, 1.0]), flights(2, 200, 0, [1.0, 1.0]));
        assert_eq!(LoadAgreement::of(&flights, &MOTOR).unwrap().adrift_from, None);
        for (flight, other) in flights[120..].iter_mut().zip(&other) {
            flight.ratio = other.ratio;
        }
        let from = LoadAgreement::of(&flights, &MOTOR).unwrap().adrift_from.expect("adrift");
        assert!(from.abs_diff(120) <= WINDOW, "{from}");
    }

    #[test]
    fn too_few_flights_tell_nothing_and_equal_loads_still_compare() {
        assert_eq!(LoadAgreement::of(&flights(1, 4, 0, [1.0, 1.0]), &MOTOR), None);
        assert_eq!(LoadAgreement::of(&[], &MOTOR), None);
        let still = vec![JointFlight { load: 1.0, load_sigma: 0.01, ratio: 0.34 }; 40];
        let agreement = LoadAgreement::of(&still, &MOTOR).unwrap();
        assert!(agreement.changes.is_empty() && agreement.adrift_from.is_none(), "{agreement:?}");
    }

    #[test]
    fn events_count_as_repeated_when_they_are_frequent_and_no_longer_when_they_have_ceased() {
        let shares = [0.03, 0.5];
        let frequent = |from: usize, until: usize| (0..200).map(move |i| (from..until).contains(&i) && i % 2 == 0);
        assert_eq!(repeated(frequent(100, 200), shares, 9.0), Some(100));
        assert_eq!(repeated(frequent(100, 130), shares, 9.0), None);
        assert_eq!(repeated((0..500).map(|i| i % 40 == 0), shares, 9.0), None);
    }
}
