//! Limits: how much of anything is taken at once.

/// Largest body that is one JSON document, and largest line of a body of many.
pub const MAX_UPLOAD_BYTES: usize = 256 << 10;
/// Largest body of many lines.
pub const MAX_BODY_BYTES: usize = 16 << 20;
/// Largest table that is sent.
pub const MAX_TABLE_BYTES: usize = 2 << 20;
/// Items of a page unless told otherwise.
pub const DEFAULT_LIMIT: u32 = 50;
/// Most items of a page.
pub const MAX_LIMIT: u32 = 1000;
/// Most hours for which P(failure within) is asked at once.
pub const MAX_WITHIN: usize = 64;
/// Most flight hours that can be asked about.
pub const MAX_HOURS: f64 = 1e6;
