//! The uplink frame: what one actuator measured in a flight, in one block of ACARS.
//!
//! What a frame names by its key (tail, position, unit, mask) it does not carry. Numbers are whole steps within a stated
//! range, samples and load ratios in steps of a power of two that the frame chooses. Eight bytes of an HMAC-SHA256 end it,
//! and tell forged, damaged and cut frames alike. `docs/uplink.md` has the bytes.
//!
//! *Update rule:* a layout never changes; another one has another first byte. *Requirements:* reading never panics, whatever
//! the bytes; a frame that was opened becomes a [`domain::Upload`] and goes the way of all uploads.

mod actuator;
mod bytes;
mod error;
mod field;
mod join;
mod key;
mod scaled;
mod strain;
mod table;
#[cfg(test)]
mod tests;
mod text;

use domain::{FrameKeyId, Timestamp};

pub use actuator::Measured;
pub use error::FrameError;
pub use join::join;
pub use key::{FrameKey, InstallationKey, InvalidSecret, KeyCard};
pub use strain::MeasuredStrain;
pub use table::{Row, rows};
pub use text::{from_base32, to_base32};

/// The type of a body of frames.
pub const MEDIA_TYPE: &str = "application/vnd.actuary.frame";
/// The most bytes of a frame: 210 characters of base32 are what one block of ACARS takes.
pub const MAX_BYTES: usize = 131;

/// The first byte of an actuator's frame.
const ACTUATOR: u8 = 1;
/// The first byte of a frame of strain.
const STRAIN: u8 = 2;
/// Bytes that every layout begins with: layout, key, counter, time.
const HEAD: usize = 17;
/// Bytes that every layout ends with.
const MAC: usize = 8;

/// A frame whose length is that of its layout; nothing says yet who wrote it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame(Vec<u8>);

/// What a frame says.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// What one actuator measured.
    Actuator(Measured),
    /// Strain of the wing.
    Strain(MeasuredStrain),
}

impl Frame {
    /// The frame in these bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self, FrameError> {
        let (frame, rest) = Self::parse_first(bytes)?;
        match rest {
            [] => Ok(frame),
            rest => Err(FrameError::Long { bytes: bytes.len(), expected: bytes.len() - rest.len() }),
        }
    }

    /// The frame that these bytes begin with, and the bytes behind it.
    pub fn parse_first(bytes: &[u8]) -> Result<(Self, &[u8]), FrameError> {
        let expected = match bytes.first() {
            None => return Err(FrameError::Cut { bytes: 0, expected: HEAD + MAC }),
            Some(&ACTUATOR) => actuator::length(bytes),
            Some(&STRAIN) => strain::LENGTH,
            Some(&other) => return Err(FrameError::Layout(other)),
        };
        match bytes.split_at_checked(expected) {
            Some(_) if expected > MAX_BYTES => Err(FrameError::Long { bytes: expected, expected: MAX_BYTES }),
            Some((frame, rest)) => Ok((Self(frame.to_vec()), rest)),
            None => Err(FrameError::Cut { bytes: bytes.len(), expected }),
        }
    }

    /// The key that it names.
    pub fn key(&self) -> FrameKeyId {
        FrameKeyId::new(bytes::array(&self.0, 1))
    }

    /// Its number among the frames of its key.
    pub fn counter(&self) -> u32 {
        u32::from_be_bytes(bytes::array(&self.0, 9))
    }

    /// When it was measured, to the second.
    fn recorded_at(&self) -> Timestamp {
        Timestamp::from_micros(i64::from(u32::from_be_bytes(bytes::array(&self.0, 13))) * 1_000_000)
    }

    /// What it says, if this key wrote it.
    pub fn open(&self, key: &FrameKey) -> Result<Content, FrameError> {
        let (signed, mac) = self.0.split_at(self.0.len() - MAC);
        if !key.wrote(signed, mac) {
            return Err(FrameError::NotAuthentic);
        }
        self.read()
    }

    /// What it says, whoever wrote it.
    pub fn read(&self) -> Result<Content, FrameError> {
        match self.0[0] {
            ACTUATOR => actuator::read(self).map(Content::Actuator),
            _ => strain::read(self).map(Content::Strain),
        }
        .map_err(FrameError::Content)
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// The frame of these bytes without a MAC, by the key that writes it.
    fn written(mut bytes: Vec<u8>, key: &FrameKey) -> Self {
        let mac = key.mac(&bytes);
        bytes.extend_from_slice(&mac);
        Self(bytes)
    }
}

/// The bytes that every layout begins with, or why there are none.
fn head(layout: u8, key: &FrameKey, counter: u32, at: Timestamp, invalid: &mut domain::Invalid) -> Vec<u8> {
    let seconds = u32::try_from(at.micros().div_euclid(1_000_000));
    if seconds.is_err() {
        invalid.push("#/recorded_at", format!("{at} is outside 1970 to 2106-02-07T06:28:15Z"));
    }
    let mut bytes = vec![layout];
    bytes.extend_from_slice(&key.id().bytes());
    bytes.extend_from_slice(&counter.to_be_bytes());
    bytes.extend_from_slice(&seconds.unwrap_or_default().to_be_bytes());
    bytes
}
