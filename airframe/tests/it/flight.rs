//! Random flights: what they send follows from their truth, with the errors that were asked for.

use std::path::Path;

use airframe::{
    Flight, FlightSettings, HingeModel, HingeTarget, Layout, fbg, flight::GratingFailure, flight_products, hinge_rows,
    products::response, reference_beam, reference_configuration, strains,
};
use domain::{
    SensorConfiguration,
    sensor_configuration::{HingePosition, Side, Surface},
};
use numerics::Stream;

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
}

fn flights(configuration: &SensorConfiguration, settings: &FlightSettings, count: u64) -> Vec<Flight> {
    let flight = |i: u64| Flight::draw(configuration, settings, None, &Stream::new(i, &["flight"]));
    (0..count).map(flight).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Root mean square.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.map(|value| value * value)).sqrt()
}

#[test]
fn the_same_stream_gives_the_same_flight() {
    let configuration = reference_configuration(Layout::D);
    let draw = |seed| Flight::draw(&configuration, &FlightSettings::hard(), None, &Stream::new(seed, &["tail", "u1"]));
    assert_eq!(draw(1), draw(1));
    assert_ne!(draw(1), draw(2));
}

#[test]
fn truth_is_the_linear_model_of_both_wings() {
    let configuration = reference_configuration(Layout::D);
    for flight in flights(&configuration, &FlightSettings::hard(), 50) {
        assert_eq!(flight.strains, strains(&configuration.strain_map, &flight.products));
        assert_eq!(flight.right.flap_nm, response(&configuration.hinge_rows.flap, &flight.products));
        assert_eq!(flight.right.aileron_nm, response(&configuration.hinge_rows.aileron, &flight.products));
        assert_eq!(flight.left.flap_nm, flight.right.flap_nm);
        assert_eq!(flight.left.aileron_nm, -flight.right.aileron_nm);
        for (position, expected) in [
            ("AIL-L", flight.left.aileron_nm),
            ("AIL-R", flight.right.aileron_nm),
            ("FLAP-L", flight.left.flap_nm),
            ("FLAP-R", flight.right.flap_nm),
        ] {
            let position = configuration.positions[&position.parse().unwrap()];
            assert_eq!(flight.hinge_moment_nm(position), Some(expected));
        }
    }
    let nowhere = HingePosition { surface: Surface::None, side: Side::Left };
    assert_eq!(flights(&configuration, &FlightSettings::hard(), 1)[0].hinge_moment_nm(nowhere), None);
}

/// Mean and spread of the products of 100 independent training cases, within four standard errors.
#[test]
fn conditions_are_spread_as_the_prototypes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/loads/train_conditions.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        [x[1], x[1] * x[2], x[1] * x[3] / x[0], x[1] * x[4], x[1] * x[5]]
    };
    let cases: Vec<[f64; 5]> = text.lines().skip(1).map(row).collect();
    let flights = flights(&reference_configuration(Layout::D), &FlightSettings::as_modelled(), 4000);
    for j in 0..5 {
        let (expected, drawn) = (mean(cases.iter().map(|z| z[j])), mean(flights.iter().map(|f| f.products[j])));
        let spread = rms(flights.iter().map(|f| f.products[j] - drawn));
        close(drawn, expected, 4.0 * spread / 10.0);
        close(spread, rms(cases.iter().map(|z| z[j] - expected)), 0.25 * spread);
    }
}

/// As modelled, the air data are off by their standard errors alone.
#[test]
fn air_data_have_their_errors() {
    let settings = FlightSettings::as_modelled();
    let flights = flights(&reference_configuration(Layout::D), &settings, 4000);
    let error = |of: &dyn Fn(&Flight, f64) -> f64| rms(flights.iter().map(|f| of(f, f.products[0])));
    let degrees = f64::to_radians;
    close(error(&|f, q| f.air_data.dynamic_pressure_pa / q - 1.0), 0.01, 5e-4);
    let [alpha, flap, aileron] = [
        error(&|f, q| f.air_data.angle_of_attack_rad - f.products[1] / q),
        error(&|f, q| f.air_data.flap_rad - f.products[3] / q),
        error(&|f, q| f.air_data.aileron_rad - f.products[4] / q),
    ];
    close(alpha, degrees(0.3), degrees(0.015));
    close(flap, degrees(0.2), degrees(0.01));
    close(aileron, degrees(0.2), degrees(0.01));
    let airspeed_m_s = |q: f64| (2.0 * q / 1.225).sqrt();
    close(error(&|f, q| f.air_data.roll_rate_rad_s - f.products[2] / q * airspeed_m_s(q)), 0.005, 2.5e-4);
    for flight in &flights {
        let air = &flight.air_data;
        close(air.airspeed_m_s, airspeed_m_s(air.dynamic_pressure_pa), 1e-12);
        close(flight_products(air)[4], air.dynamic_pressure_pa * air.aileron_rad, 1e-12);
    }
}

/// With the true temperature a grating shows its strain within gain noise and a picometre; the free
/// grating shows the temperature within 0.3 K and a picometre.
#[test]
fn wavelengths_show_strain_and_temperature() {
    let mut configuration = reference_configuration(Layout::A);
    configuration.strain_gratings[4].tare = 30e-6;
    let flights = flights(&configuration, &FlightSettings::as_modelled(), 2000);
    let (mut strain_errors, mut temperature_errors) = (Vec::new(), Vec::new());
    for flight in &flights {
        let rises_k = flight.temperature_rises_k;
        for (i, grating) in configuration.strain_gratings.iter().enumerate() {
            let wavelength_nm = flight.strain.wavelengths_nm[i].unwrap();
            let shown = fbg::strain(grating.wavelength_nm, wavelength_nm, rises_k[grating.station]) - grating.tare;
            let picometre = 1e-3 / (0.78 * grating.wavelength_nm);
            let sd = (1e-2 * flight.strains[i]).hypot(picometre);
            strain_errors.push((shown - flight.strains[i]) / sd);
        }
        for (station, rise_k) in rises_k.into_iter().enumerate() {
            let wavelength_nm = flight.strain.temperature_wavelengths_nm[station].unwrap();
            temperature_errors.push(fbg::temperature_rise_k(1562.0, wavelength_nm) - rise_k);
        }
        assert_eq!(flight.failure, None);
    }
    close(rms(strain_errors.into_iter()), 1.0, 0.02);
    close(rms(temperature_errors.into_iter()), 0.3_f64.hypot(1e-3 / (1562.0 * 6.65e-6)), 0.01);
}

/// The hard set: effectiveness 15 % off, gusts of a degree that the vane misses, temperatures from
/// -60 to 25 K, and failures in 30 % of flights.
#[test]
fn hard_flights_depart_from_the_model_as_asked() {
    let settings = FlightSettings::hard();
    let flights = flights(&reference_configuration(Layout::D), &settings, 4000);
    let ratio = |j: usize, measured: fn(&Flight) -> f64| {
        // Where the deflection is large its measurement error does not count.
        let large = flights.iter().filter(move |f| measured(f).abs() > 0.2);
        rms(large.map(move |f| f.products[j] / f.products[0] / measured(f) - 1.0))
    };
    close(ratio(3, |f| f.air_data.flap_rad), 0.15, 0.01);
    close(ratio(4, |f| f.air_data.aileron_rad), 0.15, 0.01);
    let missed = |f: &Flight| f.products[1] / f.products[0] - f.air_data.angle_of_attack_rad;
    close(rms(flights.iter().map(missed)).to_degrees(), 1.0_f64.hypot(0.3), 0.05);
    let rises = flights.iter().map(|f| f.temperature_rises_k.iter().sum::<f64>() / 4.0);
    close(mean(rises.clone()), -17.5, 1.5);
    close(rms(rises.map(|rise_k| rise_k + 17.5)), 85.0 / 12.0_f64.sqrt(), 1.0);
    let failed = flights.iter().filter(|f| f.failure.is_some()).count() as f64 / flights.len() as f64;
    close(failed, 0.3, 0.03);
}

/// Failures show in the wavelength as they should.
#[test]
fn failed_gratings_show_nothing_half_or_a_bias() {
    let configuration = reference_configuration(Layout::D);
    let settings = FlightSettings { gain_noise: 0.0, failure_probability: 1.0, ..FlightSettings::hard() };
    let mut seen = [0; 3];
    for flight in flights(&configuration, &settings, 600) {
        let (i, failure) = flight.failure.unwrap();
        let grating = &configuration.strain_gratings[i];
        let rise_k = flight.temperature_rises_k[grating.station];
        let shown = fbg::strain(grating.wavelength_nm, flight.strain.wavelengths_nm[i].unwrap(), rise_k);
        let expected = match failure {
            GratingFailure::Dead => 0.0,
            GratingFailure::Debonded => 0.5 * flight.strains[i],
            GratingFailure::Biased => flight.strains[i] + 200e-6_f64.copysign(shown - flight.strains[i]),
        };
        close(shown, expected, 5e-6);
        seen[failure as usize] += 1;
    }
    assert!(seen.iter().all(|count| *count > 150), "{seen:?}");
}

/// A flight has the hinge moment that it is to have, as far as it can be flown, with either hinge model.
#[test]
fn targets_are_met_where_they_can_be() {
    let mut configuration = reference_configuration(Layout::D);
    let thin_airfoil = hinge_rows(reference_beam().lifting_line(), HingeModel::ThinAirfoil);
    let thesis = (configuration.hinge_rows.clone(), [(Surface::Flap, 400.0), (Surface::Aileron, 200.0)]);
    let settings = FlightSettings { effectiveness_sd: 0.05, ..FlightSettings::as_modelled() };
    for (rows, full_scale) in [thesis, (thin_airfoil, [(Surface::Flap, 90.0), (Surface::Aileron, 10.0)])] {
        configuration.hinge_rows = rows;
        for (surface, full_nm) in full_scale {
            for (seed, side) in [Side::Left, Side::Right].into_iter().cycle().take(200).enumerate() {
                let position = HingePosition { surface, side };
                let target = HingeTarget { position, size_nm: full_nm * (seed as f64 + 200.0) / 400.0 };
                let flight =
                    Flight::draw(&configuration, &settings, Some(&target), &Stream::new(seed as u64, &["aim"]));
                let moment_nm = flight.hinge_moment_nm(position).unwrap();
                close(moment_nm.abs(), target.size_nm, 0.03 * target.size_nm);
            }
        }
    }
}

/// Ailerons are asked to go either way, flaps down.
#[test]
fn targets_leave_ailerons_their_direction() {
    let configuration = reference_configuration(Layout::D);
    let up = |surface, size_nm| {
        let target = HingeTarget { position: HingePosition { surface, side: Side::Right }, size_nm };
        let draw = |seed| {
            Flight::draw(&configuration, &FlightSettings::as_modelled(), Some(&target), &Stream::new(seed, &["up"]))
        };
        (0..400).filter(|seed| draw(*seed).hinge_moment_nm(target.position).unwrap() < 0.0).count()
    };
    assert!((150..250).contains(&up(Surface::Aileron, 100.0)));
    assert_eq!(up(Surface::Flap, 200.0), 0);
}

/// What is out of reach is approached: the largest deflection at the highest speed.
#[test]
fn a_target_out_of_reach_is_approached() {
    let configuration = reference_configuration(Layout::D);
    let position = HingePosition { surface: Surface::Flap, side: Side::Left };
    let target = HingeTarget { position, size_nm: 5000.0 };
    let flight = Flight::draw(&configuration, &FlightSettings::as_modelled(), Some(&target), &Stream::new(3, &["far"]));
    let greatest_nm = 0.809_379 * 0.5 * 1.225 * 3600.0 * 20.0_f64.to_radians();
    close(flight.hinge_moment_nm(position).unwrap(), greatest_nm, 0.01);
}
