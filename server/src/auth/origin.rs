//! The origins of pages that may call the service from elsewhere, such as a dashboard's: each is named exactly.

use std::str::FromStr;

use axum::http::{HeaderValue, uri::Authority};

/// The origin of a page: scheme, host and port, as a browser writes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin(String);

/// A reason why a text is no origin.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoOrigin {
    /// Everyone would be meant.
    #[error("names everyone: give each origin by itself, as in https://dash.example")]
    Everyone,
    /// It is not written like one.
    #[error(
        "must be http:// or https:// and a host, with or without a port, as in https://dash.example, and nothing else"
    )]
    Form,
}

impl FromStr for Origin {
    type Err = NoOrigin;

    fn from_str(text: &str) -> Result<Self, NoOrigin> {
        if text.contains('*') {
            return Err(NoOrigin::Everyone);
        }
        let text = text.to_ascii_lowercase();
        let (scheme, host) = text.split_once("://").ok_or(NoOrigin::Form)?;
        let usual_port = match scheme {
            "http" => 80,
            "https" => 443,
            _ => return Err(NoOrigin::Form),
        };
        let authority: Authority = host.parse().map_err(|_| NoOrigin::Form)?;
        let behind_host = host.strip_prefix(authority.host()).filter(|_| !authority.host().is_empty());
        let port: Option<u16> = match behind_host.ok_or(NoOrigin::Form)?.strip_prefix(':') {
            Some(port) => Some(port.parse().map_err(|_| NoOrigin::Form)?),
            None if behind_host == Some("") => None,
            None => return Err(NoOrigin::Form),
        };
        let host = authority.host();
        // Browsers leave the usual port out.
        Ok(Self(match port.filter(|port| *port != usual_port) {
            None => format!("{scheme}://{host}"),
            Some(port) => format!("{scheme}://{host}:{port}"),
        }))
    }
}

impl Origin {
    /// The value of the header `Origin` of its pages.
    pub fn header(&self) -> HeaderValue {
        HeaderValue::try_from(&self.0).expect("an authority makes a header")
    }

    /// Tells whether a header `Origin` names it.
    pub fn is(&self, header: &HeaderValue) -> bool {
        header.as_bytes() == self.0.as_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_written_as_browsers_do() {
        let read = |text: &str| text.parse::<Origin>().map(|origin| origin.0);
        assert_eq!(read("https://Dash.Example"), Ok("https://dash.example".to_owned()));
        assert_eq!(read("https://dash.example:443"), Ok("https://dash.example".to_owned()));
        assert_eq!(read("http://localhost:3000"), Ok("http://localhost:3000".to_owned()));
        assert_eq!(read("http://[::1]:80"), Ok("http://[::1]".to_owned()));
        for text in ["*", "https://*", "https://*.example"] {
            assert_eq!(read(text), Err(NoOrigin::Everyone), "{text}");
        }
        for text in [
            "",
            "null",
            "dash.example",
            "https://",
            "ftp://dash.example",
            "https://dash.example/",
            "https://a@b",
            "https://dash.example:",
            "https://dash.example:99999",
            "https://a b",
            "https://a,https://b",
        ] {
            assert_eq!(read(text), Err(NoOrigin::Form), "{text}");
        }
    }
}
