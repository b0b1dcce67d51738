//! Aircraft that show a client certificate: the keeper of the client authority vouches for operator and tail.

use std::sync::{Arc, Mutex};

use domain::{Principal, Timestamp};
use rustls::pki_types::CertificateDer;

use super::freshness::is_fresh;
use crate::{
    refusal::Unauthenticated,
    tls::{Tls, bearer, words},
};

/// The certificate of a connection, if the client showed one; an extension of every request.
#[derive(Debug, Clone)]
pub struct Peer(pub Option<Arc<ClientCertificate>>);

/// A certificate that was good in the handshake, and whose it is.
#[derive(Debug)]
pub struct ClientCertificate {
    principal: Principal,
    chain: Vec<CertificateDer<'static>>,
    tls: Tls,
    judged_at: Mutex<Option<Timestamp>>,
}

impl ClientCertificate {
    /// The certificate at the head of a chain that a handshake of `tls` found good.
    pub fn new(chain: &[CertificateDer<'_>], tls: Tls) -> Option<Self> {
        let principal = bearer(chain.first()?)?;
        let chain = chain.iter().map(|certificate| certificate.clone().into_owned()).collect();
        Some(Self { principal, chain, tls, judged_at: Mutex::new(None) })
    }

    /// The principal that it is bound to, if it is still good: connections outlive certificates, and are resumed
    /// without showing them.
    pub fn admit(&self, now: Timestamp) -> Result<&Principal, Unauthenticated> {
        let mut judged_at = self.judged_at.lock().expect("no holder panics");
        if !judged_at.is_some_and(|at| is_fresh(at, now)) {
            let judged = self.tls.judge(&self.chain, now);
            judged.map_err(|error| Unauthenticated::Certificate(words(&error)))?;
            *judged_at = Some(now);
        }
        Ok(&self.principal)
    }
}
