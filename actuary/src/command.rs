//! The subcommands.

mod postgres;
mod until;

pub mod backtest;
pub mod backup;
pub mod checks;
pub mod completions;
pub mod component;
pub mod demo;
pub mod diagnose;
pub mod due;
pub mod fleet;
pub mod frame;
pub mod healthcheck;
pub mod loads;
pub mod migrate;
pub mod model;
pub mod rebuild;
pub mod restore;
pub mod rul;
pub mod serve;
pub mod settings;
pub mod simulate;
pub mod token;
pub mod train;
pub mod verify;
pub mod watch;
pub mod what_if;
pub mod worker;
