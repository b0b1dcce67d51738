//! What the actuator's models promise, against golden values and references.

mod assessment;
mod models;
mod response;
mod scenarios;
mod wear;
