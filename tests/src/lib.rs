//! End-to-end tests live in the test files of this crate.
