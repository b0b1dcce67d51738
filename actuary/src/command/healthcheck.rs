//! `actuary healthcheck`: asks a probe, for images that hold no other client.

use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::Args;
use reqwest::Url;

use crate::{exit::Failure, http::Access};

/// Ask a probe of a running process: exit code 0 if it is well, 1 if it says that it is not, 3 if it does not answer.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary healthcheck --url http://127.0.0.1:8080/readyz")]
pub struct Arguments {
    /// The probe.
    #[arg(long, env = "ACTUARY_HEALTH_URL", default_value = "http://127.0.0.1:8080/readyz")]
    url: Url,
    #[command(flatten)]
    access: Access,
    /// Seconds until the answer must be there.
    #[arg(long, value_name = "S", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=60))]
    timeout_seconds: u64,
}

/// Asks.
pub fn run(arguments: &Arguments) -> Result<()> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(ask(arguments))
}

async fn ask(arguments: &Arguments) -> Result<()> {
    let Arguments { url, access, timeout_seconds } = arguments;
    let http = access.client(url.as_str(), Duration::from_secs(*timeout_seconds))?;
    let silent = |_| Failure::NotReachable(format!("no answer from {url} within {timeout_seconds} s"));
    let answer = http.get(url.clone()).send().await.map_err(silent)?;
    let status = answer.status();
    if status.is_success() {
        return Ok(());
    }
    let said = answer.text().await.unwrap_or_default();
    Err(anyhow!("{url} answers {status}: {said}"))
}
