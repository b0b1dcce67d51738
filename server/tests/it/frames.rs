//! Uplink frames over both transports: uploads like others, and what is no frame, or no key's.

use domain::{Actor, FrameKeyId, FrameSubject, Scope, Strain, Upload};
use proto::{
    frame::{Frame, FrameKey, InstallationKey, MEDIA_TYPE, Measured, MeasuredStrain, to_base32},
    json::UploadBody,
    v1::{self, ingest_client::IngestClient},
};
use reqwest::Response;
use serde_json::Value;
use store::FrameKeyRecord;
use tonic::{Code, Request};

use crate::house::{House, problem, time};

/// A key of a house, and the aircraft that writes by it.
struct Aircraft {
    record: FrameKeyRecord,
    key: FrameKey,
}

impl Aircraft {
    /// One of the house's own operator, with a key that was made there.
    async fn of(house: &House, number: u8, subject: FrameSubject) -> Self {
        let aircraft = Self::stranger("default", number, subject);
        house.store.create_frame_key(&aircraft.record, Actor::Cli).await.unwrap();
        aircraft
    }

    /// One whose key nobody has made.
    fn stranger(operator: &str, number: u8, subject: FrameSubject) -> Self {
        let (id, operator) = (FrameKeyId::new([number; 8]), operator.parse().unwrap());
        let key = InstallationKey::new([7; 32]).derive(id, &operator, &subject);
        let made_at = time("2026-01-01T00:00:00Z");
        Self { record: FrameKeyRecord { id, operator, subject, bundle: None, made_at, revoked_at: None }, key }
    }

    fn frame(&self, counter: u32, upload: &Upload) -> Frame {
        Measured::of(upload, &self.record.subject).unwrap().frame(counter, &self.key).unwrap()
    }

    fn strain(&self, counter: u32, upload: &Upload) -> Frame {
        MeasuredStrain::of(upload, &self.record.subject).unwrap().unwrap().frame(counter, &self.key).unwrap()
    }
}

/// An upload of the house at some flight hours.
fn upload(house: &House, flight_hours: f64) -> Upload {
    let body: UploadBody = serde_json::from_value(house.body("any", flight_hours)).unwrap();
    let strain = Strain { wavelengths_nm: vec![Some(1550.5); 12], temperature_wavelengths_nm: vec![Some(1560.0); 4] };
    Upload { strain: Some(strain), ..body.into_upload("EC-MXA".parse().unwrap()).unwrap() }
}

fn subject(house: &House) -> FrameSubject {
    let Upload { tail, position, part_number, serial_number, reading, .. } = upload(house, 1.0);
    FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id: reading.mask_id().unwrap() }
}

fn wing() -> FrameSubject {
    FrameSubject::Strain { tail: "EC-MXA".parse().unwrap() }
}

async fn send(house: &House, body: impl Into<reqwest::Body>) -> Response {
    let post = house.client.post(format!("{}/v1/uploads", house.url)).header("content-type", MEDIA_TYPE);
    post.body(body).send().await.unwrap()
}

async fn acknowledged(response: Response, status: u16) -> Value {
    let given = response.status().as_u16();
    let body: Value = response.json().await.unwrap();
    assert_eq!(given, status, "{body}");
    body
}

/// The kind and the words of a refusal.
async fn refused(house: &House, body: impl Into<reqwest::Body>, status: u16) -> (String, String) {
    let problem = problem(send(house, body).await, status).await;
    (problem["type"].as_str().unwrap().to_owned(), problem["detail"].as_str().unwrap().to_owned())
}

#[tokio::test]
async fn a_frame_is_an_upload_of_its_key_and_counter() {
    let house = House::open().await;
    let aircraft = Aircraft::of(&house, 1, subject(&house)).await;
    let frame = aircraft.frame(7, &upload(&house, 10.0));
    let ack = acknowledged(send(&house, frame.bytes().to_vec()).await, 202).await;
    assert_eq!((&ack["upload_id"], &ack["status"]), (&"frame:0101010101010101:7".into(), &"accepted".into()));
    // The same over the other text, and the other transport.
    assert_eq!(acknowledged(send(&house, to_base32(frame.bytes())).await, 200).await["status"], "duplicate");
    let mut grpc = IngestClient::new(house.channel().await);
    let request = v1::UploadFrameRequest { frame: frame.bytes().to_vec(), strain_frame: Vec::new() };
    let answer = grpc.upload_frame(request).await.unwrap().into_inner();
    assert_eq!((answer.upload_id.as_str(), answer.status()), ("frame:0101010101010101:7", v1::UploadStatus::Duplicate));
    let told = house.read("/v1/uploads/frame:0101010101010101:7").await;
    assert_eq!((&told["tail"], &told["flight_hours"]), (&"EC-MXA".into(), &10.0.into()));
    // A lower counter that never came is late; the same counter with other content is refused.
    acknowledged(send(&house, aircraft.frame(3, &upload(&house, 4.0)).bytes().to_vec()).await, 202).await;
    let other = aircraft.frame(7, &upload(&house, 11.0)).bytes().to_vec();
    let (kind, said) = refused(&house, other.clone(), 409).await;
    assert!(kind == "/problems/conflict" && said.contains("frame:0101010101010101:7"), "{kind}: {said}");
    let status =
        grpc.upload_frame(v1::UploadFrameRequest { frame: other, strain_frame: Vec::new() }).await.unwrap_err();
    assert_eq!(status.code(), Code::AlreadyExists);
    let figures = house.get("/metrics").await.text().await.unwrap();
    for transport in ["rest_frame", "grpc_frame"] {
        assert!(figures.contains(&format!("transport=\"{transport}\"")), "{figures}");
    }
}

#[tokio::test]
async fn a_frame_and_the_same_upload_as_json_are_stored_alike() {
    let house = House::open().await;
    let (aircraft, sensors) = (Aircraft::of(&house, 1, subject(&house)).await, Aircraft::of(&house, 2, wing()).await);
    let measured = upload(&house, 10.0);
    let (frame, strain) = (aircraft.frame(1, &measured), sensors.strain(1, &measured));
    let lines = format!("{}\r\n{}\n", to_base32(strain.bytes()), to_base32(frame.bytes()));
    acknowledged(send(&house, lines).await, 202).await;
    for body in [[strain.bytes(), frame.bytes()].concat(), [frame.bytes(), strain.bytes()].concat()] {
        assert_eq!(acknowledged(send(&house, body).await, 200).await["status"], "duplicate");
    }
    let stored = house.store.upload(&"default".parse().unwrap(), &aircraft.key.id().upload_id(1)).await.unwrap();
    let stored = stored.unwrap().upload;
    assert_eq!(stored.strain, measured.strain);
    let body = serde_json::to_string(&UploadBody::from(stored)).unwrap();
    let again = acknowledged(house.post("EC-MXA", "application/json", body).await, 200).await;
    assert_eq!(again["status"], "duplicate", "one content, one hash");
    // Without its strain, or with that of another flight, it is not the same.
    assert_eq!(refused(&house, frame.bytes().to_vec(), 409).await.0, "/problems/conflict");
    let late = sensors.strain(2, &upload(&house, 14.0));
    let (kind, _) = refused(&house, [late.bytes(), frame.bytes()].concat(), 422).await;
    assert_eq!(kind, "/problems/invalid");
    for body in [strain.bytes().to_vec(), [frame.bytes(), frame.bytes()].concat(), frame.bytes().repeat(3)] {
        assert!(refused(&house, body, 422).await.1.contains("one actuator"));
    }
}

#[tokio::test]
async fn what_is_no_frame_or_of_no_key_is_told_by_its_kind() {
    let house = House::open().await;
    let aircraft = Aircraft::of(&house, 1, subject(&house)).await;
    let measured = upload(&house, 10.0);
    let good = aircraft.frame(1, &measured).bytes().to_vec();
    let mut cut = good.clone();
    cut.pop();
    let (kind, said) = refused(&house, cut, 400).await;
    assert_eq!((kind.as_str(), said.contains("cut")), ("/problems/frame-malformed", true), "{said}");
    for malformed in [Vec::new(), b"AEB".to_vec(), b"aebagbaf".to_vec(), [&good[..], &[1]].concat()] {
        assert_eq!(refused(&house, malformed, 400).await.0, "/problems/frame-malformed");
    }
    assert_eq!(refused(&house, vec![9; 128], 422).await.0, "/problems/frame-layout");
    // A changed frame and a key that nobody made are told alike.
    let mut changed = good.clone();
    changed[50] ^= 1;
    let forged = refused(&house, changed, 422).await;
    assert_eq!(forged.0, "/problems/frame-not-authentic");
    let stranger = Aircraft::stranger("default", 9, subject(&house)).frame(1, &measured);
    assert_eq!(refused(&house, stranger.bytes().to_vec(), 422).await, forged);
    let foreign = Aircraft::stranger("elsewhere", 8, subject(&house));
    house.store.create_frame_key(&foreign.record, Actor::Cli).await.unwrap();
    assert_eq!(refused(&house, foreign.frame(1, &measured).bytes().to_vec(), 422).await, forged);
    let mut grpc = IngestClient::new(house.channel().await);
    for (frame, code) in [
        (good[1..].to_vec(), Code::InvalidArgument),
        (vec![9; 128], Code::InvalidArgument),
        (stranger.bytes().to_vec(), Code::PermissionDenied),
    ] {
        let status = grpc.upload_frame(v1::UploadFrameRequest { frame, strain_frame: Vec::new() }).await.unwrap_err();
        assert_eq!(status.code(), code, "{status:?}");
    }
    let wrong_type = house.client.post(format!("{}/v1/uploads", house.url)).header("content-type", "application/json");
    problem(wrong_type.body(good.clone()).send().await.unwrap(), 415).await;
    // Nothing of all that was stored.
    acknowledged(send(&house, good).await, 202).await;
}

#[tokio::test]
async fn a_revoked_key_writes_no_more_and_tells_so_only_to_who_has_it() {
    let house = House::open().await;
    let aircraft = Aircraft::of(&house, 1, subject(&house)).await;
    let measured = upload(&house, 10.0);
    let good = aircraft.frame(1, &measured).bytes().to_vec();
    acknowledged(send(&house, good.clone()).await, 202).await;
    let act = Actor::Cli.at(time("2026-03-01T13:00:00Z"));
    house.store.revoke_frame_key(&aircraft.record.operator, aircraft.record.id, act).await.unwrap();
    let (kind, said) = refused(&house, aircraft.frame(2, &upload(&house, 5.0)).bytes().to_vec(), 422).await;
    assert_eq!(kind, "/problems/frame-key-revoked");
    assert!(said.contains("0101010101010101") && said.contains("2026-03-01T13:00:00Z"), "{said}");
    let mut changed = good;
    changed[40] ^= 128;
    assert_eq!(refused(&house, changed, 422).await.0, "/problems/frame-not-authentic");
}

#[tokio::test]
async fn a_frame_written_after_a_swap_is_told_as_a_contradiction_and_one_from_before_is_not() {
    let house = House::open().await;
    let aircraft = Aircraft::of(&house, 1, subject(&house)).await;
    acknowledged(send(&house, aircraft.frame(1, &upload(&house, 10.0)).bytes().to_vec()).await, 202).await;
    for (kind, serial) in [("remove", "SN 1"), ("install", "SN 2")] {
        let event = serde_json::json!({
            "event_id": kind, "kind": kind, "part_number": "EMA-500", "serial_number": serial,
            "occurred_at": "2026-02-03T00:00:00Z", "flight_hours": 15.0,
        });
        let report = house.client.post(format!("{}/v1/tails/EC-MXA/positions/AIL-L/maintenance", house.url));
        assert_eq!(report.json(&event).send().await.unwrap().status(), 201);
    }
    let late = acknowledged(send(&house, aircraft.frame(2, &upload(&house, 12.0)).bytes().to_vec()).await, 202).await;
    assert_eq!(late["warnings"], Value::Null, "what was measured before is true");
    let after = acknowledged(send(&house, aircraft.frame(3, &upload(&house, 20.0)).bytes().to_vec()).await, 202).await;
    assert_eq!(after["warnings"].as_array().map(Vec::len), Some(1), "{after}");
}

#[tokio::test]
async fn frames_need_a_token_as_uploads_do_and_an_aircraft_sends_its_own() {
    let house = House::open().await;
    let aircraft = Aircraft::of(&house, 1, subject(&house)).await;
    let frame = aircraft.frame(1, &upload(&house, 10.0));
    let own = house.token("default", Scope::Aircraft("EC-MXA".parse().unwrap())).await;
    let other = house.token("default", Scope::Aircraft("EC-MXB".parse().unwrap())).await;
    let (ops, foreign) = (house.token("default", Scope::Ops).await, house.token("elsewhere", Scope::Admin).await);
    let post = |token: Option<&domain::Token>| {
        let post = house.client.post(format!("{}/v1/uploads", house.url)).header("content-type", MEDIA_TYPE);
        let post = token.into_iter().fold(post, |post, token| post.bearer_auth(token.reveal()));
        post.body(frame.bytes().to_vec()).send()
    };
    problem(post(None).await.unwrap(), 401).await;
    for (token, status) in [(&other, 403), (&ops, 403), (&foreign, 422)] {
        problem(post(Some(token)).await.unwrap(), status).await;
    }
    let mut grpc = IngestClient::new(house.channel().await);
    let mut request = Request::new(v1::UploadFrameRequest { frame: frame.bytes().to_vec(), strain_frame: Vec::new() });
    request.metadata_mut().insert("authorization", format!("Bearer {}", other.reveal()).parse().unwrap());
    assert_eq!(grpc.upload_frame(request).await.unwrap_err().code(), Code::PermissionDenied);
    acknowledged(post(Some(&own)).await.unwrap(), 202).await;
}
