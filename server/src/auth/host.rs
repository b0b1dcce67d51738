//! The names by which a service may be called. A page of another site can make a browser call this one under a name of
//! its own that it has pointed here; such a call is known by that name alone.

use std::{net::IpAddr, str::FromStr};

use axum::http::{HeaderMap, Uri, header::HOST, uri::Authority};

/// A name by which a service may be called, at one port or at any.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostName {
    name: String,
    port: Option<u16>,
}

/// A reason why a text is no name of a host.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("must be a host name or an IP address, with or without a port")]
pub struct NoHostName;

impl FromStr for HostName {
    type Err = NoHostName;

    fn from_str(text: &str) -> Result<Self, NoHostName> {
        let authority: Authority = text.parse().map_err(|_| NoHostName)?;
        let name = authority.host().trim_end_matches('.').to_ascii_lowercase();
        let port = authority.port().map(|port| port.as_str().parse().map_err(|_| NoHostName)).transpose()?;
        match name.is_empty() || text.contains('@') {
            true => Err(NoHostName),
            false => Ok(Self { name, port }),
        }
    }
}

impl HostName {
    /// The name that a request calls; `None` where it calls none, several, or nothing that is one.
    pub fn called(uri: &Uri, headers: &HeaderMap) -> Option<Self> {
        let mut hosts = headers.get_all(HOST).iter();
        match (uri.authority(), hosts.next(), hosts.next()) {
            (Some(authority), _, None) => authority.as_str().parse().ok(),
            (None, Some(host), None) => host.to_str().ok()?.parse().ok(),
            _ => None,
        }
    }

    /// Tells whether it means this machine, whoever resolves it: `localhost` and what is below it (RFC 6761), and the
    /// addresses of the loopback interface.
    pub fn is_loopback(&self) -> bool {
        let ip = self.name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        let named = self.name == "localhost" || self.name.ends_with(".localhost");
        named || ip.is_ok_and(|ip| ip.to_canonical().is_loopback())
    }

    /// Tells whether who calls `other` means this name.
    pub fn covers(&self, other: &Self) -> bool {
        self.name == other.name && (self.port.is_none() || self.port == other.port)
    }

    /// Tells whether a page of this origin is of the same host and port.
    pub fn is_origin(&self, origin: &str) -> bool {
        let Some((scheme, host)) = origin.split_once("://") else { return false };
        let usual = match scheme {
            "http" => 80,
            "https" => 443,
            _ => return false,
        };
        let origin = host.parse::<Self>();
        origin.is_ok_and(|o| o.name == self.name && o.port.unwrap_or(usual) == self.port.unwrap_or(usual))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> HostName {
        text.parse().unwrap()
    }

    #[test]
    fn names_of_this_machine_are_known_whatever_their_port_and_case() {
        for text in ["localhost", "LocalHost:8080", "localhost.", "a.localhost", "127.0.0.1", "127.9.9.9:1", "[::1]:80"]
        {
            assert!(name(text).is_loopback(), "{text}");
        }
        let others = ["evil.example", "localhost.evil.example", "notlocalhost", "127.0.0.1.evil.example", "0.0.0.0"];
        for text in others.into_iter().chain(["[::]", "10.0.0.1:8080", "127.1"]) {
            assert!(!name(text).is_loopback(), "{text}");
        }
        for text in ["", ":80", "a b", "evil.example@localhost", "http://localhost", "localhost/x"] {
            assert_eq!(text.parse::<HostName>(), Err(NoHostName), "{text}");
        }
    }

    #[test]
    fn a_name_without_a_port_covers_every_port() {
        assert!(name("health.example").covers(&name("HEALTH.example.:8443")));
        assert!(name("health.example:8443").covers(&name("health.example:8443")));
        assert!(!name("health.example:8443").covers(&name("health.example")));
        assert!(!name("health.example").covers(&name("evil.example")));
    }

    #[test]
    fn what_is_called_is_one_name() {
        let called = |uri: &'static str, hosts: &[&'static str]| {
            let mut headers = HeaderMap::new();
            for host in hosts {
                headers.append(HOST, host.parse().unwrap());
            }
            HostName::called(&Uri::from_static(uri), &headers)
        };
        assert_eq!(called("/v1", &["a:1"]), Some(name("a:1")));
        assert_eq!(called("http://b:2/v1", &["a:1"]), Some(name("b:2")));
        assert_eq!(called("http://b:2/v1", &[]), Some(name("b:2")));
        for (uri, hosts) in [("/v1", vec![]), ("/v1", vec!["a", "b"]), ("http://b/", vec!["a", "b"]), ("/v1", vec![""])]
        {
            assert_eq!(called(uri, &hosts), None, "{uri} {hosts:?}");
        }
    }
}
