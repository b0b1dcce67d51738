//! The service without sockets and without a clock of its own, for tests that hold all of it in their hands.

#![allow(dead_code, reason = "each test binary uses its part")]

pub mod clock;
pub mod database;
pub mod service;
