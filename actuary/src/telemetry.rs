//! Logs on standard error; `RUST_LOG` chooses what, warnings and errors without it.

use std::{
    env,
    io::{self, IsTerminal},
};

use clap::{Args, ValueEnum};
use tracing_subscriber::EnvFilter;

use crate::say::note;

/// Logs, as the command line says it.
#[derive(Debug, Clone, Copy, Args)]
pub struct LogArguments {
    /// How the log on standard error is written; RUST_LOG chooses what is.
    #[arg(long, env = "ACTUARY_LOG_FORMAT", value_name = "FORMAT", value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

/// The form of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LogFormat {
    /// Lines to be read by people.
    Text,
    /// One JSON object per line, to be read by programs.
    Json,
}

impl LogArguments {
    /// Starts logging; text in colours where somebody looks on who has not asked for none.
    pub fn start(self) {
        let wanted = env::var(EnvFilter::DEFAULT_ENV).ok().filter(|wanted| !wanted.is_empty());
        let filter = wanted.map(EnvFilter::try_new).transpose().unwrap_or_else(|error| {
            note!("actuary: RUST_LOG: {error}; warnings and errors are logged");
            None
        });
        let colours = io::stderr().is_terminal() && env::var_os("NO_COLOR").is_none_or(|asked| asked.is_empty());
        let log = tracing_subscriber::fmt()
            .with_env_filter(filter.unwrap_or_else(|| EnvFilter::new("warn")))
            .with_writer(io::stderr)
            .with_ansi(colours)
            .log_internal_errors(false);
        match self.log_format {
            LogFormat::Text => log.init(),
            LogFormat::Json => log.with_ansi(false).json().flatten_event(true).with_span_list(false).init(),
        }
    }
}
