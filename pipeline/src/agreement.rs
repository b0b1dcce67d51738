//! Whether motor and wing of a life tell of the same loads, from its estimates.
//!
//! A function of the set of estimates and of the motor's calibration; told in the issued prognosis beside the forecast, which
//! does not rest on it.

use domain::{
    Disagreement, DisagreementKind, Estimate, HingeLoad, LoadAgreement, LoadSource, load_agreement::LoadsTold,
};
use prognosis::{
    JointFlight, LoadAgreement as Compared, MotorCalibration,
    load_agreement::{Change, ChangeKind, repeated},
};

use crate::loads::motor_ratio;

/// Points of the course that is told.
const POINTS: usize = 24;
/// Shares of flights of which a grating is left out, or strain not believed at all: usually, and where something is wrong.
const LEFT_OUT: [f64; 2] = [0.05, 0.5];
/// How sure it must be that they are left out again and again, nats.
const SURE: f64 = 9.0;

/// A flight of the air whose load wing and motor both tell.
struct Told<'a> {
    estimate: &'a Estimate,
    load: &'a HingeLoad,
    joint: JointFlight,
}

/// What motor and wing tell of the same flights; `None` where nothing can be compared. `estimates` are in the order of the life.
pub(crate) fn load_agreement(estimates: &[Estimate], motor: Option<&MotorCalibration>) -> Option<LoadAgreement> {
    let motor = motor?;
    let flown: Vec<&Estimate> = estimates.iter().filter(|estimate| !estimate.on_ground).collect();
    let told: Vec<Told> = flown.iter().filter_map(|estimate| Told::of(estimate)).collect();
    let flights: Vec<JointFlight> = told.iter().map(|told| told.joint).collect();
    let compared = Compared::of(&flights, motor)?;
    let mut disagreements: Vec<Disagreement> = compared.changes.iter().map(|change| changed(change, &told)).collect();
    disagreements.extend(compared.adrift_from.map(|from| adrift(from, &told)));
    disagreements.extend(strain(&flown));
    let slope = 1.0 + compared.slope.value;
    Some(LoadAgreement {
        flights: flights.len(),
        efficiency: 1.0 / slope,
        efficiency_sigma: compared.slope.sigma / (slope * slope),
        friction: compared.offset.value,
        friction_sigma: compared.offset.sigma,
        disagreements,
        course: course(&told, motor),
    })
}

impl<'a> Told<'a> {
    /// Of strain that is believed; air data alone know no gusts.
    fn of(estimate: &'a Estimate) -> Option<Self> {
        let load = estimate.load.as_ref().filter(|load| load.source != LoadSource::AirData)?;
        let ratio = motor_ratio(estimate)?;
        // abs(M) / ratio is the reference moment.
        let load_sigma = load.sigma_nm * load.ratio / load.hinge_moment_nm.abs().max(f64::MIN_POSITIVE);
        let joint = JointFlight { load: load.ratio, load_sigma, ratio };
        (load.ratio.is_finite() && load_sigma.is_finite() && ratio.is_finite()).then_some(Self {
            estimate,
            load,
            joint,
        })
    }
}

/// A change of the line between them.
fn changed(change: &Change, told: &[Told]) -> Disagreement {
    let first = told[change.from].estimate;
    let since = if change.from == 0 { "from its first flight on".to_owned() } else { since(first) };
    let Change { size: more, sigma, lead_nats, .. } = *change;
    let (percent, error) = (100.0 * more.abs(), 100.0 * sigma);
    let doubtful = if lead_nats < SURE { "; the loads flown since hardly tell the two apart" } else { "" };
    let (kind, size, sigma, detail) = match change.kind {
        ChangeKind::Efficiency if more > 0.0 => {
            let kept = 1.0 / (1.0 + more);
            let detail = format!(
                "{since} the motor works {percent:.1} +- {error:.1} % more for every moment of its surface: gears or \
                 linkage have lost {:.0} % of their efficiency, not friction{doubtful}",
                100.0 * (1.0 - kept)
            );
            (DisagreementKind::Efficiency, kept - 1.0, sigma * kept * kept, detail)
        }
        ChangeKind::Friction if more > 0.0 => {
            let detail = format!(
                "{since} the motor works as if {percent:.1} +- {error:.1} % of the reference load were added to every moment: \
                 friction, not efficiency{doubtful}"
            );
            (DisagreementKind::Friction, more, sigma, detail)
        }
        _ => {
            let detail = format!(
                "{since} the motor works {percent:.1} +- {error:.1} % of a load less than the wing tells, which no wear does: \
                 the wing is read by a wrong sensor configuration, or the actuator is another one"
            );
            (DisagreementKind::SensorConfiguration, -more.abs(), sigma, detail)
        }
    };
    disagreement(kind, first, (size, sigma), None, detail)
}

/// A motor that does not follow the wing.
fn adrift(from: usize, told: &[Told]) -> Disagreement {
    let (first, count) = (told[from].estimate, told.len() - from);
    let detail = format!(
        "{} the motor does not follow what the wing tells, in all {count} flights: the wing is read by a wrong sensor \
         configuration, or the actuator moves another surface",
        since(first)
    );
    disagreement(DisagreementKind::SensorConfiguration, first, (1.0, 0.0), None, detail)
}

/// Gratings that are left out again and again, and strain that is not believed.
fn strain(flown: &[&Estimate]) -> Vec<Disagreement> {
    let read: Vec<(&Estimate, &HingeLoad)> =
        flown.iter().filter_map(|estimate| Some((*estimate, estimate.load.as_ref()?))).collect();
    let unbelieved = |load: &HingeLoad| load.source == LoadSource::AirData && !load.excluded_sensors.is_empty();
    let found = |what: &dyn Fn(&HingeLoad) -> bool| {
        let from = repeated(read.iter().map(|(_, load)| what(load)), LEFT_OUT, SURE)?;
        let count = read.len() - from;
        let times = read[from..].iter().filter(|(_, load)| what(load)).count();
        let share = times as f64 / count as f64;
        Some((read[from].0, times, count, (share, (share * (1.0 - share) / count as f64).sqrt())))
    };
    let mut disagreements = Vec::new();
    if let Some((first, times, count, size)) = found(&unbelieved) {
        let detail = format!(
            "{} strain contradicted the air data in {times} of {count} flights: it is not believed",
            since(first)
        );
        disagreements.push(disagreement(DisagreementKind::SensorConfiguration, first, size, None, detail));
    }
    let most = read.iter().flat_map(|(_, load)| &load.excluded_sensors).max().copied();
    for grating in 0..=most.unwrap_or(0) {
        let left_out = |load: &HingeLoad| !unbelieved(load) && load.excluded_sensors.contains(&grating);
        let Some((first, times, count, size)) = found(&left_out) else { continue };
        let detail = format!("{} strain grating {grating} was left out in {times} of {count} flights", since(first));
        disagreements.push(disagreement(DisagreementKind::Grating, first, size, Some(grating), detail));
    }
    disagreements
}

fn disagreement(
    kind: DisagreementKind,
    first: &Estimate,
    (size, sigma): (f64, f64),
    grating: Option<u8>,
    detail: String,
) -> Disagreement {
    let (since_fh, since) = (first.flight_hours, first.recorded_at);
    Disagreement { kind, since_fh, since, size, sigma, grating, detail }
}

fn since(first: &Estimate) -> String {
    format!("since {:.0} fh", first.flight_hours)
}

/// The loads as both told them, as means of equally many flights.
fn course(told: &[Told], motor: &MotorCalibration) -> Vec<LoadsTold> {
    let mean = |flights: &[Told]| {
        let mean = |of: &dyn Fn(&Told) -> f64| flights.iter().map(of).sum::<f64>() / flights.len() as f64;
        LoadsTold {
            flight_hours: mean(&|told| told.estimate.flight_hours),
            wing: mean(&|told| told.load.ratio),
            motor: mean(&|told| motor.load(told.joint.ratio)),
        }
    };
    told.chunks(told.len().div_ceil(POINTS).max(1)).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use domain::{ContentHash, NUMERICS_VERSION, Outcome};
    use numerics::Stream;

    use super::*;

    const MOTOR: MotorCalibration = MotorCalibration {
        offset: 0.1,
        slope: 0.25,
        sigma: 0.005,
        unit_offset_sd: 0.0,
        unit_slope_sd: 0.0,
        correlation: 0.99,
        flights: 1000,
        loads: [0.3, 2.0],
    };

    /// A flight every four hours; `change` makes of the healthy one what was seen.
    fn life(flights: u32, change: impl Fn(u32, &mut Estimate)) -> Vec<Estimate> {
        let mut stream = Stream::new(5, &["agreement"]);
        let mut fly = |number: u32| {
            let ratio = 0.5 + stream.uniform();
            let recorded_at = "2026-03-01T12:00:00Z".parse::<domain::Timestamp>().unwrap();
            let mut estimate = Estimate {
                upload_id: format!("u{number:04}").parse().unwrap(),
                flight_hours: 4.0 * f64::from(number),
                recorded_at: recorded_at.plus_hours(12.0 * f64::from(number)),
                mask_id: None,
                model: ContentHash::of(b"model"),
                numerics_version: NUMERICS_VERSION,
                measurement: None,
                outcome: Outcome::Undiagnosable { valid_samples: 0, needed: 11 },
                load: Some(HingeLoad {
                    hinge_moment_nm: -180.0 * ratio,
                    sigma_nm: 2.0,
                    ratio,
                    source: LoadSource::StrainAndAirData,
                    excluded_sensors: Vec::new(),
                    sensor_configuration: ContentHash::of(b"sensors"),
                }),
                temperature: None,
                load_ratio: Some(MOTOR.offset + MOTOR.slope * ratio + MOTOR.sigma * stream.normal()),
                on_ground: false,
            };
            change(number, &mut estimate);
            estimate
        };
        (0..flights).map(&mut fly).collect()
    }

    fn found(estimates: &[Estimate]) -> Vec<Disagreement> {
        load_agreement(estimates, Some(&MOTOR)).unwrap().disagreements
    }

    #[test]
    fn a_healthy_life_agrees_and_its_course_is_told() {
        let agreement = load_agreement(&life(200, |_, _| ()), Some(&MOTOR)).unwrap();
        assert_eq!((agreement.flights, agreement.disagreements.len()), (200, 0));
        assert!((agreement.efficiency - 1.0).abs() < 4.0 * agreement.efficiency_sigma, "{agreement:?}");
        assert!((12..=POINTS).contains(&agreement.course.len()));
        assert!(agreement.course.iter().all(|told| (told.wing - told.motor).abs() < 0.05));
    }

    #[test]
    fn lost_efficiency_is_told_with_its_beginning_and_size() {
        let weak = |number, estimate: &mut Estimate| {
            let ratio = estimate.load_ratio.as_mut().unwrap();
            *ratio = if number < 100 { *ratio } else { MOTOR.offset + (*ratio - MOTOR.offset) / 0.85 };
        };
        let [lost] = found(&life(200, weak)).try_into().unwrap();
        assert_eq!((lost.kind, lost.since_fh), (DisagreementKind::Efficiency, 400.0));
        assert!((lost.size + 0.15).abs() < 4.0 * lost.sigma.max(0.003), "{lost:?}");
        assert!(lost.detail.starts_with("since 400 fh the motor works 17."), "{}", lost.detail);
    }

    #[test]
    fn less_work_than_the_wing_tells_is_no_wear() {
        let light = |_, estimate: &mut Estimate| estimate.load_ratio = estimate.load_ratio.map(|ratio| 0.7 * ratio);
        assert!(found(&life(100, light)).iter().all(|one| one.kind == DisagreementKind::SensorConfiguration));
        assert!(!found(&life(100, light)).is_empty());
    }

    #[test]
    fn gratings_left_out_and_strain_that_is_not_believed_are_told() {
        let gone = |number, estimate: &mut Estimate| {
            let load = estimate.load.as_mut().unwrap();
            load.excluded_sensors = if number >= 60 && number % 4 != 0 { vec![3] } else { Vec::new() };
        };
        let [grating] = found(&life(100, gone)).try_into().unwrap();
        assert_eq!((grating.kind, grating.grating), (DisagreementKind::Grating, Some(3)));
        assert_eq!(grating.detail, "since 244 fh strain grating 3 was left out in 30 of 39 flights");
        let disbelieved = |number, estimate: &mut Estimate| {
            let load = estimate.load.as_mut().unwrap();
            if number >= 50 {
                (load.source, load.excluded_sensors) = (LoadSource::AirData, vec![1, 2, 3]);
            }
        };
        let [strain] = found(&life(100, disbelieved)).try_into().unwrap();
        assert_eq!((strain.kind, strain.grating), (DisagreementKind::SensorConfiguration, None));
        assert_eq!((strain.since_fh, strain.size), (200.0, 1.0));
    }

    #[test]
    fn nothing_is_compared_without_a_calibration_or_flights_that_both_tell_of() {
        let healthy = life(100, |_, _| ());
        assert_eq!(load_agreement(&healthy, None), None);
        assert_eq!(load_agreement(&life(100, |_, estimate| estimate.on_ground = true), Some(&MOTOR)), None);
        assert_eq!(load_agreement(&life(100, |_, estimate| estimate.load = None), Some(&MOTOR)), None);
        assert_eq!(load_agreement(&life(100, |_, estimate| estimate.load_ratio = None), Some(&MOTOR)), None);
        assert_eq!(load_agreement(&[], Some(&MOTOR)), None);
    }
}
