//! TLS: certificates from files that may be exchanged while the service runs, and client certificates of aircraft.
//!
//! TLS 1.2 and 1.3; HTTP/2 or HTTP/1.1, as the client chooses. A client may show a certificate; one that is shown
//! has to be good: of the client authority, neither expired nor revoked, and bound to an aircraft.

mod bearer;

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
    sync::{Arc, RwLock},
    time::{Duration, SystemTime},
};

use domain::Timestamp;
use rustls::{
    CertificateError, DigitallySignedStruct, DistinguishedName, RootCertStore, ServerConfig, SignatureScheme,
    client::danger::HandshakeSignatureValid,
    crypto::{CryptoProvider, ring},
    pki_types::{CertificateDer, CertificateRevocationListDer, PrivateKeyDer, UnixTime, pem::PemObject},
    server::{
        WebPkiClientVerifier,
        danger::{ClientCertVerified, ClientCertVerifier},
    },
    time_provider::TimeProvider,
};
use tokio_rustls::TlsAcceptor;

pub use bearer::bearer;

use crate::state::Clock;

/// The protocols that a client may speak, the best first.
const PROTOCOLS: [&[u8]; 2] = [b"h2", b"http/1.1"];

/// The PEM files that TLS is made from.
#[derive(Debug, Clone)]
pub struct TlsFiles {
    /// The certificate of the service, and those between it and its authority.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// The authorities of client certificates; without them none is asked for.
    pub client_ca: Option<PathBuf>,
    /// The revocation lists of those authorities.
    pub client_crl: Option<PathBuf>,
}

/// A reason why TLS cannot be made from a file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", file.display())]
pub struct TlsError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub reason: String,
}

/// TLS as the files have it. Clones share it.
#[derive(Clone)]
pub struct Tls(Arc<Shared>);

struct Shared {
    files: TlsFiles,
    clock: Clock,
    now: RwLock<Loaded>,
}

/// The configuration that was made from the files.
struct Loaded {
    config: Arc<ServerConfig>,
    verifier: Option<Arc<dyn ClientCertVerifier>>,
    /// How the files were when they were last looked at.
    seen: Vec<Option<(SystemTime, u64)>>,
}

impl Tls {
    /// TLS from files; certificates are judged by `clock`.
    pub fn load(files: TlsFiles, clock: Clock) -> Result<Self, TlsError> {
        let now = RwLock::new(load(&files, &clock)?);
        Ok(Self(Arc::new(Shared { files, clock, now })))
    }

    /// Reads the files again; when that fails, what was made from them before stays in force. Connections go on, but
    /// client certificates that are good no longer end what they are used for.
    pub fn reload(&self) -> Result<(), TlsError> {
        let loaded = load(&self.0.files, &self.0.clock)?;
        *self.0.now.write().expect("no holder panics") = loaded;
        Ok(())
    }

    /// Reads the files again if any of them has changed; says in the log what came of it.
    pub fn refresh(&self) {
        let seen = self.0.files.seen();
        if self.0.now.read().expect("no holder panics").seen == seen {
            return;
        }
        match self.reload() {
            Ok(()) => tracing::info!("the files of TLS have changed: they are in force"),
            Err(error) => {
                // Not again before the next change.
                self.0.now.write().expect("no holder panics").seen = seen;
                tracing::error!(%error, "the files of TLS have changed, but what was in force stays");
            }
        }
    }

    /// Tells whether clients may show certificates.
    pub fn knows_clients(&self) -> bool {
        self.0.files.client_ca.is_some()
    }

    /// The acceptor that makes handshakes now.
    pub(crate) fn acceptor(&self) -> TlsAcceptor {
        self.0.now.read().expect("no holder panics").config.clone().into()
    }

    /// Judges the chain of a client certificate.
    pub(crate) fn judge(&self, chain: &[CertificateDer<'_>], now: Timestamp) -> Result<(), rustls::Error> {
        let verifier = self.0.now.read().expect("no holder panics").verifier.clone();
        let Some((certificate, intermediates)) = chain.split_first() else {
            return Err(rustls::Error::NoCertificatesPresented);
        };
        let verifier = verifier.ok_or(CertificateError::UnknownIssuer)?;
        verifier.verify_client_cert(certificate, intermediates, unix_time(now)).map(|_| ())
    }
}

impl fmt::Debug for Tls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.files.fmt(f)
    }
}

impl TlsFiles {
    fn all(&self) -> impl Iterator<Item = &Path> {
        let further = [&self.client_ca, &self.client_crl];
        [&self.certificate, &self.key].into_iter().chain(further.into_iter().flatten()).map(PathBuf::as_path)
    }

    /// The time at which each file was changed, and its length.
    fn seen(&self) -> Vec<Option<(SystemTime, u64)>> {
        let seen = |file: &Path| {
            let metadata = fs::metadata(file).ok()?;
            Some((metadata.modified().ok()?, metadata.len()))
        };
        self.all().map(seen).collect()
    }
}

fn load(files: &TlsFiles, clock: &Clock) -> Result<Loaded, TlsError> {
    // Before they are read: what changes meanwhile is seen next time.
    let seen = files.seen();
    let provider = Arc::new(ring::default_provider());
    let chain = certificates(&files.certificate)?;
    let key = PrivateKeyDer::from_pem_slice(&read(&files.key)?)
        .map_err(|_| wrong(&files.key, "no private key in PEM, or an encrypted one"))?;
    let verifier = files.client_ca.as_ref().map(|ca| verifier(ca, files.client_crl.as_deref(), &provider));
    let verifier = verifier.transpose()?;
    let builder = ServerConfig::builder_with_details(provider, Arc::new(Now(clock.clone())));
    let builder = builder.with_protocol_versions(&[&rustls::version::TLS13, &rustls::version::TLS12]);
    let builder = builder.map_err(|error| wrong(&files.certificate, error))?;
    let builder = match &verifier {
        Some(verifier) => builder.with_client_cert_verifier(verifier.clone()),
        None => builder.with_no_client_auth(),
    };
    let mut config = builder.with_single_cert(chain, key).map_err(|error| wrong(&files.key, error))?;
    config.alpn_protocols = PROTOCOLS.map(<[u8]>::to_vec).into();
    Ok(Loaded { config: Arc::new(config), verifier, seen })
}

fn verifier(
    ca: &Path,
    crl: Option<&Path>,
    provider: &Arc<CryptoProvider>,
) -> Result<Arc<dyn ClientCertVerifier>, TlsError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(ca)? {
        roots.add(certificate).map_err(|error| wrong(ca, error))?;
    }
    let builder = WebPkiClientVerifier::builder_with_provider(roots.into(), provider.clone()).allow_unauthenticated();
    let builder = match crl {
        None => builder,
        Some(crl) => builder.with_crls(revocations(crl)?),
    };
    let authorities = builder.build().map_err(|error| wrong(crl.unwrap_or(ca), error))?;
    Ok(Arc::new(AircraftVerifier { authorities }))
}

fn certificates(file: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let read = CertificateDer::pem_slice_iter(&read(file)?).collect::<Result<Vec<_>, _>>();
    let certificates = read.map_err(|error| wrong(file, error))?;
    match certificates.is_empty() {
        true => Err(wrong(file, "no certificate in PEM")),
        false => Ok(certificates),
    }
}

fn revocations(file: &Path) -> Result<Vec<CertificateRevocationListDer<'static>>, TlsError> {
    let read = CertificateRevocationListDer::pem_slice_iter(&read(file)?).collect::<Result<Vec<_>, _>>();
    let lists = read.map_err(|error| wrong(file, error))?;
    match lists.is_empty() {
        true => Err(wrong(file, "no revocation list in PEM")),
        false => Ok(lists),
    }
}

fn read(file: &Path) -> Result<Vec<u8>, TlsError> {
    fs::read(file).map_err(|error| wrong(file, error))
}

fn wrong(file: &Path, reason: impl fmt::Display) -> TlsError {
    TlsError { file: file.to_owned(), reason: reason.to_string() }
}

fn unix_time(at: Timestamp) -> UnixTime {
    UnixTime::since_unix_epoch(Duration::from_micros(at.micros().max(0).unsigned_abs()))
}

/// The present of the service.
struct Now(Clock);

impl fmt::Debug for Now {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Now")
    }
}

impl TimeProvider for Now {
    fn current_time(&self) -> Option<UnixTime> {
        Some(unix_time((self.0)()))
    }
}

/// Takes certificates that are of the client authority, and bound to an aircraft.
#[derive(Debug)]
struct AircraftVerifier {
    authorities: Arc<dyn ClientCertVerifier>,
}

impl ClientCertVerifier for AircraftVerifier {
    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, rustls::Error> {
        let verified = self.authorities.verify_client_cert(certificate, intermediates, now)?;
        match bearer(certificate) {
            Some(_) => Ok(verified),
            None => Err(CertificateError::ApplicationVerificationFailure.into()),
        }
    }

    fn client_auth_mandatory(&self) -> bool {
        self.authorities.client_auth_mandatory()
    }

    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.authorities.root_hint_subjects()
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.authorities.verify_tls12_signature(message, certificate, signature)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.authorities.verify_tls13_signature(message, certificate, signature)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.authorities.supported_verify_schemes()
    }
}

/// The fault of a client certificate, in words.
pub fn words(error: &rustls::Error) -> String {
    match error {
        rustls::Error::InvalidCertificate(error) => match error {
            CertificateError::ApplicationVerificationFailure => {
                "it is bound to no aircraft: one alternative name must \
                be the URI urn:actuary:operator:OPERATOR:tail:TAIL"
                    .to_owned()
            }
            CertificateError::Revoked => "it was revoked".to_owned(),
            CertificateError::UnknownIssuer => "no known authority has signed it".to_owned(),
            CertificateError::UnknownRevocationStatus => {
                "no revocation list of its authority is at hand: it may have been revoked".to_owned()
            }
            other => other.to_string(),
        },
        other => other.to_string(),
    }
}

/// The fault of a handshake, for the log, and whether it was the client's certificate.
pub fn refused(error: &io::Error) -> (String, bool) {
    let tls = error.get_ref().and_then(|error| error.downcast_ref::<rustls::Error>());
    match tls {
        Some(error) => (words(error), matches!(error, rustls::Error::InvalidCertificate(_))),
        None => (error.to_string(), false),
    }
}
