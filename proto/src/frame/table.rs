//! The bytes of a frame beside what they mean, for people.

use super::{
    ACTUATOR, Content, Frame, FrameError, MAC, Measured, MeasuredStrain,
    actuator::{COUNT, EXPONENT, FLAGS, SAMPLES},
    field::{AIR, FLIGHT_CYCLES, FLIGHT_HOURS, Field, NOISE, TEMPERATURE, WAVELENGTH, WINDING},
    scaled,
    strain::pointer,
};

/// Some bytes of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The place of the first one.
    pub at: usize,
    /// Their number.
    pub width: usize,
    /// The field that they tell.
    pub field: String,
    /// What they tell.
    pub value: String,
}

/// The rows of a frame, from its first byte to its last.
pub fn rows(frame: &Frame) -> Result<Vec<Row>, FrameError> {
    let mut rows = Vec::new();
    let mut row = |width: usize, field: &str, value: String| {
        let at = rows.last().map_or(0, |last: &Row| last.at + last.width);
        rows.push(Row { at, width, field: field.trim_start_matches("#/").to_owned(), value });
    };
    row(1, "layout", frame.bytes()[0].to_string());
    row(8, "key", frame.key().to_string());
    row(4, "counter", frame.counter().to_string());
    row(4, "recorded_at", frame.recorded_at().to_string());
    match frame.read()? {
        Content::Actuator(measured) => actuator(frame.bytes(), &measured, &mut row),
        Content::Strain(strain) => gratings(&strain, &mut row),
    }
    let (_, mac) = frame.bytes().split_at(frame.bytes().len() - MAC);
    row(MAC, "mac", hex::encode(mac));
    Ok(rows)
}

fn actuator(bytes: &[u8], measured: &Measured, row: &mut impl FnMut(usize, &str, String)) {
    debug_assert_eq!(bytes[0], ACTUATOR);
    let mut tell = |field: &Field, value: Option<f64>| {
        let unit = if field.range.unit == "degrees Celsius" { "C" } else { field.range.unit };
        row(field.width, field.pointer, value.map_or("-".to_owned(), |value| format!("{value} {unit}")));
    };
    tell(&FLIGHT_HOURS, Some(measured.flight_hours));
    tell(&FLIGHT_CYCLES, measured.flight_cycles.map(|cycles| cycles as f64));
    tell(&TEMPERATURE, measured.temperature_c);
    tell(&WINDING, measured.winding_temperature_c);
    tell(&NOISE, measured.sample_noise);
    let air = measured.air_data.as_ref().map(|air| {
        let flight = [air.dynamic_pressure_pa, air.airspeed_m_s, air.angle_of_attack_rad];
        [flight, [air.roll_rate_rad_s, air.flap_rad, air.aileron_rad]].concat()
    });
    for (i, field) in AIR.iter().enumerate() {
        tell(field, air.as_ref().map(|air| air[i]));
    }
    let (ground, exponent) = (["-", "false", "true"][usize::from(bytes[FLAGS] >> 6)], -i32::from(bytes[FLAGS] & 15));
    let form = ["none", "mean", "per sample"][usize::from(bytes[FLAGS] >> 4 & 3)];
    row(1, "flags", format!("on_ground {ground}, load_ratio {form}, its step 2^{exponent}"));
    row(1, "count", bytes[COUNT].to_string());
    row(1, "step", format!("2^{} V s/rad", bytes[EXPONENT] as i8));
    let packed = scaled::packed_length(measured.samples.len());
    row(packed, "samples", list(&measured.samples));
    let ratios = bytes.len() - MAC - SAMPLES - packed;
    let told = match &measured.load_ratio {
        None => "-".to_owned(),
        Some(domain::LoadRatio::Mean(ratio)) => ratio.to_string(),
        Some(domain::LoadRatio::PerSample(ratios)) => list(ratios),
    };
    row(ratios, "load_ratio", told);
}

fn gratings(measured: &MeasuredStrain, row: &mut impl FnMut(usize, &str, String)) {
    let strain = &measured.strain;
    let all = strain.wavelengths_nm.iter().chain(&strain.temperature_wavelengths_nm);
    for (i, wavelength) in all.enumerate() {
        row(WAVELENGTH.width, &pointer(i), wavelength.map_or("-".to_owned(), |nm| format!("{nm} nm")));
    }
}

fn list(values: &[Option<f64>]) -> String {
    let one = |value: &Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.5}"));
    values.iter().map(one).collect::<Vec<_>>().join(" ")
}
