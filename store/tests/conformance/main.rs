//! What every database behind the store must do. Only [`fixture::Database`] knows which it is.

#[path = "../fixture/mod.rs"]
mod fixture;

mod history;
mod ingest;
mod installations;
mod models;
mod queue;
