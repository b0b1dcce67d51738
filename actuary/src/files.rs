//! Files that users bring and take away: tables in, whole files and folders out.

pub mod bundle;
pub mod database_copy;
pub mod dataset;
pub mod figures;
pub mod histories;
pub mod labels;
pub mod motor;
pub mod output;
pub mod plans;
pub mod records;
pub mod stress;
pub mod table;
