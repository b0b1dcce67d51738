//! The service without sockets and without a clock of its own, for tests that hold all of it in their hands.

pub mod clock;
pub mod database;
pub mod service;
