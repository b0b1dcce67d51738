//! Frames as text: base32 of RFC 4648 without padding, which every ACARS network carries.

use data_encoding::{BASE32_NOPAD, DecodeKind};

use super::FrameError;

/// The text of a frame.
pub fn to_base32(bytes: &[u8]) -> String {
    BASE32_NOPAD.encode(bytes)
}

/// The bytes of a text; only what [`to_base32`] writes is read.
pub fn from_base32(text: &str) -> Result<Vec<u8>, FrameError> {
    BASE32_NOPAD.decode(text.as_bytes()).map_err(|error| match error.kind {
        DecodeKind::Length => FrameError::Text { at: text.chars().count() },
        _ => FrameError::Text { at: error.position + 1 },
    })
}
