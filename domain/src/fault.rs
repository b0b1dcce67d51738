//! Fault vectors and the model that names and groups their entries.

use serde::{Deserialize, Serialize};

/// How entries of a fault vector propagate: alone, one-sided or not, or as a pair that shares a rate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FaultGroup {
    /// A severity that cannot fall below nominal, such as a shorted fraction of a winding.
    OneSided {
        /// Index into the fault vector.
        index: usize,
    },
    /// A severity that may also be seen below nominal, such as a health index.
    Free {
        /// Index into the fault vector.
        index: usize,
    },
    /// Two Cartesian entries of one fault, such as eccentricity along two axes.
    Pair {
        /// Indices into the fault vector.
        indices: [usize; 2],
    },
}

impl FaultGroup {
    /// Entries of the fault vector in the order of the axes of the group.
    pub fn entries(&self) -> impl Iterator<Item = usize> + use<> {
        let (first, second) = match *self {
            Self::OneSided { index } | Self::Free { index } => (index, None),
            Self::Pair { indices: [a, b] } => (a, Some(b)),
        };
        std::iter::once(first).chain(second)
    }
}

/// What the entries of a fault vector mean. Nothing in the service is fixed to five faults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultModel {
    /// A name per entry.
    pub names: Vec<String>,
    /// The value of each entry when the actuator is nominal.
    pub nominal: Vec<f64>,
    /// How entries belong together; every index occurs once.
    pub groups: Vec<FaultGroup>,
}

impl FaultModel {
    /// The five electrical faults (Berri 2021, section 6.2): shorted winding fractions of phases A, B, C
    /// and rotor eccentricity ((1 + zeta cos phi)/2, (1 + zeta sin phi)/2).
    pub fn electrical() -> Self {
        Self {
            names: ["k1", "k2", "k3", "k4", "k5"].map(str::to_owned).into(),
            nominal: vec![0.0, 0.0, 0.0, 0.5, 0.5],
            groups: vec![
                FaultGroup::OneSided { index: 0 },
                FaultGroup::OneSided { index: 1 },
                FaultGroup::OneSided { index: 2 },
                FaultGroup::Pair { indices: [3, 4] },
            ],
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Entries of the fault vector that are never below nominal.
    pub fn one_sided(&self) -> impl Iterator<Item = usize> {
        self.groups.iter().filter_map(|group| match *group {
            FaultGroup::OneSided { index } => Some(index),
            FaultGroup::Free { .. } | FaultGroup::Pair { .. } => None,
        })
    }

    /// Deviation from nominal: severity is a deviation, never a norm of k.
    pub fn deviation(&self, faults: &FaultVector) -> Vec<f64> {
        faults.0.iter().zip(&self.nominal).map(|(k, nominal)| k - nominal).collect()
    }

    /// The fault vector of a deviation from nominal.
    pub fn from_deviation(&self, deviation: &[f64]) -> FaultVector {
        FaultVector(deviation.iter().zip(&self.nominal).map(|(x, nominal)| x + nominal).collect())
    }
}

/// Values of the faults, in the order of the model's names; those that maps tell are dimensionless, in [0, 1], others
/// have units of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FaultVector(pub Vec<f64>);

impl FaultVector {
    /// The values.
    pub fn values(&self) -> &[f64] {
        &self.0
    }
}
