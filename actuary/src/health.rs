//! Where a process answers probes, as the command line says it.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use clap::Args;

/// An address for probes alone.
#[derive(Debug, Clone, Copy, Args)]
pub struct HealthArguments {
    /// Answer /healthz, /readyz, /version and /metrics, and nothing else, at this port; 0 takes any free one.
    #[arg(long, env = "ACTUARY_HEALTH_PORT", value_name = "PORT")]
    health_port: Option<u16>,
    /// The address of that port.
    #[arg(long, env = "ACTUARY_HEALTH_ADDRESS", value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    health_address: IpAddr,
}

impl HealthArguments {
    /// As an address, if one was asked for.
    pub fn address(self) -> Option<SocketAddr> {
        self.health_port.map(|port| SocketAddr::new(self.health_address, port))
    }
}
