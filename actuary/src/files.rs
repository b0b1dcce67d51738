//! Files that users bring and take away: tables in, whole files and folders out.

pub mod output;
pub mod table;
