//! What things are called: every name of an operator carries its word, so that it is recognised wherever it appears.

/// The operators, and for each one that does not exist. Words of equal length make answers of equal length, and a ghost
/// stands in all lists where the operator would.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// The first.
    Alpha,
    /// The second.
    Bravo,
    /// Nobody: its things do not exist.
    NotAlpha,
    /// Nobody either.
    NotBravo,
}

impl Owner {
    /// Its canary.
    pub fn word(self) -> &'static str {
        match self {
            Self::Alpha => "QXALF",
            Self::Bravo => "QXBRV",
            Self::NotAlpha => "QXALG",
            Self::NotBravo => "QXBRW",
        }
    }

    /// Its name as an operator.
    pub fn operator(self) -> domain::OperatorId {
        self.word().to_lowercase().parse().expect("a name")
    }

    /// The other operator.
    pub fn other(self) -> Self {
        match self {
            Self::Alpha => Self::Bravo,
            _ => Self::Alpha,
        }
    }

    /// The one that does not exist instead of it.
    pub fn ghost(self) -> Self {
        match self {
            Self::Alpha | Self::NotAlpha => Self::NotAlpha,
            Self::Bravo | Self::NotBravo => Self::NotBravo,
        }
    }

    /// A tail of its: the first has all that is asked for, the second belongs to another aircraft.
    pub fn tail(self, number: usize) -> String {
        format!("{}-{number}", self.word())
    }

    /// The one position of its tails.
    pub fn position(self) -> String {
        format!("{}-POS", self.word())
    }

    /// Its part number.
    pub fn part(self) -> String {
        format!("{}-PART", self.word())
    }

    /// The serial number of what is installed on a tail.
    pub fn serial(self, number: usize) -> String {
        format!("{}-SN-{number}", self.word())
    }

    /// An upload of a tail.
    pub fn upload(self, tail: usize, number: usize) -> String {
        format!("{}.{tail}.u{number}", self.word())
    }

    /// An event.
    pub fn event(self) -> String {
        format!("{}.event", self.word())
    }
}
