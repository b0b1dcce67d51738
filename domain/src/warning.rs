//! What is odd about something that was stored nevertheless.

use serde::{Deserialize, Serialize};

/// What contradicts what was known, and what follows from it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// Which contradiction, as a code.
    pub kind: WarningKind,
    /// What is known and what follows, in words with the values.
    pub detail: String,
}

/// Which contradiction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningKind {
    /// The component was not known before.
    Enrolled,
    /// A name differs from a known one in upper and lower case only.
    NameDiffersInCase,
    /// Hours that no component can have flown between this and its neighbours in time.
    HoursContradict,
    /// A removal from where the component was not.
    NotInstalledThere,
    /// An install where another component was, which nobody had removed.
    PlaceTaken,
    /// An install of a component that was elsewhere, from where nobody had removed it.
    InstalledElsewhere,
    /// An upload that says otherwise than an install.
    InstallContradicted,
    /// An upload that names a component which was seen on another tail, from where nobody had removed it.
    SeenOnOtherTail,
    /// A component that lost its place to another one, and that nobody removed.
    PlaceUnknown,
}

impl WarningKind {
    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Enrolled => "enrolled",
            Self::NameDiffersInCase => "name_differs_in_case",
            Self::HoursContradict => "hours_contradict",
            Self::NotInstalledThere => "not_installed_there",
            Self::PlaceTaken => "place_taken",
            Self::InstalledElsewhere => "installed_elsewhere",
            Self::InstallContradicted => "install_contradicted",
            Self::SeenOnOtherTail => "seen_on_other_tail",
            Self::PlaceUnknown => "place_unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_that_are_written() {
        for kind in [
            WarningKind::Enrolled,
            WarningKind::NameDiffersInCase,
            WarningKind::HoursContradict,
            WarningKind::NotInstalledThere,
            WarningKind::PlaceTaken,
            WarningKind::InstalledElsewhere,
            WarningKind::InstallContradicted,
            WarningKind::SeenOnOtherTail,
            WarningKind::PlaceUnknown,
        ] {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.as_str());
        }
    }
}
