//! What the prognosis promises, on simulated and on recorded lives.

mod backtest;
mod baselines;
mod benchmark;
mod bootstrap;
mod checkpoint;
mod consistency;
mod forecast;
mod growth;
mod growth_changes;
mod growth_changes_fleet;
mod hierarchy;
mod histories;
mod labelled;
mod metrics;
mod noise;
mod oracle;
mod simulated;
mod surrogate;
mod thesis;
