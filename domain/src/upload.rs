//! One upload: what an aircraft knows of one actuator after one flight.

use serde::{Deserialize, Serialize};

use crate::{
    Component, ContentHash, Invalid, OperatorId, PartNumber, Position, Reading, SerialNumber, TailNumber, Timestamp,
    UploadId,
    range::{self, Ranges},
};

/// A checked upload. Its canonical JSON (see [`Upload::content_hash`]) decides whether a second
/// upload of the same id is a duplicate or a conflict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Upload {
    /// The aircraft that sends.
    pub tail: TailNumber,
    /// The upload's name.
    pub upload_id: UploadId,
    /// Where the actuator is installed.
    pub position: Position,
    /// Its part number.
    pub part_number: PartNumber,
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// The component's hours since new, never reset.
    pub flight_hours: f64,
    /// The component's cycles since new.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub flight_cycles: Option<u64>,
    /// When it was measured.
    pub recorded_at: Timestamp,
    /// What was measured or diagnosed.
    #[serde(flatten)]
    pub reading: Reading,
    /// Wing strain.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub strain: Option<Strain>,
    /// Flight condition.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub air_data: Option<AirData>,
    /// Ambient temperature, degrees Celsius.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub temperature_c: Option<f64>,
    /// Winding temperature, degrees Celsius.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub winding_temperature_c: Option<f64>,
    /// Whether the aircraft was on the ground.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub on_ground: Option<bool>,
}

/// Wavelengths of the fibre Bragg gratings, nm; null for a missing peak.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = StrainBody))]
pub struct Strain {
    /// Strain gratings.
    #[cfg_attr(feature = "schema", schema(min_items = 12, max_items = 12))]
    pub wavelengths_nm: Vec<Option<f64>>,
    /// Free temperature gratings.
    #[cfg_attr(feature = "schema", schema(min_items = 4, max_items = 4))]
    pub temperature_wavelengths_nm: Vec<Option<f64>>,
}

/// The flight condition, SI units and radians.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = AirDataBody))]
pub struct AirData {
    /// Dynamic pressure, Pa.
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 1000000))]
    pub dynamic_pressure_pa: f64,
    /// True airspeed, m/s.
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 3000))]
    pub airspeed_m_s: f64,
    /// Angle of attack, rad.
    #[cfg_attr(feature = "schema", schema(minimum = -1.6, maximum = 1.6))]
    pub angle_of_attack_rad: f64,
    /// Roll rate, rad/s.
    #[cfg_attr(feature = "schema", schema(minimum = -20, maximum = 20))]
    pub roll_rate_rad_s: f64,
    /// Flap deflection, rad.
    #[cfg_attr(feature = "schema", schema(minimum = -1.6, maximum = 1.6))]
    pub flap_rad: f64,
    /// Aileron deflection, rad.
    #[cfg_attr(feature = "schema", schema(minimum = -1.6, maximum = 1.6))]
    pub aileron_rad: f64,
}

/// Strain gratings per wing.
pub const STRAIN_SENSORS: usize = 12;
/// Temperature gratings per wing.
pub const TEMPERATURE_SENSORS: usize = 4;

impl Upload {
    /// Who it is about.
    pub fn component(&self, operator: &OperatorId) -> Component {
        Component {
            operator: operator.clone(),
            part_number: self.part_number.clone(),
            serial_number: self.serial_number.clone(),
        }
    }

    /// The hash of the parsed content: equal over every transport.
    pub fn content_hash(&self) -> ContentHash {
        ContentHash::of_json(self)
    }

    /// Checks every range that needs no model; `of_reading` is what is wrong with the reading by the mask or the bundle
    /// that it is for.
    pub fn check(&self, of_reading: Invalid) -> Result<(), Invalid> {
        let mut ranges = Ranges::default();
        ranges.one("#/flight_hours", Some(self.flight_hours), range::FLIGHT_HOURS);
        ranges.one("#/flight_cycles", self.flight_cycles.map(|n| n as f64), range::FLIGHT_CYCLES);
        ranges.one("#/temperature_c", self.temperature_c, range::TEMPERATURE);
        ranges.one("#/winding_temperature_c", self.winding_temperature_c, range::WINDING_TEMPERATURE);
        of_reading.violations.into_iter().for_each(|violation| ranges.0.push(violation.pointer, violation.detail));
        if let Some(strain) = &self.strain {
            let nm = range::WAVELENGTH;
            ranges.list("#/strain/wavelengths_nm", &strain.wavelengths_nm, STRAIN_SENSORS, nm);
            let temperature = &strain.temperature_wavelengths_nm;
            ranges.list("#/strain/temperature_wavelengths_nm", temperature, TEMPERATURE_SENSORS, nm);
        }
        if let Some(air) = &self.air_data {
            ranges.one("#/air_data/dynamic_pressure_pa", Some(air.dynamic_pressure_pa), range::DYNAMIC_PRESSURE);
            ranges.one("#/air_data/airspeed_m_s", Some(air.airspeed_m_s), range::AIRSPEED);
            ranges.one("#/air_data/angle_of_attack_rad", Some(air.angle_of_attack_rad), range::ANGLE);
            ranges.one("#/air_data/roll_rate_rad_s", Some(air.roll_rate_rad_s), range::ROLL_RATE);
            ranges.one("#/air_data/flap_rad", Some(air.flap_rad), range::ANGLE);
            ranges.one("#/air_data/aileron_rad", Some(air.aileron_rad), range::ANGLE);
        }
        ranges.0.into_result(Some(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coordinate, LoadRatio, MapSamples, Mask};

    fn mask() -> Mask {
        Mask::new(Coordinate::ElectricalAngleRad, 360, vec![10, 20, 30]).unwrap()
    }

    fn upload() -> Upload {
        Upload {
            tail: "EC-MXA".parse().unwrap(),
            upload_id: "u1".parse().unwrap(),
            position: "AIL-L".parse().unwrap(),
            part_number: "EMA-500".parse().unwrap(),
            serial_number: "0001".parse().unwrap(),
            flight_hours: 12.5,
            flight_cycles: None,
            recorded_at: "2026-03-01T12:30:00Z".parse().unwrap(),
            reading: Reading::Samples(MapSamples {
                mask_id: mask().id(),
                samples: vec![Some(0.07), None, Some(0.08)],
                load_ratio: Some(LoadRatio::PerSample(vec![Some(0.1), None, Some(0.1)])),
                sample_noise: Some(0.01),
            }),
            strain: None,
            air_data: None,
            temperature_c: None,
            winding_temperature_c: None,
            on_ground: None,
        }
    }

    fn check(upload: &Upload) -> Result<(), Invalid> {
        upload.check(upload.reading.samples().unwrap().violations(&mask(), 0.0752))
    }

    fn pointers(upload: &Upload) -> Vec<String> {
        check(upload).unwrap_err().violations.into_iter().map(|v| v.pointer).collect()
    }

    #[test]
    fn a_missing_sample_is_accepted() {
        assert_eq!(check(&upload()), Ok(()));
        assert_eq!(upload().reading.samples().unwrap().valid(), 2);
    }

    #[test]
    fn every_violation_names_its_field() {
        let mut bad = upload();
        let samples = bad.reading.samples_mut().unwrap();
        samples.samples[2] = Some(f64::NAN);
        samples.load_ratio = Some(LoadRatio::PerSample(vec![None, None, Some(f64::INFINITY)]));
        bad.flight_hours = -1.0;
        assert_eq!(pointers(&bad), ["#/flight_hours", "#/samples/2", "#/load_ratio/2", "#/load_ratio/0"]);
        bad = upload();
        bad.reading.samples_mut().unwrap().samples.pop();
        assert_eq!(pointers(&bad), ["#/samples"]);
    }

    #[test]
    fn content_decides_the_hash() {
        let mut other = upload();
        assert_eq!(other.content_hash(), upload().content_hash());
        other.reading.samples_mut().unwrap().samples[0] = Some(0.07_f64.next_up());
        assert_ne!(other.content_hash(), upload().content_hash());
    }

    /// What is stored of uploads and hashed; it never changes, or all known uploads would be others.
    #[test]
    fn samples_and_faults_are_written_among_the_other_fields() {
        let id = mask().id();
        let head =
            r#"{"tail":"EC-MXA","upload_id":"u1","position":"AIL-L","part_number":"EMA-500","serial_number":"0001","#;
        let hours = r#""flight_hours":12.5,"recorded_at":"2026-03-01T12:30:00Z","#;
        let samples = r#""samples":[0.07,null,0.08],"load_ratio":[0.1,null,0.1],"sample_noise":0.01}"#;
        let written = format!(r#"{head}{hours}"mask_id":"{id}",{samples}"#);
        assert_eq!(serde_json::to_string(&upload()).unwrap(), written);
        assert_eq!(serde_json::from_str::<Upload>(&written).unwrap(), upload());
        let faults = r#""faults":{"k1":{"value":0.1,"sigma":0.01},"k2":{"value":1.0}},"temperature_c":5.0}"#;
        let own = serde_json::from_str::<Upload>(&format!("{head}{hours}{faults}")).unwrap();
        assert_eq!(own.reading.mask_id(), None);
        assert_eq!(serde_json::to_string(&own).unwrap(), format!("{head}{hours}{faults}"));
    }
}
