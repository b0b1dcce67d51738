//! The secrets behind frames: one of the installation, and those that follow from it, one for each subject.
//!
//! key = HMAC-SHA256(installation key, "actuary frame key 1", id, operator, subject), each part with its length. So the database
//! holds no secret, and a row that was changed leads to another key, by which no frame is authentic.

use std::{fmt, str::FromStr};

use domain::{FrameKeyId, FrameSubject, OperatorId};
use hmac::{Hmac, KeyInit, Mac};
use serde::{Deserialize, Serialize};
use sha2::Sha256;

use super::MAC;

/// The secret of an installation, kept outside its database. It is never printed.
#[derive(Clone)]
pub struct InstallationKey([u8; 32]);

/// What writes the frames of one subject. It is never printed but by [`FrameKey::reveal`] and on its card.
#[derive(Clone)]
pub struct FrameKey {
    id: FrameKeyId,
    secret: [u8; 32],
}

/// A frame key with whom it speaks for: what an aircraft is given.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeyCard {
    /// The key, secret and all.
    pub key: FrameKey,
    /// Whose aircraft it is.
    pub operator: OperatorId,
    /// Whom it speaks for.
    #[serde(flatten)]
    pub subject: FrameSubject,
}

/// A text that is no secret. It never repeats the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSecret {
    /// It is no key of an installation.
    #[error("an installation's frame key must be 64 lower-case hexadecimal digits")]
    Installation,
    /// It is no key of frames.
    #[error("a frame key must be 16 and 64 lower-case hexadecimal digits with a dot between them")]
    Frame,
}

impl InstallationKey {
    /// A new one out of random bytes, which must be used for nothing else.
    pub fn new(random: [u8; 32]) -> Self {
        Self(random)
    }

    /// The key of this name for a subject of an operator.
    pub fn derive(&self, id: FrameKeyId, operator: &OperatorId, subject: &FrameSubject) -> FrameKey {
        let mut mac = keyed(&self.0);
        let id_text = id.to_string();
        for part in ["actuary frame key 1", &id_text, operator.as_str()].into_iter().chain(parts(subject)) {
            mac.update(&(part.len() as u64).to_be_bytes());
            mac.update(part.as_bytes());
        }
        if let FrameSubject::Actuator { mask_id, .. } = subject {
            mac.update(mask_id.bytes());
        }
        FrameKey { id, secret: mac.finalize().into_bytes().into() }
    }
}

fn parts(subject: &FrameSubject) -> Vec<&str> {
    match subject {
        FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id: _ } => {
            vec!["actuator", tail.as_str(), position.as_str(), part_number.as_str(), serial_number.as_str()]
        }
        FrameSubject::Strain { tail } => vec!["strain", tail.as_str()],
    }
}

fn keyed(secret: &[u8; 32]) -> Hmac<Sha256> {
    Hmac::new_from_slice(secret).expect("a key of any length is one")
}

impl FrameKey {
    /// Its name.
    pub fn id(&self) -> FrameKeyId {
        self.id
    }

    /// The MAC of what it writes.
    pub(super) fn mac(&self, signed: &[u8]) -> [u8; MAC] {
        let mac = keyed(&self.secret).chain_update(signed).finalize().into_bytes();
        super::bytes::array(&mac, 0)
    }

    /// Whether it wrote this; how long that takes says nothing about the right MAC.
    pub(super) fn wrote(&self, signed: &[u8], mac: &[u8]) -> bool {
        keyed(&self.secret).chain_update(signed).verify_truncated_left(mac).is_ok()
    }

    /// The text to be handed to who writes frames, and to nobody else.
    pub fn reveal(&self) -> String {
        format!("{}.{}", self.id, hex::encode(self.secret))
    }
}

impl FromStr for InstallationKey {
    type Err = InvalidSecret;

    fn from_str(text: &str) -> Result<Self, InvalidSecret> {
        digits(text).map(Self).ok_or(InvalidSecret::Installation)
    }
}

impl FromStr for FrameKey {
    type Err = InvalidSecret;

    fn from_str(text: &str) -> Result<Self, InvalidSecret> {
        let (id, secret) = text.split_once('.').ok_or(InvalidSecret::Frame)?;
        let id = id.parse().map_err(|_| InvalidSecret::Frame)?;
        Ok(Self { id, secret: digits(secret).ok_or(InvalidSecret::Frame)? })
    }
}

/// The bytes of 64 lower-case hexadecimal digits.
fn digits(text: &str) -> Option<[u8; 32]> {
    let lower = !text.bytes().any(|byte| byte.is_ascii_uppercase());
    hex::decode(text).ok().filter(|_| lower)?.try_into().ok()
}

impl Serialize for FrameKey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.reveal())
    }
}

impl<'de> Deserialize<'de> for FrameKey {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl fmt::Debug for InstallationKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("InstallationKey")
    }
}

impl fmt::Debug for FrameKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FrameKey({})", self.id)
    }
}
