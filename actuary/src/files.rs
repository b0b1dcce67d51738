//! Files that users bring and take away: tables in, whole files and folders out.

pub mod dataset;
pub mod labels;
pub mod motor;
pub mod output;
pub mod table;
