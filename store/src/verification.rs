//! Findings about a whole database.

/// Rows whose checksum was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Verification {
    /// Each table that carries checksums, with the number of its rows.
    pub tables: Vec<(&'static str, u64)>,
    /// Rows that are not what was written, in the order of `tables`.
    pub damaged: Vec<DamagedRow>,
    /// Things that were not looked at, and why.
    pub unchecked: Vec<String>,
}

/// A row that is refused rather than served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DamagedRow {
    /// The table that holds it.
    pub table: &'static str,
    /// The row, as far as its columns can be read.
    pub row: String,
    /// The sign of the damage.
    pub detail: String,
}

impl Verification {
    /// Number of rows that were looked at.
    pub fn rows(&self) -> u64 {
        self.tables.iter().map(|(_, rows)| rows).sum()
    }
}
