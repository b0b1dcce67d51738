//! The aircraft that a client certificate is bound to.

use domain::{Actor, ContentHash, Principal, Scope};
use rustls::pki_types::CertificateDer;
use webpki::EndEntityCert;

/// The beginning of the URI that binds a certificate to an operator.
const OPERATOR: &str = "urn:actuary:operator:";
/// The part between the operator and the tail.
const TAIL: &str = ":tail:";

/// The aircraft that a certificate is for: exactly one URI `urn:actuary:operator:OPERATOR:tail:TAIL` among the
/// subject's alternative names.
pub fn bearer(certificate: &CertificateDer<'_>) -> Option<Principal> {
    let parsed = EndEntityCert::try_from(certificate).ok()?;
    let mut bindings = parsed.valid_uri_names().filter_map(|uri| uri.strip_prefix(OPERATOR));
    let (operator, tail) = bindings.next().filter(|_| bindings.next().is_none())?.split_once(TAIL)?;
    let (operator, tail) = (operator.parse().ok()?, tail.parse().ok()?);
    let actor = Actor::Certificate(ContentHash::of(certificate));
    Some(Principal { operator, scope: Scope::Aircraft(tail), actor })
}
