//! The subcommands.

pub mod backtest;
pub mod demo;
pub mod diagnose;
pub mod due;
pub mod loads;
pub mod serve;
pub mod simulate;
pub mod train;
pub mod verify;
