//! What judges of forecasts promise, on simulated and on recorded lives.

mod backtest;
mod baselines;
mod benchmark;
mod bootstrap;
mod growth_changes_fleet;
#[path = "../../../prognosis/tests/it/histories/mod.rs"]
mod histories;
#[path = "../../../prognosis/tests/it/labelled/mod.rs"]
mod labelled;
mod metrics;
mod mixed;
mod oracle;
mod recorded_lives;
#[path = "../../../prognosis/tests/it/simulated/mod.rs"]
mod simulated;
mod small_benchmark;
mod stress;
mod thesis;
