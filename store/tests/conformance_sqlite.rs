//! The conformance suite on SQLite.

mod conformance;
mod fixture;

/// The database that stands behind the store.
const BACKEND: fixture::Backend = fixture::Backend::Sqlite;
