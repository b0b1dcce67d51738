//! The conformance suite on Postgres.

mod conformance;
mod fixture;

/// The database that stands behind the store.
const BACKEND: fixture::Backend = fixture::Backend::Postgres;
