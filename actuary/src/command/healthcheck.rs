//! `actuary healthcheck`: asks a probe, for images that hold no other client.

use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::Args;
use reqwest::Url;

use crate::{
    http::{self, Access, Address, shown},
    say::say,
};

/// The probe of an address without path.
const READY: &str = "/readyz";

/// Ask a probe of a running process, and say what it answers: exit code 0 if it is well, 1 if it says that it is not, 3 if it does
/// not answer.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary healthcheck --url http://127.0.0.1:8080/readyz")]
pub struct Arguments {
    /// The probe; /readyz of an address without path.
    #[arg(long, env = "ACTUARY_HEALTH_URL", hide_env_values = true, default_value = "http://127.0.0.1:8080/readyz")]
    url: Address,
    #[command(flatten)]
    access: Access,
    /// Seconds until the answer must be there.
    #[arg(long, value_name = "S", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=60))]
    timeout_seconds: u64,
}

/// Asks.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut url = arguments.url.url()?;
    if url.path() == "/" {
        url.set_path(READY);
    }
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(ask(arguments, &url))
}

async fn ask(arguments: &Arguments, url: &Url) -> Result<()> {
    let http = arguments.access.client(url, Duration::from_secs(arguments.timeout_seconds))?;
    let answer = http.get(url.clone()).send().await.map_err(|error| http::silent(url, &error))?;
    let (status, from) = (answer.status(), answer.url().clone());
    let asked = shown(url);
    if status.is_success() && from.path() == url.path() {
        say!("{asked} answers {status}");
        return Ok(());
    }
    let led = if shown(&from) == asked { String::new() } else { format!(" leads to {}, which", shown(&from)) };
    Err(anyhow!("{asked}{led} answers {}", http::said(answer).await))
}
