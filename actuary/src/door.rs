//! The listener of a service: where it answers callers, and what it asks of those who come from elsewhere.

use std::{
    net::{IpAddr, Ipv4Addr, SocketAddr},
    num::NonZeroUsize,
    path::PathBuf,
    str::FromStr,
};

use anyhow::Result;
use clap::{Args, builder::FalseyValueParser};
use server::{HostName, Origin, Tls, TlsFiles};
use store::Store;
use tokio::signal::unix::Signal;

use crate::{clock::Clock, exit::Failure};

/// Connections at once, unless another number is asked for.
const MAX_CONNECTIONS: NonZeroUsize = NonZeroUsize::new(server::MAX_CONNECTIONS).expect("it is not 0");

/// Address, TLS and client certificates, as the command line says it.
#[derive(Debug, Args)]
pub struct DoorArguments {
    /// IP address to listen on, `0.0.0.0` or `0.0.0.0:8443`. Any but the loopback address needs a token that was
    /// created before, and --tls-cert or --plaintext.
    #[arg(long, env = "ACTUARY_LISTEN", value_name = "ADDR", default_value = "127.0.0.1")]
    listen: Listen,
    /// Port, unless the address has one; 0 takes any free one.
    #[arg(long, env = "ACTUARY_PORT", default_value_t = 8080)]
    port: u16,
    /// PEM file with the service's certificate and those between it and its authority: serve TLS.
    #[arg(long, env = "ACTUARY_TLS_CERT", value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// PEM file with its private key.
    #[arg(long, env = "ACTUARY_TLS_KEY", value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// PEM file with the authorities that sign certificates of aircraft, bound to them by the alternative name
    /// `urn:actuary:operator:OPERATOR:tail:TAIL`. Whoever signs with them vouches for every operator.
    #[arg(long, env = "ACTUARY_CLIENT_CA", value_name = "FILE", requires = "tls_cert")]
    client_ca: Option<PathBuf>,
    /// PEM file with the revocation list of each of those authorities. Like the other files it is read again when it
    /// changes, and at SIGHUP.
    #[arg(long, env = "ACTUARY_CLIENT_CRL", value_name = "FILE", requires = "client_ca")]
    client_crl: Option<PathBuf>,
    /// Take callers from elsewhere without TLS, because something before the service does it.
    #[arg(long, env = "ACTUARY_PLAINTEXT", conflicts_with = "tls_cert", value_parser = FalseyValueParser::new())]
    plaintext: bool,
    /// A name by which the service is called, with or without a port; may be given several times. Without any, every
    /// name will do, once there are tokens or a client authority; before, those of this machine only.
    #[arg(long = "host", env = "ACTUARY_HOSTS", value_name = "NAME", value_delimiter = ',')]
    hosts: Vec<HostName>,
    /// An origin of pages elsewhere that may call the service, such as a dashboard's, `https://dash.example`; may be given
    /// several times. Without any, none may.
    #[arg(long = "allow-origin", env = "ACTUARY_ALLOW_ORIGINS", value_name = "ORIGIN", value_delimiter = ',')]
    origins: Vec<Origin>,
    /// Connections at once; each may hold some 200 KB, and a file descriptor.
    #[arg(long, env = "ACTUARY_MAX_CONNECTIONS", value_name = "NUMBER", default_value_t = MAX_CONNECTIONS)]
    max_connections: NonZeroUsize,
}

/// An address that may lack its port.
#[derive(Debug, Clone, Copy)]
struct Listen {
    ip: IpAddr,
    port: Option<u16>,
}

impl FromStr for Listen {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = text.parse().map(|address: SocketAddr| Self { ip: address.ip(), port: Some(address.port()) });
        let ip = text.trim_start_matches('[').trim_end_matches(']').parse().map(|ip| Self { ip, port: None });
        whole.or(ip).map_err(|_| "must be an IP address, with or without a port".to_owned())
    }
}

/// Where a service answers callers, and how.
pub struct Door {
    /// The address.
    pub address: SocketAddr,
    /// With TLS or without.
    pub tls: Option<Tls>,
    /// The names by which it is called where it asks who calls; none: by any.
    pub hosts: Vec<HostName>,
    /// The origins of pages elsewhere that may call it.
    pub origins: Vec<Origin>,
    /// Connections at once.
    pub max_connections: NonZeroUsize,
}

impl DoorArguments {
    /// The door; certificates are judged by `clock`.
    pub fn door(self, clock: Clock) -> Result<Door> {
        let address = SocketAddr::new(self.listen.ip, self.listen.port.unwrap_or(self.port));
        let files = self.tls_cert.zip(self.tls_key).map(|(certificate, key)| TlsFiles {
            certificate,
            key,
            client_ca: self.client_ca,
            client_crl: self.client_crl,
        });
        if files.is_none() && !self.plaintext && !address.ip().is_loopback() {
            return Err(Failure::BadInput(format!(
                "--listen {address}: tokens would cross the network for all to read: give --tls-cert and --tls-key, or \
                 --plaintext where a proxy before the service does TLS"
            ))
            .into());
        }
        let tls = files.map(|files| Tls::load(files, clock)).transpose();
        let tls = tls.map_err(|error| Failure::BadInput(error.to_string()))?;
        let Self { hosts, origins, max_connections, .. } = self;
        Ok(Door { address, tls, hosts, origins, max_connections })
    }
}

impl Door {
    /// A door that only this machine reaches.
    pub fn loopback(port: u16) -> Self {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let (hosts, origins) = (Vec::new(), Vec::new());
        Self { address, tls: None, hosts, origins, max_connections: MAX_CONNECTIONS }
    }

    /// Refuses to let in callers from elsewhere as long as nothing tells them apart.
    pub async fn must_be_guarded(&self, store: &Store) -> Result<()> {
        if self.address.ip().is_loopback() || store.has_tokens().await? {
            return Ok(());
        }
        Err(Failure::BadInput(format!(
            "--listen {}: no token was ever created, so everyone there would be the administrator: create one with \
             `actuary token create`, or listen on 127.0.0.1",
            self.address
        ))
        .into())
    }
}

/// Reads the files of TLS again at each SIGHUP, for ever; without TLS there is nothing to read, and the service goes on.
pub async fn heed_hangups(mut hangups: Signal, tls: Option<Tls>) {
    while hangups.recv().await.is_some() {
        match tls.as_ref().map(Tls::reload) {
            None => tracing::warn!("SIGHUP changes nothing: this process has no files of TLS to read again"),
            Some(Ok(())) => tracing::info!("the files of TLS were read again"),
            Some(Err(error)) => {
                tracing::error!(%error, "the files of TLS cannot be read again: what was in force stays");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_lack_its_port() {
        let read = |text: &str| text.parse::<Listen>().map(|listen| (listen.ip.to_string(), listen.port));
        assert_eq!(read("0.0.0.0"), Ok(("0.0.0.0".to_owned(), None)));
        assert_eq!(read("0.0.0.0:8443"), Ok(("0.0.0.0".to_owned(), Some(8443))));
        assert_eq!(read("[::1]"), Ok(("::1".to_owned(), None)));
        assert_eq!(read("[::]:80"), Ok(("::".to_owned(), Some(80))));
        assert!(read("localhost").is_err() && read("1.2.3.4:99999").is_err() && read("").is_err());
    }
}
