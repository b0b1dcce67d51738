//! The chain from maps to faults: which of its links a training takes.
//!
//! What: two named chains, the default one and that of the thesis, and every link free to choose.
//! Source: Berri 2021, sections 3.2, 2.1-2.3 and 6.2-6.4; what replaced it is in the pages on chains.

use diagnosis::MapKind;
use reduction::Prior;
use serde::{Deserialize, Serialize};

/// The links of a diagnosis chain; those left out of a file are the default's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChainSettings {
    /// Form of the model that makes the maps to learn from; without effect where a dataset brings them.
    pub lf1: Lf1Form,
    /// How the points of the mask are chosen.
    pub mask: MaskRule,
    /// How coefficients are found from samples.
    pub gappy: Prior,
    /// Modes of the basis.
    pub modes: usize,
    /// Hidden units of the network.
    pub hidden: usize,
    /// Whether the network learns from noisy samples, and a raw map's also from varied loads.
    pub noise_training: bool,
    /// Which map is read. With the raw one, one diagnoser serves uploads with and without load ratio.
    pub map: MapKind,
}

/// Form of the first low-fidelity model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lf1Form {
    /// The sum over the active pair.
    Pair,
    /// The fitted shape functions 3.46 and 3.48.
    Thesis,
}

/// How the points of a mask are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MaskRule {
    /// Greedy D-optimal design.
    #[serde(alias = "d-optimal")]
    DOptimal,
    /// Column-pivoted QR.
    Qr,
    /// Winners of a self-organising map.
    Som,
    /// Equal spacing.
    Uniform,
}

impl Default for ChainSettings {
    fn default() -> Self {
        Self {
            lf1: Lf1Form::Pair,
            mask: MaskRule::DOptimal,
            gappy: Prior::Pod,
            modes: 9,
            hidden: 14,
            noise_training: true,
            map: MapKind::LoadInvariant,
        }
    }
}

impl ChainSettings {
    /// The names of [`ChainSettings::named`].
    pub const NAMES: [&'static str; 2] = ["default", "thesis"];

    /// The chain of the thesis: shape functions, SOM mask, least squares, a network trained without noise.
    pub fn thesis() -> Self {
        Self {
            lf1: Lf1Form::Thesis,
            mask: MaskRule::Som,
            gappy: Prior::Flat,
            modes: 9,
            hidden: 14,
            noise_training: false,
            map: MapKind::Raw,
        }
    }

    /// The chain of a name, one of [`ChainSettings::NAMES`].
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "default" => Some(Self::default()),
            "thesis" => Some(Self::thesis()),
            _ => None,
        }
    }
}
