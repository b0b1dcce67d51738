//! How commands reach a service: over HTTP or HTTPS, with a token where one is asked for.

use std::{fmt, fs, path::PathBuf, time::Duration};

use anyhow::{Context, Result};
use clap::Args;
use domain::Token;
use proto::json::Problem;
use reqwest::{
    Certificate, Client, Response, Url,
    header::{AUTHORIZATION, HeaderMap, HeaderValue},
};

use crate::exit::Failure;

/// The schemes of a service.
const SCHEMES: [&str; 2] = ["http", "https"];
/// So much of an answer that is none of this service's is repeated, characters.
const REPEATED: usize = 200;

/// The address of a service, `--url`. A user or password in it is in no message.
#[derive(Clone)]
pub struct Address(String);

impl From<String> for Address {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Address({self})")
    }
}

impl fmt::Display for Address {
    /// Without user, password and query.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.0.trim();
        let (scheme, rest) = text.split_once("://").map_or(("", text), |(scheme, rest)| (scheme, rest));
        let rest = rest.rsplit_once('@').map_or(rest, |(_, place)| place);
        let place = rest.split(['?', '#']).next().unwrap_or_default();
        if scheme.is_empty() { f.write_str(place) } else { write!(f, "{scheme}://{place}") }
    }
}

impl Address {
    /// As a URL of HTTP or HTTPS.
    pub fn url(&self) -> Result<Url, Failure> {
        let refuse = |reason: String| Failure::BadInput(format!("--url {self}: {reason}"));
        let text = self.0.trim();
        if text.is_empty() {
            return Err(Failure::BadInput("--url: is empty, and should be such as http://127.0.0.1:8080".to_owned()));
        }
        match text.parse::<Url>() {
            Ok(url) if SCHEMES.contains(&url.scheme()) => Ok(url),
            Err(error) if SCHEMES.iter().any(|scheme| text.starts_with(&format!("{scheme}:"))) => {
                Err(refuse(error.to_string()))
            }
            _ if text.contains("://") => Err(refuse("must begin with http:// or https://".to_owned())),
            _ => Err(refuse(format!("http:// or https:// is missing, as in http://{self}"))),
        }
    }
}

/// A URL without what may be secret in it.
pub fn shown(url: &Url) -> String {
    Address(url.to_string()).to_string()
}

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
    pub fn client(&self, url: &Url, patience: Duration) -> Result<Client> {
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
            None if url.scheme() != "https" => builder.tls_certs_only([]),
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

/// Why there is no answer, as far as it can be told.
pub fn silent(url: &Url, error: &reqwest::Error) -> Failure {
    let cause = cause(error);
    let hint = match url.scheme() {
        "https" if cause.contains("corrupt message") => ": if it speaks no TLS, its address begins with http://",
        "http" if !(error.is_connect() || error.is_timeout() || error.is_redirect()) => {
            ": if it speaks TLS, its address begins with https://"
        }
        _ => "",
    };
    Failure::NotReachable(format!("no service answers at {}: {cause}{hint}", shown(url)))
}

/// What an answer says that is not the one hoped for, in one line.
pub async fn said(answer: Response) -> String {
    let status = answer.status();
    let body = answer.text().await.unwrap_or_default();
    let words = match serde_json::from_str::<Problem>(&body) {
        Ok(problem) => problem.detail,
        Err(_) => body.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(REPEATED).collect(),
    };
    if words.is_empty() { status.to_string() } else { format!("{status}: {words}") }
}

/// What is at the bottom of a failure, such as a certificate that nobody vouches for.
fn cause(error: &reqwest::Error) -> String {
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
    #[test]
    fn an_address_without_scheme_is_told_what_is_missing_and_no_secret_of_it_is_repeated() {
        let read = |text: &str| Address::from(text.to_owned()).url().map(String::from).map_err(|it| it.to_string());
        assert_eq!(read("http://127.0.0.1:8080").as_deref(), Ok("http://127.0.0.1:8080/"));
        assert_eq!(read(" https://fleet.example/actuary/ ").as_deref(), Ok("https://fleet.example/actuary/"));
        for bare in ["127.0.0.1:8080", "localhost:8080", "nowhere", "[::1]:8080", "user:5ec2e7@localhost:8080?t=5ec2e7"]
        {
            let said = read(bare).unwrap_err();
            let place = bare.trim_start_matches("user:5ec2e7@").trim_end_matches("?t=5ec2e7");
            assert!(said.contains(&format!("is missing, as in http://{place}")) && !said.contains("5ec2e7"), "{said}");
        }
        for (wrong, words) in [
            ("", "is empty"),
            ("ftp://user:5ec2e7@host", "--url ftp://host: must begin with http:// or https://"),
            ("http://user:5ec2e7@host:99999/?t=5ec2e7", "--url http://host:99999/: invalid port"),
            ("https://", "empty host"),
        ] {
            let said = read(wrong).unwrap_err();
            assert!(said.contains(words) && !said.contains("5ec2e7"), "{said}");
        }
        let with_secrets = Address::from("https://user:5ec2e7@host/x?t=5ec2e7".to_owned());
        assert_eq!(shown(&with_secrets.url().unwrap()), "https://host/x");
        assert_eq!(format!("{with_secrets:?}"), "Address(https://host/x)");
    }
}
