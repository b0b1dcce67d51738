//! Two operators with everything that can be asked for, ready to be served again and again.

use std::{fs, path::PathBuf};

use airframe::{Layout, reference::reference_configuration};
use axum::{body::Body, http::Request};
use domain::{ContentHash, FrameKeyId, FrameSubject, Scope, Timestamp, Token, Upload};
use proto::{
    frame::Measured,
    json::{MaintenanceBody, MaintenanceKind, SensorConfigurationBody, UploadBody},
};
use serde::Serialize;
use store::{FrameKeyRecord, TokenRecord};
use tempfile::TempDir;
use worker::Analyst;

use super::{
    names::Owner,
    principal::{Kind, Principal},
};
use crate::in_process::{
    clock::Clock,
    service::{Answer, Bundle, FRAME_KEY, Service},
};

/// The one upload that is set aside.
pub const SET_ASIDE: usize = 5;
/// Uploads of each tail.
const UPLOADS: usize = 10;

/// The present.
pub fn now() -> Timestamp {
    "2026-03-20T12:00:00Z".parse().expect("a time")
}

/// A service that is as it was at first whenever it is asked to be.
pub struct World {
    folder: TempDir,
    clock: Clock,
    service: Service,
    /// All callers.
    pub principals: Vec<Principal>,
    /// How often it was made anew.
    pub renewals: usize,
}

impl World {
    /// Makes a world of these operators.
    pub async fn make(inhabitants: &[Inhabitant]) -> Self {
        let (folder, clock) = (tempfile::tempdir().expect("a folder"), Clock::at(now()));
        let service = Service::open(&url(&folder, "template"), &clock).await;
        service.provide(&clock).await;
        for inhabitant in inhabitants {
            inhabitant.move_in(&service).await;
        }
        work(&service, &clock).await;
        let principals = introduce(&service).await;
        service.stop().await;
        renew(&folder);
        let service = Service::open(&url(&folder, "served"), &clock).await;
        Self { folder, clock, service, principals, renewals: 0 }
    }

    /// The service.
    pub fn service(&self) -> &Service {
        &self.service
    }

    /// Answers, and is as at first again where the answer changed anything.
    pub async fn answer(&mut self, request: Request<Body>, may_change: bool) -> Answer {
        let answer = self.service.answer(request).await;
        if may_change && answer.is_success() {
            self.renew().await;
        }
        answer
    }

    /// Lets workers come to the end of what waits.
    pub async fn work(&self) {
        work(&self.service, &self.clock).await;
    }

    /// Makes it as it was at first.
    pub async fn renew(&mut self) {
        self.renewals += 1;
        self.service.store().close().await;
        renew(&self.folder);
        self.service = Service::open(&url(&self.folder, "served"), &self.clock).await;
    }
}

fn file(folder: &TempDir, name: &str) -> PathBuf {
    folder.path().join(name).with_extension("sqlite")
}

fn url(folder: &TempDir, name: &str) -> String {
    format!("sqlite:{}", file(folder, name).display())
}

/// Puts the template in the place of what is served.
fn renew(folder: &TempDir) {
    let served = file(folder, "served");
    for rest in ["-wal", "-shm"] {
        let _ = fs::remove_file(format!("{}{rest}", served.display()));
    }
    fs::copy(file(folder, "template"), &served).expect("the template is closed");
}

/// An operator, and whose names its things have. What they are differs.
pub struct Inhabitant {
    /// Who.
    pub operator: Owner,
    /// How it calls them.
    pub names: Owner,
}

impl Inhabitant {
    /// One whose things carry its own word.
    pub fn called_by_its_own(operator: Owner) -> Self {
        Self { operator, names: operator }
    }

    /// Sends all that it has. Nobody has a token yet, so that the store is told directly.
    async fn move_in(&self, service: &Service) {
        for tail in 1..=2 {
            for number in 0..UPLOADS {
                self.fly(service, tail, number).await;
            }
            self.configure(service, tail).await;
        }
        let key = frame_key(self.operator, self.names);
        service.store().create_frame_key(&key, domain::Actor::Cli).await.expect("stored");
        let note = Some(format!("seen by {}", self.operator.word()));
        let seen = MaintenanceBody { note, ..event(self.names) };
        self.report(service, seen.clone()).await;
        let named = |name: &str| MaintenanceBody { event_id: format!("{}.{name}", self.names.event()), ..seen.clone() };
        let failed = MaintenanceBody { outcome: Some(domain::Finding::Failed), ..named("end") };
        let second = self.names.serial(2);
        if self.operator == Owner::Alpha {
            self.report(service, MaintenanceBody { serial_number: second, ..failed }).await;
            return;
        }
        self.report(service, MaintenanceBody { flight_hours: 4030.0, ..failed }).await;
        let done = |kind: MaintenanceKind, body: MaintenanceBody| MaintenanceBody { kind, outcome: None, ..body };
        let overhauled = MaintenanceBody { flight_hours: 4045.0, ..named("overhaul") };
        self.report(service, done(MaintenanceKind::Overhaul, overhauled)).await;
        let removed = MaintenanceBody { serial_number: second, ..named("removal") };
        self.report(service, done(MaintenanceKind::Remove, removed)).await;
        let (mistaken, act) = (self.names.upload(1, 2).parse().expect("a name"), domain::Actor::Cli.at(now()));
        service.store().void_upload(&self.operator.operator(), &mistaken, act).await.expect("stored");
    }

    async fn fly(&self, service: &Service, tail: usize, number: usize) {
        let mut body = upload(self.names, tail, number);
        let wear = if self.operator == Owner::Alpha { 1.0 } else { 0.98 };
        body.samples.iter_mut().flatten().flatten().for_each(|sample| *sample *= wear);
        let upload = body.into_upload(self.names.tail(tail).parse().expect("a tail")).expect("an upload");
        service.store().accept(&self.operator.operator(), upload, now()).await.expect("stored");
    }

    async fn configure(&self, service: &Service, tail: usize) {
        let mut new = configuration(self.names);
        new.configuration.strain_gratings[0].place = format!("{} glue", self.operator.word());
        let (from, configuration) = new.checked().expect("a configuration");
        let (operator, act) = (self.operator.operator(), domain::Actor::Cli.at(now()));
        let at = self.names.tail(tail).parse().expect("a tail");
        let added = service.store().add_sensor_configuration(&operator, &at, from, &configuration, act);
        added.await.expect("stored");
    }

    async fn report(&self, service: &Service, body: MaintenanceBody) {
        let (at, position) = (self.names.tail(1), self.names.position());
        let event = body.into_event(at.parse().expect("a tail"), position.parse().expect("a position"), now());
        let (operator, event) = (self.operator.operator(), event.expect("an event"));
        service.store().record_event(&operator, &event, now()).await.expect("stored");
    }
}

/// Judges what was sent.
async fn work(service: &Service, clock: &Clock) {
    let analyst = Analyst::new(service.store().clone(), clock.asked());
    while let Some(lease) = service.store().lease(std::time::Duration::from_secs(60)).await.expect("the queue answers")
    {
        analyst.serve(&lease).await.expect("results");
    }
}

/// The key for the frames of what is on the first tail, by which an operator calls it by its names.
fn frame_key(operator: Owner, names: Owner) -> FrameKeyRecord {
    let mut id = [0; 8];
    id.copy_from_slice(&ContentHash::of(names.word().as_bytes()).bytes()[..8]);
    let Upload { tail, position, part_number, serial_number, reading, .. } = new_upload(names);
    let mask_id = reading.mask_id().expect("samples");
    FrameKeyRecord {
        id: FrameKeyId::new(id),
        operator: operator.operator(),
        subject: FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id },
        bundle: None,
        made_at: now(),
        revoked_at: None,
    }
}

/// An upload that is new.
fn new_upload(owner: Owner) -> Upload {
    upload(owner, 1, 50).into_upload(owner.tail(1).parse().expect("a tail")).expect("an upload")
}

/// The same as a frame.
pub fn frame(owner: Owner) -> Vec<u8> {
    let FrameKeyRecord { id, operator, subject, .. } = frame_key(owner, owner);
    let key = FRAME_KEY.derive(id, &operator, &subject);
    let frame = Measured::of(&new_upload(owner), &subject).and_then(|measured| measured.frame(50, &key));
    frame.expect("a frame").bytes().to_vec()
}

/// A good upload, but for the hours of the one that is set aside.
pub fn upload(owner: Owner, tail: usize, number: usize) -> UploadBody {
    let bundle = &Bundle::all()[0].model;
    let mask = &bundle.bundle().masks()[0];
    let flight_hours = 4000.0 + 7.0 * number as f64 + if number == SET_ASIDE { 5000.0 } else { 0.0 };
    UploadBody {
        upload_id: owner.upload(tail, number),
        position: owner.position(),
        part_number: owner.part(),
        serial_number: owner.serial(tail),
        flight_hours,
        flight_cycles: None,
        recorded_at: now().plus_hours(-400.0 + 12.0 * number as f64).to_string(),
        mask_id: Some(mask.id().to_string()),
        samples: Some(vec![Some(0.7 * bundle.summary().k_nom); mask.len()]),
        load_ratio: None,
        sample_noise: Some(0.01),
        faults: None,
        strain: None,
        air_data: None,
        temperature_c: None,
        winding_temperature_c: None,
        on_ground: None,
    }
}

/// A finding that ends nothing.
pub fn event(owner: Owner) -> MaintenanceBody {
    MaintenanceBody {
        event_id: owner.event(),
        kind: MaintenanceKind::Finding,
        outcome: Some(domain::Finding::Serviceable),
        part_number: owner.part(),
        serial_number: owner.serial(1),
        occurred_at: now().plus_hours(-250.0).to_string(),
        flight_hours: 4075.0,
        note: Some(format!("seen by {}", owner.word())),
    }
}

/// A configuration whose gratings have a name of the operator's.
pub fn configuration(owner: Owner) -> SensorConfigurationBody {
    let mut configuration = reference_configuration(Layout::D);
    configuration.strain_gratings[0].place = format!("{} glue", owner.word());
    SensorConfigurationBody { effective_from: now().plus_hours(-1000.0).to_string(), configuration }
}

/// JSON of a body.
pub fn json(body: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(body).expect("bodies are plain")
}

/// Gives everyone a token who has one.
async fn introduce(service: &Service) -> Vec<Principal> {
    let mut principals = vec![
        Principal::nobody(Kind::Nothing, None),
        Principal::nobody(Kind::Malformed, Some("Bearer of bad news".to_owned())),
    ];
    let mut number = 0;
    for owner in [Owner::Alpha, Owner::Bravo] {
        for kind in Kind::WITH_TOKEN {
            number += 1;
            let token = Token::issue([number; 32]);
            let record = TokenRecord {
                id: token.id,
                operator: owner.operator(),
                scope: scope(kind, owner),
                name: Some(format!("{} {kind:?}", owner.word()).parse().expect("a name")),
                secret: token.secret.hash(),
                created_at: now().plus_hours(-48.0),
                expires_at: (kind == Kind::Expired).then(|| now().plus_hours(-1.0)),
                revoked_at: None,
            };
            service.store().create_token(&record, domain::Actor::Loopback).await.expect("a new token");
            if kind == Kind::Revoked {
                let act = domain::Actor::Loopback.at(now());
                service.store().revoke_token(&owner.operator(), &token.id, act).await.expect("revoked");
            }
            principals.push(Principal { owner: Some(owner), kind, shown: Some(format!("Bearer {}", token.reveal())) });
        }
    }
    let bearer = |text: &str| Some(format!("Bearer {text}"));
    let stranger = Token::issue([255; 32]).reveal();
    principals.push(Principal::nobody(Kind::Unknown, bearer(&stranger)));
    let (_, secret) = stranger.split_once('.').expect("a secret");
    let wrong = format!("{}.{secret}", Token::issue([number; 32]).id);
    principals.push(Principal::nobody(Kind::WrongSecret, bearer(&wrong)));
    principals
}

fn scope(kind: Kind, owner: Owner) -> Scope {
    match kind {
        Kind::AircraftOne => Scope::Aircraft(owner.tail(1).parse().expect("a tail")),
        Kind::AircraftTwo => Scope::Aircraft(owner.tail(2).parse().expect("a tail")),
        Kind::Ops => Scope::Ops,
        Kind::Planner => Scope::Planner,
        _ => Scope::Admin,
    }
}
