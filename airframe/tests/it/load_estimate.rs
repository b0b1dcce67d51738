//! What one load estimate promises: gaps, tares, new gratings, wings, and any input at all.

use crate::cases::{self, Case};
use airframe::{FlightEnvelope, LoadEstimate, LoadEstimator, LoadReading, fbg, products::flight_products};
use domain::{
    AirData, LoadSource, SensorConfiguration, Strain, Timestamp,
    sensor_configuration::{HingePosition, Side, Surface},
};
use proptest::prelude::*;

const AIR_DATA: AirData = AirData {
    dynamic_pressure_pa: 1800.0,
    airspeed_m_s: 54.2,
    angle_of_attack_rad: 0.06,
    roll_rate_rad_s: 0.2,
    flap_rad: 0.15,
    aileron_rad: -0.12,
};

fn configuration() -> SensorConfiguration {
    let mut configuration = cases::parameters(&cases::folder(), "D").configuration().expect("parameters");
    let places = [
        ("AIL-L", Surface::Aileron, Side::Left),
        ("AIL-R", Surface::Aileron, Side::Right),
        ("FLAP-L", Surface::Flap, Side::Left),
        ("ELEV", Surface::None, Side::Right),
    ];
    for (name, surface, side) in places {
        configuration.positions.insert(name.parse().expect("a position"), HingePosition { surface, side });
    }
    configuration
}

fn estimator(configuration: SensorConfiguration) -> LoadEstimator {
    LoadEstimator::new(configuration, Default::default(), None).expect("a valid configuration")
}

/// What the gratings would show in this flight condition without noise, 20 K below their references.
fn noiseless(configuration: &SensorConfiguration, air: &AirData) -> Case {
    let products = flight_products(air);
    let peak_nm = |i: usize| {
        let grating = &configuration.strain_gratings[i];
        let strain: f64 = configuration.strain_map[i].iter().zip(products).map(|(a, z)| a * z).sum();
        Some(fbg::wavelength_nm(grating.wavelength_nm, strain + grating.tare, -20.0))
    };
    Case {
        air_data: air.clone(),
        strain: Strain {
            wavelengths_nm: (0..12).map(peak_nm).collect(),
            temperature_wavelengths_nm: vec![Some(fbg::free_wavelength_nm(1562.0, -20.0)); 4],
        },
    }
}

fn reading(case: &Case) -> LoadReading<'_> {
    LoadReading { strain: Some(&case.strain), air_data: Some(&case.air_data), recorded_at: None }
}

fn estimate(estimator: &LoadEstimator, case: &Case) -> LoadEstimate {
    estimator.estimate(&reading(case)).expect("a load")
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{found} instead of {expected}");
}

#[test]
fn what_agrees_is_believed_and_narrows_the_air_data() {
    let estimator = estimator(configuration());
    let case = noiseless(&configuration(), &AIR_DATA);
    let fused = estimate(&estimator, &case);
    let alone = estimator.estimate(&LoadReading { strain: None, ..reading(&case) }).expect("a load");
    assert_eq!((fused.source, alone.source), (LoadSource::StrainAndAirData, LoadSource::AirData));
    assert!(fused.excluded_sensors.is_empty());
    for (k, expected) in flight_products(&AIR_DATA).into_iter().enumerate() {
        close(fused.products[k], expected);
        close(alone.products[k], expected);
        assert!(fused.covariance[k][k] < alone.covariance[k][k], "product {k}");
    }
}

#[test]
fn a_tare_is_taken_off() {
    let mut configuration = configuration();
    configuration.strain_gratings[4].tare = 300e-6;
    configuration.strain_gratings[9].tare = -150e-6;
    let case = noiseless(&configuration, &AIR_DATA);
    let found = estimate(&estimator(configuration), &case);
    assert!(found.excluded_sensors.is_empty());
    close(found.products[4], flight_products(&AIR_DATA)[4]);
}

#[test]
fn missing_peaks_count_and_three_are_too_many() {
    let estimator = estimator(configuration());
    let sound = noiseless(&configuration(), &AIR_DATA);
    let mut case = sound.clone();
    case.strain.wavelengths_nm[7] = None;
    case.strain.wavelengths_nm[2] = Some(f64::NAN);
    let found = estimate(&estimator, &case);
    assert_eq!((found.excluded_sensors, found.source), (vec![2, 7], LoadSource::StrainAndAirData));
    // Five nanometres are the window.
    case.strain.wavelengths_nm[11] = Some(1552.0 + 5.1);
    let found = estimate(&estimator, &case);
    assert_eq!((found.excluded_sensors, found.source), (vec![2, 7, 11], LoadSource::AirData));
    assert_eq!(found.products, flight_products(&AIR_DATA));
    let mut case = sound;
    case.strain.temperature_wavelengths_nm[1] = None;
    let found = estimate(&estimator, &case);
    assert_eq!((found.excluded_sensors, found.source), (vec![3, 4, 5], LoadSource::AirData));
}

#[test]
fn gratings_that_contradict_the_rest_are_left_out_worst_first() {
    let estimator = estimator(configuration());
    let mut case = noiseless(&configuration(), &AIR_DATA);
    let shift = |strain: f64| 0.78 * strain * 1542.0;
    for (sensor, strain) in [(4, 300e-6), (10, -600e-6)] {
        *case.strain.wavelengths_nm[sensor].as_mut().expect("a peak") += shift(strain);
    }
    let found = estimate(&estimator, &case);
    assert_eq!((found.excluded_sensors, found.source), (vec![10, 4], LoadSource::StrainAndAirData));
    close(found.products[3], flight_products(&AIR_DATA)[3]);
    *case.strain.wavelengths_nm[7].as_mut().expect("a peak") += shift(400e-6);
    let found = estimate(&estimator, &case);
    assert_eq!((found.excluded_sensors.len(), found.source), (2, LoadSource::AirData));
}

/// Flights around [`AIR_DATA`].
fn envelope() -> FlightEnvelope {
    let covariance = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e4 } else { 0.0 }));
    FlightEnvelope { mean: [1800.0, 100.0, 5.0, 250.0, -50.0], covariance }
}

fn with_envelope() -> LoadEstimator {
    LoadEstimator::new(configuration(), Default::default(), Some(envelope())).expect("valid")
}

fn near_the_truth(found: &LoadEstimate) -> bool {
    let truth = flight_products(&AIR_DATA);
    (0..5).all(|k| (found.products[k] - truth[k]).abs() <= 5.0 * found.covariance[k][k].sqrt())
}

#[test]
fn gratings_that_agree_with_one_another_are_believed_against_the_air_data() {
    let mut case = noiseless(&configuration(), &AIR_DATA);
    // Dynamic pressure in hPa, and no airspeed that would betray it.
    case.air_data = AirData { dynamic_pressure_pa: 18.0, airspeed_m_s: 0.0, ..AIR_DATA };
    case.strain.wavelengths_nm[11] = None;
    let found = estimate(&with_envelope(), &case);
    assert_eq!((found.excluded_sensors.as_slice(), found.source), (&[11][..], LoadSource::Strain));
    assert!(near_the_truth(&found), "{found:?}");
    assert_eq!(estimate(&estimator(configuration()), &case).source, LoadSource::AirData);
    // Gratings that agree with nothing leave the air data as they are.
    for (sensor, shift_nm) in [(1, 0.5), (4, -0.4), (7, 0.6), (9, -0.7)] {
        *case.strain.wavelengths_nm[sensor].as_mut().expect("a peak") += shift_nm;
    }
    assert_eq!(estimate(&with_envelope(), &case).source, LoadSource::AirData);
}

#[test]
fn air_data_of_no_air_are_none() {
    let sound = noiseless(&configuration(), &AIR_DATA);
    // hPa, kPa read as Pa, no pressure in flight, and knots of another aircraft.
    for (q, v) in [(18.0, 54.2), (1.8, 54.2), (0.0, 54.2), (1800.0, 25.0), (1800.0, 540.0)] {
        let air_data = AirData { dynamic_pressure_pa: q, airspeed_m_s: v, ..AIR_DATA };
        let case = Case { air_data, ..sound.clone() };
        let found = estimate(&with_envelope(), &case);
        assert_eq!(found.source, LoadSource::Strain);
        assert!(near_the_truth(&found), "{found:?}");
        assert_eq!(with_envelope().estimate(&LoadReading { strain: None, ..reading(&case) }), None);
    }
    // At high altitude, and on the ground, where instruments show anything.
    for (q, v) in [(1800.0, 200.0), (3.0, 9.0), (60.0, 3.0)] {
        let air_data = AirData { dynamic_pressure_pa: q, airspeed_m_s: v, ..AIR_DATA };
        let case = Case { air_data, ..sound.clone() };
        let alone = with_envelope().estimate(&LoadReading { strain: None, ..reading(&case) });
        assert_eq!(alone.map(|alone| alone.source), Some(LoadSource::AirData));
    }
}

/// A grating bonded yesterday has settled by 40 microstrain: in quarantine it says little, and is not
/// accused; the same shift of an old one is.
#[test]
fn a_newly_bonded_grating_says_little() {
    let bonded_at: Timestamp = "2026-03-01T00:00:00Z".parse().expect("a time");
    let mut configuration = configuration();
    configuration.strain_gratings[10].bonded_at = Some(bonded_at);
    let estimator = estimator(configuration.clone());
    let mut case = noiseless(&configuration, &AIR_DATA);
    *case.strain.wavelengths_nm[10].as_mut().expect("a peak") -= 0.78 * 40e-6 * 1542.0;
    let at = |days: f64| {
        let reading = LoadReading { recorded_at: Some(bonded_at.plus_hours(24.0 * days)), ..reading(&case) };
        estimator.estimate(&reading).expect("a load")
    };
    for days in [-1.0, 1.0, 9.99] {
        assert!(at(days).excluded_sensors.is_empty(), "{days} days");
        let error = at(days).products[4] / flight_products(&AIR_DATA)[4] - 1.0;
        assert!(error.abs() < 0.02, "{days} days: {error}");
    }
    assert_eq!(at(10.0).excluded_sensors, [10]);
}

#[test]
fn effectiveness_scales_what_is_expected_of_a_deflection() {
    let mut configuration = configuration();
    configuration.effectiveness.flap = 0.8;
    configuration.effectiveness.aileron = 1.1;
    let found = estimator(configuration)
        .estimate(&LoadReading { air_data: Some(&AIR_DATA), ..LoadReading::default() })
        .expect("a load");
    let [q, q_alpha, q_roll, q_flap, q_aileron] = flight_products(&AIR_DATA);
    assert_eq!(found.products, [q, q_alpha, q_roll, 0.8 * q_flap, 1.1 * q_aileron]);
}

#[test]
fn a_position_has_the_load_of_its_surface_and_wing() {
    let estimator = estimator(configuration());
    let found = estimate(&estimator, &noiseless(&configuration(), &AIR_DATA));
    let load = |position: &str| estimator.hinge_load(&found, &position.parse().expect("a position"), 200.0);
    let [left, right, flap] = ["AIL-L", "AIL-R", "FLAP-L"].map(|position| load(position).expect("a load"));
    close(right.hinge_moment_nm, 0.579210 * 1800.0 * -0.12);
    assert_eq!((left.hinge_moment_nm, left.sigma_nm), (-right.hinge_moment_nm, right.sigma_nm));
    close(flap.hinge_moment_nm, 0.809379 * 1800.0 * 0.15);
    assert_eq!(left.ratio, left.hinge_moment_nm.abs() / 200.0);
    assert_eq!(left.sensor_configuration, configuration().id());
    assert_eq!((load("ELEV"), load("RUDDER")), (None, None));
    for reference_moment_nm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let position = "AIL-R".parse().expect("a position");
        assert_eq!(estimator.hinge_load(&found, &position, reference_moment_nm), None);
    }
}

/// A hinge moment that knows angle of attack and roll takes the left wing's roll the other way round.
#[test]
fn on_the_left_wing_roll_is_the_other_way_round() {
    let mut configuration = configuration();
    configuration.hinge_rows.aileron = [0.01, 0.2, 0.3, 0.4, 0.5];
    let estimator = estimator(configuration.clone());
    let mirrored =
        AirData { roll_rate_rad_s: -AIR_DATA.roll_rate_rad_s, aileron_rad: -AIR_DATA.aileron_rad, ..AIR_DATA.clone() };
    let [left, right] = [(AIR_DATA, Side::Left), (mirrored, Side::Right)].map(|(air, side)| {
        let found = estimate(&estimator, &noiseless(&configuration, &air));
        estimator.hinge_moment(&found, Surface::Aileron, side).expect("a moment").moment_nm
    });
    close(left, right);
}

#[test]
fn nothing_is_told_by_nothing() {
    let estimator = estimator(configuration());
    let case = noiseless(&configuration(), &AIR_DATA);
    assert_eq!(estimator.estimate(&LoadReading::default()), None);
    assert_eq!(estimator.estimate(&LoadReading { air_data: None, ..reading(&case) }), None);
    let still = AirData { dynamic_pressure_pa: 0.0, airspeed_m_s: 0.0, ..AIR_DATA };
    let found = estimate(&estimator, &noiseless(&configuration(), &still));
    assert_eq!(found.products, [0.0; 5]);
}

#[test]
fn a_wrong_configuration_is_refused() {
    let mut wrong = configuration();
    wrong.strain_map.pop();
    wrong.gain_noise = f64::NAN;
    let settings = airframe::EstimatorSettings { strain_floor: -1.0, ..Default::default() };
    let refused = |configuration, settings, envelope| {
        let invalid = LoadEstimator::new(configuration, settings, envelope).expect_err("refused");
        invalid.violations.into_iter().map(|violation| violation.pointer).collect::<Vec<_>>()
    };
    assert_eq!(refused(wrong, Default::default(), None), ["#/strain_map", "#/gain_noise"]);
    assert_eq!(refused(configuration(), settings, None), ["#/strain_floor"]);
    let mut envelope = FlightEnvelope { mean: [0.0; 5], covariance: [[0.0; 5]; 5] };
    envelope.covariance[1][2] = 1.0;
    assert_eq!(refused(configuration(), Default::default(), Some(envelope)), ["#/covariance/1/2", "#/covariance/2/1"]);
}

/// Any number at all, often an ordinary one.
fn any_near(ordinary: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => (0.98..1.02).prop_map(move |factor: f64| factor * ordinary),
        1 => proptest::num::f64::ANY,
        1 => Just(f64::MAX),
        1 => Just(0.0),
    ]
}

fn any_peaks(n: usize, ordinary_nm: f64) -> impl Strategy<Value = Vec<Option<f64>>> {
    let peak = prop_oneof![
        8 => (-4.0..4.0).prop_map(move |shift_nm: f64| Some(ordinary_nm + shift_nm)),
        1 => any_near(ordinary_nm).prop_map(Some),
        1 => Just(None),
    ];
    prop_oneof![9 => prop::collection::vec(peak.clone(), n), 1 => prop::collection::vec(peak, 0..n + 3)]
}

fn any_air_data() -> impl Strategy<Value = AirData> {
    let numbers = (any_near(1800.0), any_near(54.0), any_near(0.06), any_near(0.2), any_near(0.15), any_near(-0.12));
    numbers.prop_map(|(q, v, alpha, p, flap, aileron)| AirData {
        dynamic_pressure_pa: q,
        airspeed_m_s: v,
        angle_of_attack_rad: alpha,
        roll_rate_rad_s: p,
        flap_rad: flap,
        aileron_rad: aileron,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    /// No reading makes the estimator panic or tell a number that is none.
    #[test]
    fn every_reading_gives_finite_numbers_or_none(
        wavelengths_nm in any_peaks(12, 1542.0),
        temperature_wavelengths_nm in any_peaks(4, 1562.0),
        air_data in prop::option::of(any_air_data()),
        with_envelope in any::<bool>(),
    ) {
        let envelope = with_envelope.then(envelope);
        let mut configuration = configuration();
        for grating in &mut configuration.strain_gratings {
            grating.wavelength_nm = 1542.0;
        }
        let estimator = LoadEstimator::new(configuration, Default::default(), envelope).expect("valid");
        let strain = Strain { wavelengths_nm, temperature_wavelengths_nm };
        let reading = LoadReading { strain: Some(&strain), air_data: air_data.as_ref(), recorded_at: None };
        if let Some(found) = estimator.estimate(&reading) {
            prop_assert!(found.products.iter().chain(found.covariance.iter().flatten()).all(|x| x.is_finite()));
            prop_assert!(found.excluded_sensors.iter().all(|i| *i < 12));
            for side in [Side::Left, Side::Right] {
                if let Some(moment) = estimator.hinge_moment(&found, Surface::Flap, side) {
                    prop_assert!(moment.moment_nm.is_finite() && moment.sigma_nm.is_finite() && moment.sigma_nm >= 0.0);
                }
            }
            prop_assert_eq!(estimator.estimate(&reading), Some(found));
        }
    }
}
