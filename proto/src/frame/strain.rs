//! Layout 2: strain of the wing of one tail in one flight.

use domain::{
    FrameSubject, Invalid, Strain, Timestamp, Upload,
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};
use serde::Serialize;

use super::{Frame, FrameKey, HEAD, MAC, STRAIN, bytes::append, field::WAVELENGTH, head};

/// Bytes of the layout.
pub(super) const LENGTH: usize = HEAD + WAVELENGTH.width * (STRAIN_SENSORS + TEMPERATURE_SENSORS) + MAC;

/// Strain of the wing of one tail, measured at one time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredStrain {
    /// When it was measured, to the second.
    pub recorded_at: Timestamp,
    /// Wavelengths of the gratings.
    pub strain: Strain,
}

impl MeasuredStrain {
    /// The strain of an upload, where it has any.
    pub fn of(upload: &Upload, subject: &FrameSubject) -> Result<Option<Self>, Invalid> {
        let known = match subject {
            FrameSubject::Strain { tail } => tail,
            FrameSubject::Actuator { .. } => {
                return Err(Invalid::one("#", "the key speaks for an actuator, not for the strain of a tail"));
            }
        };
        if upload.tail != *known {
            return Err(Invalid::one("#/tail", format!("{} where the key speaks for {known}", upload.tail)));
        }
        let strain = |strain: &Strain| Self { recorded_at: upload.recorded_at, strain: strain.clone() };
        Ok(upload.strain.as_ref().map(strain))
    }

    /// The frame that says it, or the fields that no frame can say.
    pub fn frame(&self, counter: u32, key: &FrameKey) -> Result<Frame, Invalid> {
        let mut invalid = Invalid::default();
        let mut bytes = head(STRAIN, key, counter, self.recorded_at, &mut invalid);
        for (pointer, values, length) in self.lists() {
            if values.len() != length {
                invalid.push(pointer, format!("{} values where {length} are expected", values.len()));
            }
            for (i, value) in values.iter().enumerate() {
                let code = WAVELENGTH.code(*value, &format!("{pointer}/{i}"), &mut invalid);
                append(&mut bytes, code, WAVELENGTH.width);
            }
        }
        invalid.into_result(Some(bytes)).map(|bytes| Frame::written(bytes, key))
    }

    fn lists(&self) -> [(&'static str, &[Option<f64>], usize); 2] {
        let Strain { wavelengths_nm, temperature_wavelengths_nm } = &self.strain;
        [
            ("#/strain/wavelengths_nm", wavelengths_nm, STRAIN_SENSORS),
            ("#/strain/temperature_wavelengths_nm", temperature_wavelengths_nm, TEMPERATURE_SENSORS),
        ]
    }
}

/// What a frame of layout 2 says.
pub(super) fn read(frame: &Frame) -> Result<MeasuredStrain, Invalid> {
    let mut invalid = Invalid::default();
    let told = frame.bytes()[HEAD..LENGTH - MAC].chunks(WAVELENGTH.width).enumerate();
    let mut values: Vec<Option<f64>> =
        told.map(|(i, bytes)| WAVELENGTH.value(bytes, &pointer(i), &mut invalid)).collect();
    let temperature_wavelengths_nm = values.split_off(STRAIN_SENSORS);
    let strain = Strain { wavelengths_nm: values, temperature_wavelengths_nm };
    invalid.into_result(Some(MeasuredStrain { recorded_at: frame.recorded_at(), strain }))
}

/// The grating of a place in the frame.
pub(super) fn pointer(i: usize) -> String {
    match i.checked_sub(STRAIN_SENSORS) {
        None => format!("#/strain/wavelengths_nm/{i}"),
        Some(i) => format!("#/strain/temperature_wavelengths_nm/{i}"),
    }
}
