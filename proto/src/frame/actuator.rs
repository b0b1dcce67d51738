//! Layout 1: what one actuator measured.

use domain::{AirData, FrameSubject, Invalid, LoadRatio, MapSamples, Reading, Timestamp, Upload, range};
use serde::Serialize;

use super::{
    ACTUATOR, Frame, FrameKey, HEAD, MAC, MAX_BYTES,
    field::{AIR, FLIGHT_CYCLES, FLIGHT_HOURS, MEAN_RATIO, NOISE, TEMPERATURE, WINDING},
    head,
    scaled::{self, RATIO_CODES, RATIO_EXPONENTS, SAMPLE_CODES, SAMPLE_EXPONENTS},
};

/// The place of the flags: two bits for the ground, two for the form of the load ratio, four for its exponent.
pub(super) const FLAGS: usize = 42;
/// The place of the number of samples.
pub(super) const COUNT: usize = 43;
/// The place of the exponent of samples.
pub(super) const EXPONENT: usize = 44;
/// The place of the first sample.
pub(super) const SAMPLES: usize = 45;

/// What one actuator measured, without what the key tells of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// When it was measured, to the second.
    pub recorded_at: Timestamp,
    /// The component's hours since new.
    pub flight_hours: f64,
    /// The component's cycles since new.
    pub flight_cycles: Option<u64>,
    /// Back-EMF samples, V s/rad.
    pub samples: Vec<Option<f64>>,
    /// Load ratio.
    pub load_ratio: Option<LoadRatio>,
    /// Standard deviation of one sample, in units of k_nom.
    pub sample_noise: Option<f64>,
    /// Flight condition.
    pub air_data: Option<AirData>,
    /// Ambient temperature, degrees Celsius.
    pub temperature_c: Option<f64>,
    /// Winding temperature, degrees Celsius.
    pub winding_temperature_c: Option<f64>,
    /// Whether the aircraft was on the ground.
    pub on_ground: Option<bool>,
}

/// The form in which load ratios are told.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    None,
    Mean,
    PerSample,
}

impl Form {
    fn of(ratio: Option<&LoadRatio>) -> Self {
        match ratio {
            None => Self::None,
            Some(LoadRatio::Mean(_)) => Self::Mean,
            Some(LoadRatio::PerSample(_)) => Self::PerSample,
        }
    }

    fn in_flags(flags: u8) -> Option<Self> {
        [Self::None, Self::Mean, Self::PerSample].get(usize::from(flags >> 4 & 3)).copied()
    }

    fn width(self, count: usize) -> usize {
        match self {
            Self::None => 0,
            Self::Mean => MEAN_RATIO.width,
            Self::PerSample => count,
        }
    }
}

/// The bytes that a frame of this beginning has.
pub(super) fn length(bytes: &[u8]) -> usize {
    let [flags, count] = [FLAGS, COUNT].map(|at| bytes.get(at).copied().unwrap_or_default());
    let count = usize::from(count);
    // A form that there is not is told when the frame is read.
    let ratios = Form::in_flags(flags).map_or(0, |form| form.width(count));
    SAMPLES + scaled::packed_length(count) + ratios + MAC
}

impl Measured {
    /// What an upload says beside what the key tells; strain is another frame's.
    pub fn of(upload: &Upload, subject: &FrameSubject) -> Result<Self, Invalid> {
        let mut invalid = must_be_of(upload, subject);
        let samples = match &upload.reading {
            Reading::Samples(samples) => Some(samples.clone()),
            Reading::Own { .. } => {
                invalid.push("#/faults", "a frame carries samples, and no own diagnosis");
                None
            }
        };
        let measured = samples.map(|MapSamples { mask_id: _, samples, load_ratio, sample_noise }| Self {
            recorded_at: upload.recorded_at,
            flight_hours: upload.flight_hours,
            flight_cycles: upload.flight_cycles,
            samples,
            load_ratio,
            sample_noise,
            air_data: upload.air_data.clone(),
            temperature_c: upload.temperature_c,
            winding_temperature_c: upload.winding_temperature_c,
            on_ground: upload.on_ground,
        });
        invalid.into_result(measured)
    }

    /// The frame that says it, or the fields that no frame can say.
    pub fn frame(&self, counter: u32, key: &FrameKey) -> Result<Frame, Invalid> {
        let mut invalid = Invalid::default();
        let mut bytes = head(ACTUATOR, key, counter, self.recorded_at, &mut invalid);
        self.append_fields(&mut bytes, &mut invalid);
        self.append_samples(&mut bytes, &mut invalid);
        let length = bytes.len() + MAC;
        if length > MAX_BYTES {
            let count = self.samples.len();
            invalid.push("#/samples", format!("{count} samples make {length} bytes: a frame has {MAX_BYTES} at most"));
        }
        invalid.into_result(Some(bytes)).map(|bytes| Frame::written(bytes, key))
    }

    fn append_fields(&self, bytes: &mut Vec<u8>, invalid: &mut Invalid) {
        FLIGHT_HOURS.append(bytes, Some(self.flight_hours), invalid);
        FLIGHT_CYCLES.append(bytes, self.flight_cycles.map(|cycles| cycles as f64), invalid);
        TEMPERATURE.append(bytes, self.temperature_c, invalid);
        WINDING.append(bytes, self.winding_temperature_c, invalid);
        NOISE.append(bytes, self.sample_noise, invalid);
        let air = self.air_data.as_ref().map(|air| {
            let AirData { dynamic_pressure_pa: q, airspeed_m_s: v, .. } = air;
            [*q, *v, air.angle_of_attack_rad, air.roll_rate_rad_s, air.flap_rad, air.aileron_rad]
        });
        for (i, field) in AIR.iter().enumerate() {
            field.append(bytes, air.map(|air| air[i]), invalid);
        }
    }

    fn append_samples(&self, bytes: &mut Vec<u8>, invalid: &mut Invalid) {
        let (samples, ratio) = (&self.samples, self.load_ratio.as_ref());
        let exponent = scaled::exponent(samples, SAMPLE_CODES, SAMPLE_EXPONENTS, "#/samples", invalid);
        let ratio_exponent = match ratio {
            Some(LoadRatio::PerSample(ratios)) => self.ratio_exponent(ratios, invalid),
            _ => 0,
        };
        let ground = self.on_ground.map_or(0, |on_ground| 1 + u8::from(on_ground));
        bytes.push(ground << 6 | (Form::of(ratio) as u8) << 4 | ratio_exponent.unsigned_abs() as u8);
        bytes.push(u8::try_from(samples.len()).unwrap_or(u8::MAX));
        bytes.push(exponent as i8 as u8);
        scaled::pack(bytes, samples.iter().map(|sample| scaled::code(*sample, exponent, SAMPLE_CODES)));
        match ratio {
            None => {}
            Some(LoadRatio::Mean(ratio)) => MEAN_RATIO.append(bytes, Some(*ratio), invalid),
            Some(LoadRatio::PerSample(ratios)) => {
                let code = |ratio: &Option<f64>| scaled::code(*ratio, ratio_exponent, RATIO_CODES) as i8 as u8;
                bytes.extend(ratios.iter().map(code));
            }
        }
    }

    fn ratio_exponent(&self, ratios: &[Option<f64>], invalid: &mut Invalid) -> i32 {
        if ratios.len() != self.samples.len() {
            let (given, wanted) = (ratios.len(), self.samples.len());
            invalid.push("#/load_ratio", format!("{given} values where {wanted} are expected"));
        }
        for (i, ratio) in ratios.iter().enumerate() {
            if let Some(refusal) = ratio.and_then(|ratio| range::LOAD_RATIO.refusal(ratio)) {
                invalid.push(format!("#/load_ratio/{i}"), refusal);
            }
        }
        // What is out of range was noted.
        scaled::exponent(ratios, RATIO_CODES, RATIO_EXPONENTS, "#/load_ratio", &mut Invalid::default())
    }
}

/// What keeps a key from speaking for an upload.
fn must_be_of(upload: &Upload, subject: &FrameSubject) -> Invalid {
    let mut invalid = Invalid::default();
    let FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id } = subject else {
        invalid.push("#", "the key speaks for the strain of a tail, not for an actuator");
        return invalid;
    };
    let mask = upload.reading.mask_id();
    let mut compare = |pointer: &str, given: &str, known: &str| {
        if given != known {
            invalid.push(pointer, format!("{given} where the key speaks for {known}"));
        }
    };
    compare("#/tail", upload.tail.as_str(), tail.as_str());
    compare("#/position", upload.position.as_str(), position.as_str());
    compare("#/part_number", upload.part_number.as_str(), part_number.as_str());
    compare("#/serial_number", upload.serial_number.as_str(), serial_number.as_str());
    if let Some(mask) = mask {
        compare("#/mask_id", &mask.to_string(), &mask_id.to_string());
    }
    invalid
}

/// What a frame of layout 1 says.
pub(super) fn read(frame: &Frame) -> Result<Measured, Invalid> {
    let (bytes, mut invalid) = (frame.bytes(), Invalid::default());
    let count = usize::from(bytes[COUNT]);
    let flight_hours = FLIGHT_HOURS.read(bytes, &mut invalid);
    let flags = bytes[FLAGS];
    let on_ground = [None, Some(false), Some(true)].get(usize::from(flags >> 6)).copied();
    let (form, ratio_exponent) = (Form::in_flags(flags), -i32::from(flags & 15));
    let exponent = i32::from(bytes[EXPONENT] as i8);
    let padded = count % 2 == 1 && bytes[SAMPLES + scaled::packed_length(count) - 1] & 15 != 0;
    let canonical = on_ground.is_some() && (form == Some(Form::PerSample) || ratio_exponent == 0) && !padded;
    if !(canonical && form.is_some() && SAMPLE_EXPONENTS.contains(&exponent)) {
        invalid.push("#", "bits are set that mean nothing in this layout");
    }
    let ratios = &bytes[SAMPLES + scaled::packed_length(count)..bytes.len() - MAC];
    let load_ratio = match form {
        None | Some(Form::None) => None,
        Some(Form::Mean) => MEAN_RATIO.value(ratios, MEAN_RATIO.pointer, &mut invalid).map(LoadRatio::Mean),
        Some(Form::PerSample) => {
            let ratio = |code: &u8| scaled::value(i32::from(*code as i8), ratio_exponent, RATIO_CODES);
            Some(LoadRatio::PerSample(ratios.iter().map(ratio).collect()))
        }
    };
    let codes = scaled::unpack(&bytes[SAMPLES..], count).into_iter();
    let measured = Measured {
        recorded_at: frame.recorded_at(),
        flight_hours: flight_hours.unwrap_or_default(),
        flight_cycles: FLIGHT_CYCLES.read(bytes, &mut invalid).map(|cycles| cycles as u64),
        samples: codes.map(|code| scaled::value(code, exponent, SAMPLE_CODES)).collect(),
        load_ratio,
        sample_noise: NOISE.read(bytes, &mut invalid),
        air_data: air_data(bytes, &mut invalid),
        temperature_c: TEMPERATURE.read(bytes, &mut invalid),
        winding_temperature_c: WINDING.read(bytes, &mut invalid),
        on_ground: on_ground.flatten(),
    };
    if flight_hours.is_none() && invalid.violations.is_empty() {
        invalid.push("#/flight_hours", "missing");
    }
    debug_assert!(bytes.len() >= HEAD + MAC);
    invalid.into_result(Some(measured))
}

fn air_data(bytes: &[u8], invalid: &mut Invalid) -> Option<AirData> {
    let told = AIR.map(|field| field.read(bytes, invalid));
    match told {
        [Some(q), Some(v), Some(alpha), Some(roll), Some(flap), Some(aileron)] => Some(AirData {
            dynamic_pressure_pa: q,
            airspeed_m_s: v,
            angle_of_attack_rad: alpha,
            roll_rate_rad_s: roll,
            flap_rad: flap,
            aileron_rad: aileron,
        }),
        told => {
            if told.iter().any(Option::is_some) {
                invalid.push("#/air_data", "told in part: a frame has all six figures or none");
            }
            None
        }
    }
}
