//! The mask: the rotor angles at which an aircraft samples the back-EMF map.

use serde::{Deserialize, Serialize};

use crate::{ContentHash, Invalid};

/// What a map is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coordinate {
    /// Electrical rotor angle, rad, in [0, 2 pi).
    ElectricalAngleRad,
}

impl Coordinate {
    /// The name on the wire.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::ElectricalAngleRad => "electrical_angle_rad",
        }
    }
}

/// Bins of a map that are transmitted, in the order in which samples are sent.
///
/// A mask is an object of its own, named by the hash of its content: bundles come and go, a
/// published mask stays accepted by every bundle of the same coordinate and map length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Mask {
    coordinate: Coordinate,
    map_length: usize,
    bins: Vec<usize>,
}

/// What claims to be a mask.
#[derive(Deserialize)]
struct Unchecked {
    coordinate: Coordinate,
    map_length: usize,
    bins: Vec<usize>,
}

impl TryFrom<Unchecked> for Mask {
    type Error = Invalid;

    fn try_from(Unchecked { coordinate, map_length, bins }: Unchecked) -> Result<Self, Invalid> {
        Self::new(coordinate, map_length, bins)
    }
}

impl Mask {
    /// A mask of distinct bins below `map_length`.
    pub fn new(coordinate: Coordinate, map_length: usize, bins: Vec<usize>) -> Result<Self, Invalid> {
        let mut invalid = Invalid::default();
        let mut seen = vec![false; map_length];
        for (i, &bin) in bins.iter().enumerate() {
            match seen.get_mut(bin) {
                None => invalid.push(format!("#/bins/{i}"), format!("bin {bin} is outside a map of {map_length}")),
                Some(true) => invalid.push(format!("#/bins/{i}"), format!("bin {bin} occurs twice")),
                Some(free) => *free = true,
            }
        }
        if bins.is_empty() {
            invalid.push("#/bins", "a mask needs at least one bin");
        }
        invalid.into_result(Some(Self { coordinate, map_length, bins }))
    }

    /// The hash of coordinate, map length and bins: the `mask_id`.
    pub fn id(&self) -> ContentHash {
        ContentHash::of_json(self)
    }

    /// What the map is a function of.
    pub fn coordinate(&self) -> Coordinate {
        self.coordinate
    }

    /// Number of bins of the full map.
    pub fn map_length(&self) -> usize {
        self.map_length
    }

    /// 0-based bins, in the order of the samples.
    pub fn bins(&self) -> &[usize] {
        &self.bins
    }

    /// Number of samples, n_w.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether whoever reads samples at one of two masks can read those at the other.
    pub fn reads_alike(&self, other: &Self) -> bool {
        (self.coordinate, self.map_length) == (other.coordinate, other.map_length)
    }

    /// Never true: kept for the convention.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Bin centres in the map's coordinate, rad.
    pub fn points_rad(&self) -> Vec<f64> {
        let width = std::f64::consts::TAU / self.map_length as f64;
        self.bins.iter().map(|&bin| (bin as f64 + 0.5) * width).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_named_by_its_content() {
        let mask = |bins: &[usize]| Mask::new(Coordinate::ElectricalAngleRad, 360, bins.to_vec()).unwrap();
        assert_eq!(mask(&[3, 7]).id(), mask(&[3, 7]).id());
        assert_ne!(mask(&[3, 7]).id(), mask(&[7, 3]).id());
        assert!((mask(&[0]).points_rad()[0] - 0.5_f64.to_radians()).abs() < 1e-15);
    }

    #[test]
    fn bins_outside_the_map_and_twice_are_refused() {
        let refused = Mask::new(Coordinate::ElectricalAngleRad, 4, vec![0, 4, 0]).unwrap_err();
        let pointers: Vec<_> = refused.violations.iter().map(|v| v.pointer.as_str()).collect();
        assert_eq!(pointers, ["#/bins/1", "#/bins/2"]);
        let text = r#"{"coordinate":"electrical_angle_rad","map_length":4,"bins":[0,4]}"#;
        let refused = serde_json::from_str::<Mask>(text).unwrap_err().to_string();
        assert!(refused.contains("bin 4 is outside a map of 4"), "{refused}");
    }
}
