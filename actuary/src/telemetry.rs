//! Logs on standard error; `RUST_LOG` chooses what, warnings and errors without it.

use std::{
    env,
    io::{self, IsTerminal},
};

use tracing_subscriber::EnvFilter;

use crate::say::note;

/// Starts logging; in colours where somebody looks on who has not asked for none.
pub fn start() {
    let wanted = env::var(EnvFilter::DEFAULT_ENV).ok().filter(|wanted| !wanted.is_empty());
    let filter = wanted.map(EnvFilter::try_new).transpose().unwrap_or_else(|error| {
        note!("actuary: RUST_LOG: {error}; warnings and errors are logged");
        None
    });
    let colours = io::stderr().is_terminal() && env::var_os("NO_COLOR").is_none_or(|asked| asked.is_empty());
    tracing_subscriber::fmt()
        .with_env_filter(filter.unwrap_or_else(|| EnvFilter::new("warn")))
        .with_writer(io::stderr)
        .with_ansi(colours)
        .log_internal_errors(false)
        .init();
}
