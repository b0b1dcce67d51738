//! What every database behind the store must do. Only [`fixture::Database`] knows which it is.

#[path = "../fixture/mod.rs"]
mod fixture;

mod checkpoints;
mod correct;
mod finished;
mod generations;
mod history;
mod ingest;
mod installations;
mod lists;
mod maintenance;
mod models;
mod order;
mod priors;
mod queue;
mod rebuild;
mod sensor_configurations;
mod tokens;
