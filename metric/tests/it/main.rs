//! Metrics as they are shown.

mod dashboard;
