//! Keys of uplink frames: what a key is called, and whom it speaks for. The secret itself is not here.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::{ContentHash, PartNumber, Position, SerialNumber, TailNumber, UploadId, token::digits};

/// A frame key's name: 16 lower-case hexadecimal digits. No secret.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FrameKeyId([u8; 8]);

/// A text that names no frame key. It never repeats the text, which may be a whole key, secret and all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the id of a frame key must be 16 lower-case hexadecimal digits")]
pub struct InvalidFrameKeyId;

/// What a frame key speaks for. A frame names nothing of it but the key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FrameSubject {
    /// One actuator where it is installed, sampled by one mask.
    Actuator {
        /// The aircraft.
        tail: TailNumber,
        /// Where on it.
        position: Position,
        /// Its part number.
        part_number: PartNumber,
        /// Its serial number.
        serial_number: SerialNumber,
        /// The mask by which it is sampled.
        mask_id: ContentHash,
    },
    /// The strain of a tail's wing.
    Strain {
        /// The aircraft.
        tail: TailNumber,
    },
}

impl FrameSubject {
    /// The aircraft that sends.
    pub fn tail(&self) -> &TailNumber {
        match self {
            Self::Actuator { tail, .. } | Self::Strain { tail } => tail,
        }
    }
}

impl FrameKeyId {
    /// The name of these bytes.
    pub const fn new(bytes: [u8; 8]) -> Self {
        Self(bytes)
    }

    /// The bytes, as a frame has them.
    pub const fn bytes(&self) -> [u8; 8] {
        self.0
    }

    /// The name of the upload in the frame of this counter: the same frame is the same upload, for ever.
    pub fn upload_id(&self, counter: u32) -> UploadId {
        format!("frame:{self}:{counter}").parse().expect("a name of an upload")
    }
}

impl fmt::Display for FrameKeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex::encode(self.0))
    }
}

impl fmt::Debug for FrameKeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FrameKeyId({self})")
    }
}

impl FromStr for FrameKeyId {
    type Err = InvalidFrameKeyId;

    fn from_str(text: &str) -> Result<Self, InvalidFrameKeyId> {
        digits(text).map(Self).ok_or(InvalidFrameKeyId)
    }
}

impl TryFrom<String> for FrameKeyId {
    type Error = InvalidFrameKeyId;

    fn try_from(text: String) -> Result<Self, InvalidFrameKeyId> {
        text.parse()
    }
}

impl From<FrameKeyId> for String {
    fn from(id: FrameKeyId) -> String {
        id.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upload_is_called_by_its_key_and_counter() {
        let id: FrameKeyId = "00ff0102030405a6".parse().unwrap();
        assert_eq!(id.upload_id(u32::MAX).as_str(), "frame:00ff0102030405a6:4294967295");
        assert_eq!(id.to_string().parse(), Ok(id));
        for bad in ["", "00FF0102030405A6", "00ff0102030405a", "00ff0102030405a6.00"] {
            assert_eq!(bad.parse::<FrameKeyId>(), Err(InvalidFrameKeyId), "{bad}");
        }
    }
}
