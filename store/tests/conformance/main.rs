//! What every database behind the store must do. Only [`fixture::Database`] knows which it is.

#[path = "../fixture/mod.rs"]
mod fixture;

mod correct;
mod history;
mod ingest;
mod installations;
mod lists;
mod models;
mod order;
mod queue;
mod sensor_configurations;
