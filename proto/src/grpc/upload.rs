//! Uploads: proto3 has no null, so missing values are listed by index.

use std::collections::BTreeMap;

use domain::{
    AirData, Invalid, LoadRatio, MapSamples, OwnDiagnosis, OwnFault, PartNumber, Position, Reading, SerialNumber,
    Strain, Timestamp, Upload, UploadId, invalid,
};

use crate::{brought::Brought, v1};

/// The noun, or every field that cannot be one. Ranges and sizes are checked later, against the
/// mask or the bundle ([`Upload::check`]).
pub fn into_upload(request: v1::UploadRequest) -> Result<Upload, Invalid> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", request.tail.parse());
    let upload_id = invalid.check("#/upload_id", UploadId::admit(&request.upload_id));
    let position = invalid.check("#/position", Position::admit(&request.position));
    let part_number = invalid.check("#/part_number", PartNumber::admit(&request.part_number));
    let serial_number = invalid.check("#/serial_number", SerialNumber::admit(&request.serial_number));
    let flight_hours = required(&mut invalid, "#/flight_hours", request.flight_hours);
    let recorded_at = time(&mut invalid, "#/recorded_at", request.recorded_at);
    let has_samples = !(request.samples.is_empty() && request.missing.is_empty());
    let brought = Brought {
        mask_id: Some(request.mask_id).filter(|mask_id| !mask_id.is_empty()),
        load_ratio: load_ratio(&mut invalid, request.load_ratio, &request.missing, request.mean_load_ratio),
        samples: has_samples.then(|| with_missing(&mut invalid, "#/missing", request.samples, &request.missing)),
        sample_noise: request.sample_noise,
        faults: into_faults(&mut invalid, request.faults),
    };
    let reading = brought.into_reading(&mut invalid);
    let strain = request.strain.map(|strain| into_strain(&mut invalid, strain));
    let air_data = request.air_data.map(|air| into_air_data(&mut invalid, &air));
    let upload = (|| {
        Some(Upload {
            tail: tail?,
            upload_id: upload_id?,
            position: position?,
            part_number: part_number?,
            serial_number: serial_number?,
            flight_hours: flight_hours?,
            flight_cycles: request.flight_cycles,
            recorded_at: recorded_at?,
            reading: reading?,
            strain,
            air_data: air_data.flatten(),
            temperature_c: request.temperature_c,
            winding_temperature_c: request.winding_temperature_c,
            on_ground: request.on_ground,
        })
    })();
    invalid.into_result(upload)
}

fn required(invalid: &mut Invalid, pointer: &str, value: Option<f64>) -> Option<f64> {
    if value.is_none() {
        invalid.push(pointer, "missing");
    }
    value
}

/// To the microsecond, rounded down like a fraction of a second that is cut.
pub(super) fn time(invalid: &mut Invalid, pointer: &str, time: Option<prost_types::Timestamp>) -> Option<Timestamp> {
    let Some(time) = time else {
        invalid.push(pointer, "missing");
        return None;
    };
    // Through the text, so that one rule decides what is a time on either transport.
    invalid.check(pointer, time.to_string().parse())
}

/// `values`, those at the indices `missing` taken out.
fn with_missing(invalid: &mut Invalid, pointer: &str, values: Vec<f64>, missing: &[u32]) -> Vec<Option<f64>> {
    let mut values: Vec<Option<f64>> = values.into_iter().map(Some).collect();
    let length = values.len();
    for (i, &index) in missing.iter().enumerate() {
        match values.get_mut(index as usize) {
            Some(value) => *value = None,
            None => invalid.push(format!("{pointer}/{i}"), format!("index {index} is outside {length} values")),
        }
    }
    values
}

fn load_ratio(invalid: &mut Invalid, list: Vec<f64>, missing: &[u32], mean: Option<f64>) -> Option<LoadRatio> {
    match (list.is_empty(), mean) {
        (true, mean) => mean.map(LoadRatio::Mean),
        (false, None) => {
            // An index that is too large is reported with the samples.
            let within: Vec<u32> = missing.iter().copied().filter(|&index| (index as usize) < list.len()).collect();
            Some(LoadRatio::PerSample(with_missing(invalid, "#/missing", list, &within)))
        }
        (false, Some(_)) => {
            invalid.push("#/mean_load_ratio", "given although there is a load_ratio per sample");
            None
        }
    }
}

/// A map is absent when it is empty; a fault without a value is told, and left out.
fn into_faults(invalid: &mut Invalid, faults: BTreeMap<String, v1::OwnFault>) -> Option<OwnDiagnosis> {
    let is_given = !faults.is_empty();
    let faults = faults.into_iter().filter_map(|(name, v1::OwnFault { value, sigma })| {
        let value = required(invalid, &format!("#/faults/{}/value", invalid::step(&name)), value)?;
        Some((name, OwnFault { value, sigma }))
    });
    let faults: OwnDiagnosis = faults.collect();
    is_given.then_some(faults)
}

fn into_strain(invalid: &mut Invalid, strain: v1::Strain) -> Strain {
    let temperature = strain.temperature_wavelengths_nm;
    Strain {
        wavelengths_nm: with_missing(invalid, "#/strain/missing", strain.wavelengths_nm, &strain.missing),
        temperature_wavelengths_nm: with_missing(
            invalid,
            "#/strain/temperature_missing",
            temperature,
            &strain.temperature_missing,
        ),
    }
}

fn into_air_data(invalid: &mut Invalid, air: &v1::AirData) -> Option<AirData> {
    let dynamic_pressure_pa = required(invalid, "#/air_data/dynamic_pressure_pa", air.dynamic_pressure_pa);
    let airspeed_m_s = required(invalid, "#/air_data/airspeed_m_s", air.airspeed_m_s);
    let angle_of_attack_rad = required(invalid, "#/air_data/angle_of_attack_rad", air.angle_of_attack_rad);
    let roll_rate_rad_s = required(invalid, "#/air_data/roll_rate_rad_s", air.roll_rate_rad_s);
    let flap_rad = required(invalid, "#/air_data/flap_rad", air.flap_rad);
    let aileron_rad = required(invalid, "#/air_data/aileron_rad", air.aileron_rad);
    Some(AirData {
        dynamic_pressure_pa: dynamic_pressure_pa?,
        airspeed_m_s: airspeed_m_s?,
        angle_of_attack_rad: angle_of_attack_rad?,
        roll_rate_rad_s: roll_rate_rad_s?,
        flap_rad: flap_rad?,
        aileron_rad: aileron_rad?,
    })
}

/// The request that carries `upload`. A load ratio of a missing sample is not transmitted.
pub fn from_upload(upload: Upload) -> v1::UploadRequest {
    let request = match upload.reading {
        Reading::Samples(samples) => from_samples(samples),
        Reading::Own { faults } => v1::UploadRequest { faults: from_faults(faults), ..v1::UploadRequest::default() },
    };
    v1::UploadRequest {
        tail: upload.tail.into(),
        upload_id: upload.upload_id.into(),
        position: upload.position.into(),
        part_number: upload.part_number.into(),
        serial_number: upload.serial_number.into(),
        flight_hours: Some(upload.flight_hours),
        flight_cycles: upload.flight_cycles,
        recorded_at: Some(timestamp(upload.recorded_at)),
        strain: upload.strain.map(from_strain),
        air_data: upload.air_data.map(from_air_data),
        temperature_c: upload.temperature_c,
        winding_temperature_c: upload.winding_temperature_c,
        on_ground: upload.on_ground,
        ..request
    }
}

fn from_samples(reading: MapSamples) -> v1::UploadRequest {
    let (samples, missing) = listed(reading.samples);
    let (load_ratio, mean_load_ratio) = match reading.load_ratio {
        Some(LoadRatio::PerSample(list)) => (listed(list).0, None),
        Some(LoadRatio::Mean(mean)) => (Vec::new(), Some(mean)),
        None => (Vec::new(), None),
    };
    let (mask_id, sample_noise) = (reading.mask_id.into(), reading.sample_noise);
    v1::UploadRequest { mask_id, samples, missing, load_ratio, mean_load_ratio, sample_noise, ..Default::default() }
}

fn from_faults(faults: OwnDiagnosis) -> BTreeMap<String, v1::OwnFault> {
    let faults = faults.into_iter();
    faults.map(|(name, OwnFault { value, sigma })| (name, v1::OwnFault { value: Some(value), sigma })).collect()
}

fn from_strain(strain: Strain) -> v1::Strain {
    let (wavelengths_nm, missing) = listed(strain.wavelengths_nm);
    let (temperature_wavelengths_nm, temperature_missing) = listed(strain.temperature_wavelengths_nm);
    v1::Strain { wavelengths_nm, missing, temperature_wavelengths_nm, temperature_missing }
}

fn from_air_data(air: AirData) -> v1::AirData {
    v1::AirData {
        dynamic_pressure_pa: Some(air.dynamic_pressure_pa),
        airspeed_m_s: Some(air.airspeed_m_s),
        angle_of_attack_rad: Some(air.angle_of_attack_rad),
        roll_rate_rad_s: Some(air.roll_rate_rad_s),
        flap_rad: Some(air.flap_rad),
        aileron_rad: Some(air.aileron_rad),
    }
}

/// Values with zero where there is none, and the indices of those.
fn listed(values: Vec<Option<f64>>) -> (Vec<f64>, Vec<u32>) {
    let missing = values.iter().zip(0..).filter_map(|(value, index)| value.is_none().then_some(index)).collect();
    (values.into_iter().map(Option::unwrap_or_default).collect(), missing)
}

/// A time as protobuf has it.
pub(super) fn timestamp(time: Timestamp) -> prost_types::Timestamp {
    let micros = time.micros();
    let nanos = micros.rem_euclid(1_000_000) as i32 * 1000;
    prost_types::Timestamp { seconds: micros.div_euclid(1_000_000), nanos }
}

#[cfg(test)]
mod tests {
    use domain::ContentHash;

    use super::*;
    use crate::json::{self, UploadBody};

    const EVERY_FIELD: &str = r#"{"upload_id":"u1","position":"AIL-L","part_number":"EMA-500","serial_number":"0001",
        "flight_hours":12,"flight_cycles":7,"recorded_at":"2026-03-01T13:30:00.123456789+01:00",
        "mask_id":"ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        "samples":[0.07,null,0.08000000000000002],"load_ratio":[0.1,null,-0.1],"sample_noise":0.01,
        "strain":{"wavelengths_nm":[1550.1,null],"temperature_wavelengths_nm":[null,1540]},
        "air_data":{"dynamic_pressure_pa":1,"airspeed_m_s":2,"angle_of_attack_rad":0.3,"roll_rate_rad_s":4,
        "flap_rad":0.5,"aileron_rad":0.6},"temperature_c":-55,"winding_temperature_c":80.5,"on_ground":false}"#;

    fn request() -> v1::UploadRequest {
        v1::UploadRequest {
            tail: "EC-MXA".into(),
            upload_id: "u1".into(),
            position: "AIL-L".into(),
            part_number: "EMA-500".into(),
            serial_number: "0001".into(),
            flight_hours: Some(12.0),
            flight_cycles: Some(7),
            recorded_at: Some(prost_types::Timestamp { seconds: 1_772_368_200, nanos: 123_456_789 }),
            mask_id: ContentHash::of(b"abc").to_string(),
            samples: vec![0.07, f64::NAN, 0.08000000000000002],
            missing: vec![1],
            load_ratio: vec![0.1, 5.0, -0.1],
            mean_load_ratio: None,
            sample_noise: Some(0.01),
            strain: Some(v1::Strain {
                wavelengths_nm: vec![1550.1, 0.0],
                missing: vec![1],
                temperature_wavelengths_nm: vec![0.0, 1540.0],
                temperature_missing: vec![0],
            }),
            air_data: Some(v1::AirData {
                dynamic_pressure_pa: Some(1.0),
                airspeed_m_s: Some(2.0),
                angle_of_attack_rad: Some(0.3),
                roll_rate_rad_s: Some(4.0),
                flap_rad: Some(0.5),
                aileron_rad: Some(0.6),
            }),
            temperature_c: Some(-55.0),
            winding_temperature_c: Some(80.5),
            on_ground: Some(false),
            faults: BTreeMap::new(),
        }
    }

    fn pointers(request: v1::UploadRequest) -> Vec<String> {
        into_upload(request).unwrap_err().violations.into_iter().map(|v| v.pointer).collect()
    }

    #[test]
    fn both_transports_give_the_same_upload() {
        let body: UploadBody = json::parse(EVERY_FIELD.as_bytes()).unwrap();
        let over_json = body.into_upload("EC-MXA".parse().unwrap()).unwrap();
        let over_grpc = into_upload(request()).unwrap();
        assert_eq!(over_json, over_grpc);
        assert_eq!(over_json.content_hash(), over_grpc.content_hash());
    }

    #[test]
    fn there_and_back_changes_nothing() {
        let upload = into_upload(request()).unwrap();
        assert_eq!(into_upload(from_upload(upload.clone())), Ok(upload.clone()));
        let body = serde_json::to_vec(&UploadBody::from(upload.clone())).unwrap();
        let back = json::parse::<UploadBody>(&body).unwrap().into_upload(upload.tail.clone());
        assert_eq!(back, Ok(upload));
    }

    #[test]
    fn a_mean_load_ratio_is_a_number_in_json() {
        let mut upload = into_upload(request()).unwrap();
        upload.reading.samples_mut().unwrap().load_ratio = Some(LoadRatio::Mean(1.0));
        assert_eq!(into_upload(from_upload(upload.clone())), Ok(upload.clone()));
        let json = EVERY_FIELD.replace("[0.1,null,-0.1]", "1");
        let body: UploadBody = json::parse(json.as_bytes()).unwrap();
        assert_eq!(body.into_upload(upload.tail.clone()), Ok(upload));
    }

    #[test]
    fn every_field_at_fault_is_named() {
        let mut bad = request();
        bad.tail = "ec".into();
        bad.flight_hours = None;
        bad.recorded_at = None;
        bad.mask_id = "xyz".into();
        bad.missing = vec![0, 9];
        bad.mean_load_ratio = Some(0.1);
        bad.air_data.as_mut().unwrap().flap_rad = None;
        let expected = [
            "#/tail",
            "#/flight_hours",
            "#/recorded_at",
            "#/mean_load_ratio",
            "#/missing/1",
            "#/mask_id",
            "#/air_data/flap_rad",
        ];
        assert_eq!(pointers(bad), expected);
    }

    /// The good upload with an own diagnosis in the place of its samples, over both transports.
    fn own() -> (serde_json::Value, v1::UploadRequest) {
        let mut json: serde_json::Value = serde_json::from_str(EVERY_FIELD).unwrap();
        let body = json.as_object_mut().unwrap();
        ["mask_id", "samples", "load_ratio", "sample_noise"].into_iter().for_each(|field| drop(body.remove(field)));
        body.insert(
            "faults".into(),
            serde_json::json!({"k1": {"value": 0.1, "sigma": 0.02}, "crack": {"value": 12.0}}),
        );
        let faults = [("k1", Some(0.1), Some(0.02)), ("crack", Some(12.0), None)];
        let faults = faults.map(|(name, value, sigma)| (name.to_owned(), v1::OwnFault { value, sigma }));
        let without = v1::UploadRequest {
            mask_id: String::new(),
            samples: Vec::new(),
            missing: Vec::new(),
            load_ratio: Vec::new(),
            sample_noise: None,
            faults: faults.into(),
            ..request()
        };
        (json, without)
    }

    fn over_json(body: &serde_json::Value) -> Result<Upload, Invalid> {
        json::parse::<UploadBody>(body.to_string().as_bytes()).unwrap().into_upload("EC-MXA".parse().unwrap())
    }

    #[test]
    fn an_own_diagnosis_is_the_same_over_both_transports_and_back() {
        let (body, request) = own();
        let upload = over_json(&body).unwrap();
        assert_eq!(into_upload(request.clone()), Ok(upload.clone()));
        assert_eq!(from_upload(upload.clone()).faults, request.faults);
        assert_eq!(over_json(&serde_json::to_value(UploadBody::from(upload.clone())).unwrap()), Ok(upload));
    }

    #[test]
    fn an_upload_brings_samples_or_an_own_diagnosis() {
        let told = |outcome: Result<Upload, Invalid>| -> Vec<String> {
            outcome.unwrap_err().violations.into_iter().map(|v| v.pointer).collect()
        };
        let (mut body, mut request) = own();
        body["mask_id"] = "0".repeat(64).into();
        body["load_ratio"] = 0.1.into();
        body["sample_noise"] = 0.01.into();
        (request.mask_id, request.mean_load_ratio, request.sample_noise) = ("0".repeat(64), Some(0.1), Some(0.01));
        let of_samples = ["#/mask_id", "#/load_ratio", "#/sample_noise"];
        assert_eq!(
            (told(over_json(&body)), told(into_upload(request.clone()))),
            (of_samples.map(Into::into).into(), pointers(request.clone()))
        );
        (body["samples"], request.samples) = (serde_json::json!([]), vec![0.07]);
        assert_eq!(
            (told(over_json(&body)), pointers(request.clone())),
            (vec!["#/faults".into()], vec!["#/faults".into()])
        );
        body.as_object_mut().unwrap().retain(|field, _| field != "samples" && field != "faults");
        (request.samples, request.faults) = Default::default();
        assert_eq!((told(over_json(&body)), pointers(request)), (vec!["#/samples".into()], vec!["#/samples".into()]));
    }

    #[test]
    fn a_fault_without_a_value_is_named() {
        let (_, mut request) = own();
        request.faults.insert("k/2".into(), v1::OwnFault { value: None, sigma: Some(0.1) });
        assert_eq!(pointers(request), ["#/faults/k~12/value"]);
    }

    #[test]
    fn absurd_times_are_refused() {
        for seconds in [i64::MIN, -1, i64::MAX] {
            let mut bad = request();
            bad.recorded_at = Some(prost_types::Timestamp { seconds, nanos: i32::MAX });
            assert_eq!(pointers(bad), ["#/recorded_at"], "{seconds}");
        }
    }
}
