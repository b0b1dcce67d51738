//! The prior that judges a life: the bundle's own, or one that an operator's finished lives taught.

use domain::ContentHash;
use prognosis::LifePrior;

/// A prior under its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// SHA-256 of its canonical JSON.
    pub hash: ContentHash,
    /// What it says.
    pub body: LifePrior,
}

impl Prior {
    /// Names a prior by its content.
    pub fn new(body: impl Into<LifePrior>) -> Self {
        let body = body.into();
        Self { hash: ContentHash::of_json(&body), body }
    }

    /// Reads canonical JSON.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, serde_json::Error> {
        serde_json::from_slice(bytes).map(|body: LifePrior| Self::new(body))
    }

    /// Canonical JSON.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(&self.body).expect("priors serialise: no maps with non-text keys")
    }
}
