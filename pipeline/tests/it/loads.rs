//! Loads of uploads, by the bundle's sensor configuration and by a tail's own.

use airframe::{Flight, FlightSettings, HingeTarget};
use domain::{Estimate, HingeLoad, LoadSource, MapSamples, Reading, Upload};
use numerics::Stream;
use pipeline::{Bundle, LoadModel, Model};

fn model() -> Model {
    let mut bundle: Bundle = serde_json::from_slice(include_bytes!("../../../models/default.json")).unwrap();
    bundle.loads = Some(LoadModel::reference(1));
    Model::from_bytes(&bundle.to_bytes()).unwrap()
}

fn loads(model: &Model) -> &LoadModel {
    model.bundle().loads.as_ref().unwrap()
}

/// A flight in which the actuator at a position works against a multiple of its reference moment.
fn flight(model: &Model, position: &str, load: f64, number: u64) -> Flight {
    let LoadModel { sensor_configuration, references, .. } = loads(model);
    let reference_nm = if position.starts_with("AIL") { references.aileron_nm } else { references.flap_nm };
    let position = sensor_configuration.positions[&position.parse().unwrap()];
    let target = HingeTarget { position, size_nm: load * reference_nm };
    let stream = Stream::new(3, &["flight"]).substream(number);
    Flight::draw(sensor_configuration, &FlightSettings::as_modelled(), Some(&target), &stream)
}

fn upload(model: &Model, position: &str, flight: &Flight) -> Upload {
    let mask = &model.bundle().masks()[0];
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: "u1".parse().unwrap(),
        position: position.parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
        flight_hours: 12.5,
        flight_cycles: None,
        recorded_at: "2026-03-01T12:30:00Z".parse().unwrap(),
        reading: Reading::Samples(MapSamples {
            mask_id: mask.id(),
            samples: vec![Some(model.summary().k_nom); mask.len()],
            load_ratio: None,
            sample_noise: None,
        }),
        strain: Some(flight.strain.clone()),
        air_data: Some(flight.air_data.clone()),
        temperature_c: Some(-25.0),
        winding_temperature_c: None,
        on_ground: None,
    }
}

fn estimate(model: &Model, upload: &Upload) -> Estimate {
    model.estimate(upload, Some(&model.bundle().masks()[0]), None).unwrap()
}

fn load(model: &Model, upload: &Upload) -> HingeLoad {
    estimate(model, upload).load.expect("strain, air data and a listed position")
}

#[test]
fn the_load_relative_to_the_reference_of_its_surface_is_found_on_both_wings() {
    let model = model();
    for (number, position) in ["FLAP-L", "FLAP-R", "AIL-L", "AIL-R"].into_iter().enumerate() {
        for truth in [0.5, 1.0, 1.5] {
            let flight = flight(&model, position, truth, number as u64);
            let found = load(&model, &upload(&model, position, &flight));
            let moment_nm =
                flight.hinge_moment_nm(loads(&model).sensor_configuration.positions[&position.parse().unwrap()]);
            assert!((found.ratio - truth).abs() < 0.1, "{position} at {truth}: {found:?}");
            assert!((found.hinge_moment_nm - moment_nm.unwrap()).abs() < 5.0 * found.sigma_nm, "{found:?}");
            assert_eq!(found.source, LoadSource::StrainAndAirData);
            assert_eq!(found.sensor_configuration, loads(&model).sensor_configuration.id());
        }
    }
}

#[test]
fn what_is_not_sent_is_done_without_or_stays_unknown() {
    let model = model();
    let flight = flight(&model, "FLAP-L", 1.0, 9);
    let whole = upload(&model, "FLAP-L", &flight);
    let without_strain = Upload { strain: None, ..whole.clone() };
    let without_air = Upload { air_data: None, ..whole.clone() };
    assert_eq!(load(&model, &without_strain).source, LoadSource::AirData);
    assert_eq!(load(&model, &without_air).source, LoadSource::Strain);
    assert!(load(&model, &without_strain).sigma_nm > load(&model, &whole).sigma_nm);

    let neither = Upload { strain: None, air_data: None, temperature_c: None, ..whole.clone() };
    let elsewhere = Upload { position: "RUDDER".parse().unwrap(), ..whole };
    assert_eq!((estimate(&model, &neither).load, estimate(&model, &neither).temperature), (None, None));
    assert_eq!(estimate(&model, &elsewhere).load, None);
    assert_eq!(estimate(&model, &elsewhere).temperature, Some(-2.0));
}

#[test]
fn a_tail_is_read_by_its_own_configuration() {
    let model = model();
    let mut own = loads(&model).sensor_configuration.clone();
    let flight = flight(&model, "AIL-R", 1.0, 4);
    let mut upload = upload(&model, "AIL-R", &flight);
    // Every grating of this tail shows 50 microstrain without load, and the configuration says so.
    for (grating, wavelength) in own.strain_gratings.iter_mut().zip(&mut upload.strain.as_mut().unwrap().wavelengths_nm)
    {
        grating.tare = 50e-6;
        *wavelength = wavelength.map(|nm| nm + 0.78 * 50e-6 * grating.wavelength_nm);
    }
    let by_own = model.estimate(&upload, Some(&model.bundle().masks()[0]), Some(&own)).unwrap().load.unwrap();
    assert_eq!(by_own.sensor_configuration, own.id());
    assert!((by_own.ratio - 1.0).abs() < 0.1, "{by_own:?}");

    own.strain_map.pop();
    let refused = model.estimate(&upload, Some(&model.bundle().masks()[0]), Some(&own)).unwrap_err();
    assert!(refused.to_string().contains("#/strain_map"), "{refused}");
}

#[test]
fn a_bundle_of_before_loads_were_read_still_serves_and_knows_none() {
    let mut bundle = model().bundle().clone();
    bundle.loads = None;
    let bytes = bundle.to_bytes();
    assert!(!String::from_utf8_lossy(&bytes).contains("sensor_configuration"));
    let old = Model::from_bytes(&bytes).unwrap();
    let with_loads = model();
    let estimate = estimate(&old, &upload(&with_loads, "FLAP-L", &flight(&with_loads, "FLAP-L", 1.0, 1)));
    assert_eq!((estimate.load, estimate.temperature), (None, None));
}
