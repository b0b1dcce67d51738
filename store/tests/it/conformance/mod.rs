//! What every database behind the store must do. Only the fixture's `Database` knows which it is.

mod audit;
mod board;
mod checkpoints;
mod checks;
mod correct;
mod damage;
mod finished;
mod frame_keys;
mod generations;
mod history;
mod ingest;
mod installations;
mod lists;
mod lives;
mod maintenance;
mod models;
mod order;
mod own_diagnoses;
mod plans;
mod priors;
mod queue;
mod rebuild;
mod sensor_configurations;
mod settings;
mod tokens;
