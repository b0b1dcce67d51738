//! The entries of the fault vector that a fault group speaks of.

use domain::{FaultGroup, FaultModel};

/// Entries of the fault vector in the order of the axes of a group.
pub(crate) fn group_entries(group: &FaultGroup) -> impl Iterator<Item = usize> + use<> {
    let (first, second) = match *group {
        FaultGroup::OneSided { index } => (index, None),
        FaultGroup::Pair { indices: [a, b] } => (a, Some(b)),
    };
    std::iter::once(first).chain(second)
}

/// Entries of the fault vector that are never below nominal.
pub(crate) fn one_sided(model: &FaultModel) -> impl Iterator<Item = usize> {
    model.groups.iter().filter_map(|group| match *group {
        FaultGroup::OneSided { index } => Some(index),
        FaultGroup::Pair { .. } => None,
    })
}
