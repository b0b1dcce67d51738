//! The worker between a real store and the bundle that ships.

mod common;
mod ending;
mod lease;
mod lesson;
mod order;
mod planning;
