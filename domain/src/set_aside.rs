//! Uploads that are kept but not used, with the reason.

use serde::{Deserialize, Serialize};

use crate::UploadId;

/// An upload that no state rests on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetAside {
    /// The upload.
    pub upload_id: UploadId,
    /// Why, as a code.
    pub reason: SetAsideReason,
    /// Why, in words with the offending values.
    pub detail: String,
}

/// Why an upload is set aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum SetAsideReason {
    /// Its hours and its time imply more than 24 flight hours a day against both neighbours of its
    /// life, or it claims to come from the future.
    ImplausibleHours,
    /// Its hours run backwards as time goes on, against both neighbours of its life.
    HoursBackwards,
    /// The same measurement was sent before under another name.
    RepeatedMeasurement,
    /// A figure of its estimate is not finite.
    NotFinite,
    /// Its estimate cannot be computed: the mask does not fit the bundle, or the computation ended abnormally.
    NotEstimable,
}

impl SetAsideReason {
    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::ImplausibleHours => "implausible_hours",
            Self::HoursBackwards => "hours_backwards",
            Self::RepeatedMeasurement => "repeated_measurement",
            Self::NotFinite => "not_finite",
            Self::NotEstimable => "not_estimable",
        }
    }
}
