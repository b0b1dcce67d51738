//! How a process works, as the command line says it.

use std::{num::NonZeroUsize, time::Duration};

use clap::Args;

use crate::service::Work;

/// Settings of the worker in a process.
#[derive(Debug, Clone, Args)]
pub struct WorkArguments {
    /// Components analysed at the same time; one per core when not given.
    #[arg(long, env = "ACTUARY_LANES", value_name = "N")]
    lanes: Option<NonZeroUsize>,
    /// Seconds after which another worker may take over a component that one has claimed; they double with each attempt
    /// that ends without a result, up to 8 times.
    #[arg(long, env = "ACTUARY_LEASE_SECONDS", value_name = "S", default_value_t = 120, hide_short_help = true,
        value_parser = clap::value_parser!(u64).range(1..=86_400))]
    lease_seconds: u64,
}

impl WorkArguments {
    /// As a part of a process.
    pub fn work(&self) -> Work {
        let lanes = self.lanes.unwrap_or(Work::default().lanes);
        Work { lanes, lease: Duration::from_secs(self.lease_seconds) }
    }
}
