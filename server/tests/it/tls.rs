//! Behind TLS: what a handshake takes, and what aircraft do with their certificates.

use std::{fs, path::PathBuf};

use proto::v1::ingest_client::IngestClient;
use rcgen::{
    BasicConstraints, CertificateParams, CertificateRevocationListParams, ExtendedKeyUsagePurpose, IsCa, Issuer,
    KeyIdMethod, KeyPair, KeyUsagePurpose, RevokedCertParams, SanType, SerialNumber, date_time_ymd,
};
use reqwest::{Certificate, Client, Identity};
use server::TlsFiles;
use tempfile::TempDir;
use tokio::{io::AsyncReadExt, net::TcpStream};
use tonic::{
    Code,
    transport::{Channel, ClientTlsConfig, Endpoint},
};

use crate::{
    callers::{aircraft, bearer},
    house::{House, problem},
    log,
};

const OWN: &str = "urn:actuary:operator:default:tail:EC-MXA";

/// Who signs certificates.
struct Authority {
    issuer: Issuer<'static, KeyPair>,
    pem: String,
}

/// What a certificate says.
struct Wanted<'a> {
    uris: &'a [&'a str],
    serial: u64,
    /// The year in which it ends, on the first of January.
    until: i32,
}

impl Default for Wanted<'_> {
    fn default() -> Self {
        Self { uris: &[OWN], serial: 1, until: 2100 }
    }
}

impl Authority {
    fn new(name: &str) -> Self {
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::default();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.distinguished_name.push(rcgen::DnType::CommonName, name);
        let pem = params.self_signed(&key).unwrap().pem();
        Self { issuer: Issuer::new(params, key), pem }
    }

    /// A certificate and its key.
    fn sign(&self, mut params: CertificateParams) -> (String, String) {
        let key = KeyPair::generate().unwrap();
        params.not_before = date_time_ymd(2020, 1, 1);
        (params.signed_by(&key, &self.issuer).unwrap().pem(), key.serialize_pem())
    }

    /// The certificate of the service.
    fn service(&self) -> (String, String) {
        self.sign(CertificateParams::new(["127.0.0.1".to_owned()]).unwrap())
    }

    /// A client certificate and its key, in one text.
    fn client(&self, wanted: &Wanted) -> String {
        let mut params = CertificateParams::default();
        params.subject_alt_names =
            wanted.uris.iter().map(|uri| SanType::URI((*uri).to_owned().try_into().unwrap())).collect();
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        params.serial_number = Some(SerialNumber::from(wanted.serial));
        params.not_after = date_time_ymd(wanted.until, 1, 1);
        let (certificate, key) = self.sign(params);
        certificate + &key
    }

    /// A revocation list.
    fn revoke(&self, serials: &[u64]) -> String {
        let revoked = |serial: &u64| RevokedCertParams {
            serial_number: SerialNumber::from(*serial),
            revocation_time: date_time_ymd(2026, 1, 1),
            reason_code: None,
            invalidity_date: None,
        };
        let params = CertificateRevocationListParams {
            this_update: date_time_ymd(2026, 1, 1),
            next_update: date_time_ymd(2100, 1, 1),
            crl_number: SerialNumber::from(1),
            issuing_distribution_point: None,
            revoked_certs: serials.iter().map(revoked).collect(),
            key_identifier_method: KeyIdMethod::Sha256,
        };
        params.signed_by(&self.issuer).unwrap().pem().unwrap()
    }
}

/// A house behind TLS, and who signs for it.
struct Fortress {
    house: House,
    services: Authority,
    clients: Authority,
    folder: TempDir,
}

impl Fortress {
    async fn open() -> Self {
        let (services, clients) = (Authority::new("services"), Authority::new("clients"));
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = services.service();
        let write = |name: &str, text: &str| -> PathBuf {
            let file = folder.path().join(name);
            fs::write(&file, text).unwrap();
            file
        };
        let files = TlsFiles {
            certificate: write("service.pem", &certificate),
            key: write("service.key", &key),
            client_ca: Some(write("clients.pem", &clients.pem)),
            client_crl: Some(write("revoked.pem", &clients.revoke(&[]))),
        };
        Self { house: House::with_tls(files).await, services, clients, folder }
    }

    /// A client that trusts the service and shows a certificate.
    fn client(&self, identity: Option<&str>) -> Client {
        self.tuned(identity, |builder| builder)
    }

    fn tuned(
        &self,
        identity: Option<&str>,
        tune: impl FnOnce(reqwest::ClientBuilder) -> reqwest::ClientBuilder,
    ) -> Client {
        let root = Certificate::from_pem(self.services.pem.as_bytes()).unwrap();
        let builder = tune(Client::builder().tls_certs_only([root]));
        let builder = match identity {
            Some(pem) => builder.identity(Identity::from_pem(pem.as_bytes()).unwrap()),
            None => builder,
        };
        builder.build().unwrap()
    }

    async fn channel(&self, identity: &str) -> Channel {
        let root = tonic::transport::Certificate::from_pem(&self.services.pem);
        let (certificate, key) = identity.split_at(identity.find("-----BEGIN PRIVATE").unwrap());
        let identity = tonic::transport::Identity::from_pem(certificate, key);
        let tls = ClientTlsConfig::new().ca_certificate(root).identity(identity);
        Endpoint::new(self.house.url.clone()).unwrap().tls_config(tls).unwrap().connect().await.unwrap()
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.house.url)
    }

    /// Why a certificate is refused, as the client is told.
    async fn refused(&self, identity: &str) -> String {
        let told = async |client: Client| {
            let error = client.get(self.url("/healthz")).send().await.unwrap_err();
            format!("{error:?}")
        };
        let old = |builder: reqwest::ClientBuilder| builder.tls_version_max(reqwest::tls::Version::TLS_1_2);
        let (new, old) = (told(self.client(Some(identity))).await, told(self.tuned(Some(identity), old)).await);
        let alert = |error: &str| {
            error.split("AlertReceived(").nth(1).and_then(|rest| rest.split(')').next().map(str::to_owned))
        };
        assert_eq!(alert(&new), alert(&old), "{new} {old}");
        alert(&new).unwrap_or(new)
    }
}

#[tokio::test]
async fn a_certificate_is_an_aircraft() {
    let fortress = Fortress::open().await;
    let house = &fortress.house;
    let identity = fortress.clients.client(&Wanted::default());
    let client = fortress.client(Some(&identity));
    let upload = async |tail: &str, name: &str| {
        let body = house.body(name, 1.0);
        client.post(fortress.url(&format!("/v1/tails/{tail}/uploads"))).json(&body).send().await.unwrap()
    };
    assert_eq!(upload("EC-MXA", "u1").await.status(), 202);
    problem(upload("EC-MXB", "u2").await, 403).await;
    problem(client.get(fortress.url("/v1/tails")).send().await.unwrap(), 403).await;
    assert_eq!(client.get(fortress.url("/v1/uploads/u1")).send().await.unwrap().status(), 200);
    let mut grpc = IngestClient::new(fortress.channel(&identity).await);
    assert_eq!(grpc.upload(house.request("u3", 3.0)).await.unwrap().into_inner().upload_id, "u3");
    let mut foreign = house.request("u4", 4.0);
    foreign.tail = "EC-MXB".to_owned();
    assert_eq!(grpc.upload(foreign).await.unwrap_err().code(), Code::PermissionDenied);
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn others_show_tokens_on_the_same_port_and_nobody_shows_nothing() {
    let fortress = Fortress::open().await;
    let client = fortress.client(None);
    let read = || client.get(fortress.url("/v1/tails"));
    problem(read().send().await.unwrap(), 401).await;
    assert_eq!(client.get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
    let token = fortress.house.token("default", domain::Scope::Ops).await;
    assert_eq!(read().header("authorization", bearer(&token)).send().await.unwrap().status(), 200);
    // A header comes before a certificate.
    let both = fortress.client(Some(&fortress.clients.client(&Wanted::default())));
    let read = both.get(fortress.url("/v1/tails")).header("authorization", bearer(&token));
    assert_eq!(read.send().await.unwrap().status(), 200);
    let other = fortress.house.token("default", aircraft("EC-MXB")).await;
    let upload = both.post(fortress.url("/v1/tails/EC-MXA/uploads")).json(&fortress.house.body("u1", 1.0));
    problem(upload.header("authorization", bearer(&other)).send().await.unwrap(), 403).await;
}

#[tokio::test]
async fn certificates_that_are_not_good_are_refused_with_the_reason() {
    let log = log::open();
    let fortress = Fortress::open().await;
    let foreign = Authority::new("others").client(&Wanted::default());
    assert_eq!(fortress.refused(&foreign).await, "UnknownCA");
    let expired = fortress.clients.client(&Wanted { until: 2026, ..Wanted::default() });
    assert_eq!(fortress.refused(&expired).await, "CertificateExpired");
    let others = [
        &[][..],
        &["urn:actuary:operator:default"],
        &["urn:actuary:operator:default:tail:ec-mxa"],
        &["https://example.com/urn:actuary:operator:default:tail:EC-MXA"],
        &[OWN, "urn:actuary:operator:other:tail:EC-MXA"],
    ];
    for uris in others {
        let unbound = fortress.clients.client(&Wanted { uris, ..Wanted::default() });
        assert_eq!(fortress.refused(&unbound).await, "AccessDenied", "{uris:?}");
    }
    let lines = log.text();
    let refused = |reason: &str| {
        let told = |line: &&str| line.contains("WARN") && line.contains("a client certificate was refused");
        lines.lines().filter(told).filter(|line| line.contains(reason)).count()
    };
    // One line for each handshake, of both versions.
    assert_eq!(refused("no known authority has signed it"), 2, "{lines}");
    assert_eq!(refused("certificate expired"), 2);
    assert_eq!(refused("it is bound to no aircraft"), 2 * others.len());
    // The service goes on.
    assert_eq!(fortress.client(None).get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
}

#[tokio::test]
async fn a_certificate_that_expires_is_refused_on_connections_that_are_open() {
    let fortress = Fortress::open().await;
    let client = fortress.client(Some(&fortress.clients.client(&Wanted { until: 2027, ..Wanted::default() })));
    assert_eq!(client.get(fortress.url("/v1/models")).send().await.unwrap().status(), 200);
    fortress.house.wait_days(400.0);
    let refused = problem(client.get(fortress.url("/v1/models")).send().await.unwrap(), 401).await;
    assert!(refused["detail"].as_str().unwrap().contains("expired"), "{refused}");
}

#[tokio::test]
async fn a_revoked_certificate_is_refused_in_handshakes_and_on_connections_that_are_open() {
    let fortress = Fortress::open().await;
    let (lost, kept) = (Wanted::default(), Wanted { serial: 2, ..Wanted::default() });
    let identity = fortress.clients.client(&lost);
    let (lost, kept) = (fortress.client(Some(&identity)), fortress.client(Some(&fortress.clients.client(&kept))));
    let read = async |client: &Client| client.get(fortress.url("/v1/models")).send().await.unwrap();
    let grpc = fortress.channel(&identity).await;
    let mut acks = {
        let pending = tokio_stream::pending::<proto::v1::UploadRequest>();
        IngestClient::new(grpc).upload_stream(pending).await.unwrap().into_inner()
    };
    assert_eq!(read(&lost).await.status(), 200);
    fs::write(fortress.folder.path().join("revoked.pem"), fortress.clients.revoke(&[1])).unwrap();
    fortress.house.tls.as_ref().unwrap().reload().unwrap();
    fortress.house.wait_ms(500);
    let refused = problem(read(&lost).await, 401).await;
    assert!(refused["detail"].as_str().unwrap().contains("revoked"), "{refused}");
    assert_eq!(acks.message().await.unwrap_err().code(), Code::Unauthenticated);
    assert_eq!(fortress.refused(&identity).await, "CertificateRevoked");
    assert_eq!(read(&kept).await.status(), 200);
}

#[tokio::test]
async fn files_that_change_are_read_again_and_bad_ones_change_nothing() {
    let fortress = Fortress::open().await;
    let tls = fortress.house.tls.clone().unwrap();
    let file = fortress.folder.path().join("service.pem");
    fs::write(&file, "this is no certificate, however long it may be").unwrap();
    assert!(tls.reload().unwrap_err().to_string().contains("service.pem"));
    tls.refresh();
    assert_eq!(fortress.client(None).get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
    let renewed = Authority::new("renewed");
    let (certificate, key) = renewed.service();
    fs::write(fortress.folder.path().join("service.key"), key).unwrap();
    fs::write(&file, certificate).unwrap();
    tls.refresh();
    let fortress = Fortress { services: renewed, ..fortress };
    assert_eq!(fortress.client(None).get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
}

#[test]
fn what_tls_cannot_be_made_from_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let authority = Authority::new("any");
    let ((certificate, key), (_, other_key)) = (authority.service(), authority.service());
    let write = |name: &str, text: &str| -> PathBuf {
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        file
    };
    let good = TlsFiles {
        certificate: write("good.pem", &certificate),
        key: write("good.key", &key),
        client_ca: Some(write("ca.pem", &authority.pem)),
        client_crl: Some(write("crl.pem", &authority.revoke(&[]))),
    };
    let (empty, absent) = (write("empty.pem", ""), folder.path().join("absent.pem"));
    let cases = [
        (TlsFiles { certificate: absent.clone(), ..good.clone() }, "absent.pem"),
        (TlsFiles { certificate: empty.clone(), ..good.clone() }, "no certificate"),
        (TlsFiles { key: empty.clone(), ..good.clone() }, "no private key"),
        (TlsFiles { key: write("other.key", &other_key), ..good.clone() }, "other.key"),
        (TlsFiles { client_ca: Some(empty.clone()), ..good.clone() }, "empty.pem"),
        (TlsFiles { client_crl: Some(empty), ..good.clone() }, "no revocation list"),
        (TlsFiles { client_crl: Some(good.certificate.clone()), ..good.clone() }, "good.pem"),
    ];
    let clock: server::Clock = std::sync::Arc::new(|| crate::house::time(crate::house::START));
    for (files, words) in cases {
        let error = server::Tls::load(files, clock.clone()).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
        assert!(!error.contains("PRIVATE"), "{error}");
    }
    server::Tls::load(good, clock).unwrap();
}

#[tokio::test]
async fn a_client_that_does_not_shake_hands_holds_up_nobody() {
    let fortress = Fortress::open().await;
    let address = fortress.house.url.strip_prefix("https://").unwrap().to_owned();
    let mut silent = TcpStream::connect(&address).await.unwrap();
    let plain = Client::builder().tls_certs_only([]).build().unwrap();
    assert!(plain.get(format!("http://{address}/healthz")).send().await.is_err());
    assert_eq!(fortress.client(None).get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
    fortress.house.stop().await;
    let mut rest = Vec::new();
    // Closed or reset: either way the read ends.
    let _ = silent.read_to_end(&mut rest).await;
    assert!(TcpStream::connect(&address).await.is_err());
}

#[tokio::test]
async fn both_versions_and_both_protocols_are_spoken() {
    let fortress = Fortress::open().await;
    let old = fortress.tuned(None, |builder| builder.tls_version_max(reqwest::tls::Version::TLS_1_2));
    assert_eq!(old.get(fortress.url("/healthz")).send().await.unwrap().status(), 200);
    let identity = fortress.clients.client(&Wanted::default());
    let mut grpc = proto::v1::models_client::ModelsClient::new(fortress.channel(&identity).await);
    assert_eq!(grpc.list(proto::v1::ListModelsRequest {}).await.unwrap().into_inner().items.len(), 1);
}
