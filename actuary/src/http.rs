//! How commands reach a service: over HTTP or HTTPS, with a token where one is asked for.

use std::{fmt, fs, path::PathBuf, time::Duration};

use anyhow::{Context, Result};
use clap::Args;
use domain::Token;
use reqwest::{
    Certificate, Client,
    header::{AUTHORIZATION, HeaderMap, HeaderValue},
};

use crate::exit::Failure;

/// By what a service is reached.
#[derive(Debug, Default, Args)]
pub struct Access {
    /// A token of the service, ID.SECRET. Better in the environment: other users of the machine see command lines.
    #[arg(long, env = "ACTUARY_TOKEN", hide_env_values = true, value_name = "TOKEN")]
    token: Option<Hidden>,
    /// PEM file of the authority that signs the service's certificate, if it is none that the system knows.
    #[arg(long, env = "ACTUARY_CA", value_name = "FILE")]
    ca: Option<PathBuf>,
}

/// A text that is not printed.
#[derive(Clone)]
struct Hidden(String);

impl From<String> for Hidden {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl fmt::Debug for Hidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Hidden")
    }
}

impl Access {
    /// A client for the service at `url`, which waits for answers for so long.
    pub fn client(&self, url: &str, patience: Duration) -> Result<Client> {
        let builder = Client::builder().timeout(patience).default_headers(self.headers()?);
        let builder = match &self.ca {
            Some(file) => {
                let wrong = |reason: String| Failure::BadInput(format!("--ca {}: {reason}", file.display()));
                let pem = fs::read(file).map_err(|error| wrong(error.to_string()))?;
                let certificates = Certificate::from_pem_bundle(&pem).map_err(|error| wrong(error.to_string()))?;
                if certificates.is_empty() {
                    return Err(wrong("no certificate in PEM".to_owned()).into());
                }
                builder.tls_certs_only(certificates)
            }
            // Without TLS, machines that know no authority at all will do.
            None if !url.starts_with("https:") => builder.tls_certs_only([]),
            None => builder,
        };
        builder.build().context("cannot make an HTTP client")
    }

    fn headers(&self) -> Result<HeaderMap> {
        let Some(Hidden(text)) = &self.token else { return Ok(HeaderMap::new()) };
        let token: Token = text.trim().parse().map_err(|error| Failure::BadInput(format!("--token: {error}")))?;
        let mut value: HeaderValue = format!("Bearer {}", token.reveal()).parse().context("--token")?;
        value.set_sensitive(true);
        Ok(HeaderMap::from_iter([(AUTHORIZATION, value)]))
    }
}

/// What is at the bottom of a failure, such as a certificate that nobody vouches for.
pub fn cause(error: &reqwest::Error) -> String {
    let mut cause: &dyn std::error::Error = error;
    while let Some(deeper) = cause.source() {
        cause = deeper;
    }
    cause.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_that_cannot_be_read_is_not_repeated() {
        let secret = "5ec2e75ec2e75ec2e7";
        let access = Access { token: Some(Hidden(secret.to_owned())), ca: None };
        let error = format!("{:#} {access:?}", access.headers().unwrap_err());
        assert!(error.contains("--token") && !error.contains(secret), "{error}");
    }
}
