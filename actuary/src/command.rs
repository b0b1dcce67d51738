//! The subcommands.

pub mod backtest;
pub mod demo;
pub mod diagnose;
pub mod due;
pub mod healthcheck;
pub mod loads;
pub mod migrate;
pub mod serve;
pub mod simulate;
pub mod token;
pub mod train;
pub mod verify;
pub mod worker;
