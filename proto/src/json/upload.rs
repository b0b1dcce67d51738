//! An upload on the wire and what became of it.

use std::ops::RangeInclusive;

use domain::{
    AirData, Invalid, LoadRatio, MapSamples, OwnDiagnosis, OwnFault, PartNumber, Position, Reading, SerialNumber,
    SetAsideReason, Strain, TailNumber, Timestamp, Upload, UploadId, UploadStateKind,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Problem, WarningItem};
use crate::{answer::HealthItem, brought::Brought};

/// What an aircraft knows of one actuator after one flight: either `samples` with the `mask_id` by which they were taken,
/// or an own diagnosis as `faults`. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct UploadBody {
    /// The upload's name, unique for ever within its operator.
    #[schema(example = "EC-MXA.AIL-L.000123", pattern = r"^(?!\.{1,2}$)[A-Za-z0-9._:-]{1,64}$")]
    pub upload_id: String,
    /// Where the actuator is installed.
    #[schema(example = "AIL-L", pattern = r"^(?!\.{1,2}$)[A-Za-z0-9._-]{1,32}$")]
    pub position: String,
    /// Part number, 1-32 printable characters that people can see and tell apart.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// Serial number, 1-32 printable characters that people can see and tell apart.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// The component's hours since new, never reset.
    #[schema(maximum = 500000, minimum = 0, example = 1234.5)]
    pub flight_hours: f64,
    /// The component's cycles since new.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(maximum = 10000000)]
    pub flight_cycles: Option<u64>,
    /// When it was measured, RFC 3339 with an offset; kept to the microsecond.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub recorded_at: String,
    /// The mask by which samples were taken; needed with them, and given with nothing else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub mask_id: Option<String>,
    /// Back-EMF samples in the order of the mask's points, V s/rad; null where no pass gave one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = json!([0.0751, 0.0749, null, 0.0752]))]
    pub samples: Option<Vec<Option<f64>>>,
    /// Load ratio r = R i/(k w), with samples only: one per sample, or the mean of the map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_ratio: Option<LoadRatio>,
    /// Standard deviation of one sample, in units of the nominal back-EMF constant; with samples only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub sample_noise: Option<f64>,
    /// An own diagnosis instead of samples: every fault of the bundle in service by its name, each once. Values are in [0, 1]
    /// and each has a sigma, unless the bundle is one of own faults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<BTreeMap<String, OwnFault>>, example = json!(null))]
    pub faults: Option<OwnDiagnosis>,
    /// Wing strain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<Strain>,
    /// Flight condition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air_data: Option<AirData>,
    /// Ambient temperature, degrees Celsius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = -100, maximum = 150)]
    pub temperature_c: Option<f64>,
    /// Winding temperature, degrees Celsius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = -100, maximum = 300)]
    pub winding_temperature_c: Option<f64>,
    /// Whether the aircraft was on the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_ground: Option<bool>,
}

impl UploadBody {
    /// The noun, or every name and time that cannot be one. Ranges and sizes are checked later,
    /// against the mask or the bundle ([`Upload::check`]).
    pub fn into_upload(self, tail: TailNumber) -> Result<Upload, Invalid> {
        let mut invalid = Invalid::default();
        let upload_id = invalid.check("#/upload_id", UploadId::admit(&self.upload_id));
        let position = invalid.check("#/position", Position::admit(&self.position));
        let part_number = invalid.check("#/part_number", PartNumber::admit(&self.part_number));
        let serial_number = invalid.check("#/serial_number", SerialNumber::admit(&self.serial_number));
        let recorded_at = invalid.check("#/recorded_at", self.recorded_at.parse::<Timestamp>());
        let Self { mask_id, samples, load_ratio, sample_noise, faults, .. } = self;
        let reading = Brought { mask_id, samples, load_ratio, sample_noise, faults }.into_reading(&mut invalid);
        let upload = (|| {
            Some(Upload {
                tail,
                upload_id: upload_id?,
                position: position?,
                part_number: part_number?,
                serial_number: serial_number?,
                flight_hours: self.flight_hours,
                flight_cycles: self.flight_cycles,
                recorded_at: recorded_at?,
                reading: reading?,
                strain: self.strain,
                air_data: self.air_data,
                temperature_c: self.temperature_c,
                winding_temperature_c: self.winding_temperature_c,
                on_ground: self.on_ground,
            })
        })();
        invalid.into_result(upload)
    }
}

impl From<Upload> for UploadBody {
    fn from(upload: Upload) -> Self {
        let (samples, faults) = match upload.reading {
            Reading::Samples(samples) => (Some(samples), None),
            Reading::Own { faults } => (None, Some(faults)),
        };
        let (mask_id, samples, load_ratio, sample_noise) = match samples {
            Some(MapSamples { mask_id, samples, load_ratio, sample_noise }) => {
                (Some(mask_id.into()), Some(samples), load_ratio, sample_noise)
            }
            None => (None, None, None, None),
        };
        Self {
            upload_id: upload.upload_id.into(),
            position: upload.position.into(),
            part_number: upload.part_number.into(),
            serial_number: upload.serial_number.into(),
            flight_hours: upload.flight_hours,
            flight_cycles: upload.flight_cycles,
            recorded_at: upload.recorded_at.into(),
            mask_id,
            samples,
            load_ratio,
            sample_noise,
            faults,
            strain: upload.strain,
            air_data: upload.air_data,
            temperature_c: upload.temperature_c,
            winding_temperature_c: upload.winding_temperature_c,
            on_ground: upload.on_ground,
        }
    }
}

/// What became of an upload when it came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ingested {
    /// Stored, durable.
    Accepted,
    /// Stored before, with the same content.
    Duplicate,
    /// The upload_id is taken by other content.
    Conflict,
    /// Refused: see the error.
    Invalid,
    /// Not stored: try again.
    Unavailable,
}

/// The answer to one upload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UploadAck {
    /// The upload's name.
    #[schema(example = "EC-MXA.AIL-L.000123")]
    pub upload_id: String,
    /// `accepted` (202) or `duplicate` (200).
    pub status: Ingested,
    /// What it contradicts, though it was stored; absent when nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<WarningItem>,
}

/// The answer to one line of an NDJSON body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LineResult {
    /// The line, counted from 1.
    #[schema(example = 1)]
    pub line: u64,
    /// The upload's name; null when it could not be read.
    #[schema(required, example = "EC-MXA.AIL-L.000123")]
    pub upload_id: Option<String>,
    /// What became of it.
    pub status: Ingested,
    /// What it contradicts, though it was stored; absent when nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<WarningItem>,
    /// Why it was not stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<Problem>,
}

/// Which uploads of a tail that are set aside are to be tried again. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RetryBody {
    /// Recorded at this time or later, RFC 3339 with an offset.
    #[schema(format = "date-time", example = "2026-03-01T00:00:00Z")]
    pub from: String,
    /// Recorded at this time or earlier.
    #[schema(format = "date-time", example = "2026-03-31T23:59:59Z")]
    pub to: String,
    /// Only those that are set aside for this reason: the code that they are listed with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<SetAsideReason>, example = "implausible_hours")]
    pub reason: Option<String>,
}

impl RetryBody {
    /// The times and the reason, or everything that is wrong with them.
    pub fn into_choice(self) -> Result<(RangeInclusive<Timestamp>, Option<SetAsideReason>), Invalid> {
        let mut invalid = Invalid::default();
        let from = invalid.check("#/from", self.from.parse::<Timestamp>());
        let to = invalid.check("#/to", self.to.parse::<Timestamp>());
        if from > to && to.is_some() {
            invalid.push("#/to", format!("{} is before from, {}", self.to, self.from));
        }
        let reason = self.reason.as_ref().map(|code| serde_json::from_value::<SetAsideReason>(code.as_str().into()));
        let reason = reason.transpose().unwrap_or_else(|_| {
            invalid.push(
                "#/reason",
                format!("{:?} is none that uploads are set aside for", self.reason.unwrap_or_default()),
            );
            None
        });
        invalid.into_result(from.zip(to).map(|(from, to)| (from..=to, reason)))
    }
}

/// How many uploads are tried again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RetryAck {
    /// How many wait for a worker again, at most 500 at a time.
    #[schema(example = 42)]
    pub retried: u64,
    /// How many of those that were asked for are still set aside: ask again.
    #[schema(example = 0)]
    pub remaining: u64,
}

/// What became of an upload since.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UploadStatusBody {
    /// The upload's name.
    #[schema(example = "EC-MXA.AIL-L.000123")]
    pub upload_id: String,
    /// How far it has come.
    pub state: UploadStateKind,
    /// Why it was set aside, as a code: `implausible_hours`, `hours_backwards`, `repeated_measurement`,
    /// `not_finite` or `not_estimable`.
    #[schema(required, example = json!(null))]
    pub reason: Option<String>,
    /// Why it was set aside, in words with the offending values.
    #[schema(required, example = json!(null))]
    pub detail: Option<String>,
    /// When it was voided.
    #[schema(required, format = "date-time", example = json!(null))]
    pub voided_at: Option<String>,
    /// The aircraft that sent it.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The position on it.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// The component's part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// The component's serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// The component's hours since new.
    #[schema(example = 1234.5)]
    pub flight_hours: f64,
    /// When it was measured.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub recorded_at: String,
    /// When it was stored.
    #[schema(format = "date-time", example = "2026-03-01T12:31:07Z")]
    pub received_at: String,
    /// What it says about the actuator's health.
    #[schema(required)]
    pub estimate: Option<HealthItem>,
}
