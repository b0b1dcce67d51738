//! Credentials: a token in the header `Authorization`, or the certificate of a connection.

use std::sync::Arc;

use axum::http::{Extensions, HeaderMap, HeaderValue, header::AUTHORIZATION};
use base64::{Engine, engine::general_purpose::STANDARD};
use domain::Token;

use super::{ClientCertificate, Peer};
use crate::refusal::Unauthenticated;

/// The credential that a caller shows. A header comes before a certificate.
#[derive(Debug, Clone)]
pub enum Credential {
    /// Nothing at all.
    Nothing,
    /// A token.
    Token(Token),
    /// The certificate that the handshake of the connection found good.
    Certificate(Arc<ClientCertificate>),
}

impl Credential {
    /// The credential that a request shows.
    pub fn from_request(headers: &HeaderMap, extensions: &Extensions) -> Result<Self, Unauthenticated> {
        let mut given = headers.get_all(AUTHORIZATION).iter();
        match (given.next(), given.next()) {
            (Some(header), None) => Ok(Self::Token(token(header)?)),
            (Some(_), Some(_)) => Err(Unauthenticated::Twice),
            (None, _) => Ok(match extensions.get::<Peer>() {
                Some(Peer(Some(certificate))) => Self::Certificate(certificate.clone()),
                _ => Self::Nothing,
            }),
        }
    }
}

fn token(header: &HeaderValue) -> Result<Token, Unauthenticated> {
    let text = header.to_str().map_err(|_| Unauthenticated::Scheme)?;
    let (scheme, rest) = text.trim().split_once(' ').ok_or(Unauthenticated::Scheme)?;
    let rest = rest.trim_start();
    if scheme.eq_ignore_ascii_case("bearer") {
        return Ok(rest.parse()?);
    }
    if !scheme.eq_ignore_ascii_case("basic") {
        return Err(Unauthenticated::Scheme);
    }
    let pair = STANDARD.decode(rest).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    let pair = pair.ok_or(Unauthenticated::Scheme)?;
    let (id, secret) = pair.split_once(':').ok_or(Unauthenticated::Scheme)?;
    Ok(Token::from_parts(id, secret)?)
}

#[cfg(test)]
mod tests {
    use domain::token::InvalidToken;

    use super::*;

    const ID: &str = "0123456789abcdef";
    const SECRET: &str = "5ec2e7005ec2e7005ec2e7005ec2e7005ec2e7005ec2e7005ec2e7005ec2e700";

    fn read(values: &[&str]) -> Result<Credential, Unauthenticated> {
        let mut headers = HeaderMap::new();
        for value in values {
            headers.append(AUTHORIZATION, value.parse().unwrap());
        }
        Credential::from_request(&headers, &Extensions::new())
    }

    #[test]
    fn a_token_is_read_from_both_schemes() {
        let basic = format!("bAsIc {}", STANDARD.encode(format!("{ID}:{SECRET}")));
        for header in [format!("Bearer {ID}.{SECRET}"), format!("BEARER  {ID}.{SECRET}"), basic] {
            let Ok(Credential::Token(token)) = read(&[&header]) else { panic!("{header}") };
            assert_eq!(token.reveal(), format!("{ID}.{SECRET}"));
        }
        assert!(matches!(read(&[]), Ok(Credential::Nothing)));
    }

    #[test]
    fn what_cannot_be_read_is_refused_without_repeating_it() {
        let bearer = format!("Bearer {ID}.{SECRET}");
        let basic = |text: &str| format!("Basic {}", STANDARD.encode(text));
        let cases = [
            (vec!["Bearer".to_owned()], Unauthenticated::Scheme),
            (vec![SECRET.to_owned()], Unauthenticated::Scheme),
            (vec![format!("Digest {SECRET}")], Unauthenticated::Scheme),
            (vec![format!("Basic {SECRET}!")], Unauthenticated::Scheme),
            (vec![basic(SECRET)], Unauthenticated::Scheme),
            (vec![basic(&format!("{SECRET}:{SECRET}"))], Unauthenticated::NoToken(InvalidToken::Id)),
            (vec![format!("Bearer {SECRET}")], Unauthenticated::NoToken(InvalidToken::Parts)),
            (vec![format!("Bearer {ID}.{SECRET}0")], Unauthenticated::NoToken(InvalidToken::Secret)),
            (vec![bearer.clone(), bearer], Unauthenticated::Twice),
        ];
        for (headers, expected) in cases {
            let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
            let refusal = read(&headers).unwrap_err();
            assert_eq!(refusal, expected, "{headers:?}");
            assert!(!refusal.to_string().contains("5ec2"), "{refusal}");
        }
    }
}
