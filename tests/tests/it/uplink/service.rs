//! The whole way: keys made by the command line, frames over REST and gRPC to a service, and its forecast.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use domain::{Mask, Upload};
use pipeline::Model;
use proto::{
    frame::{KeyCard, MEDIA_TYPE, Measured, MeasuredStrain, to_base32},
    json::UploadBody,
    v1::{self, ingest_client::IngestClient},
};
use serde_json::Value;
use simulator::{FleetPlan, Lives, Mission, Pace, Physics, Upkeep};
use tests::{Service, binary, http};
use tonic::{Code, transport::Endpoint};

/// A folder with an installation: its secret and its database.
struct Installation(tempfile::TempDir);

impl Installation {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("frame.key"), "0f".repeat(32) + "\n").unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The binary with this installation in its environment.
    fn actuary(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(binary());
        command.args(arguments).current_dir(self.0.path());
        command.env("ACTUARY_DATABASE_URL", format!("sqlite:{}", self.path("fleet.sqlite").display()));
        command.env("ACTUARY_FRAME_KEY_FILE", self.path("frame.key"));
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.actuary(arguments).output().unwrap()
    }

    fn succeeds(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    fn refuses(&self, arguments: &[&str], words: &str) {
        let output = self.run(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(2), 1), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }

    fn serve(&self) -> Service {
        Service::spawn(&mut self.actuary(&["serve", "--port", "0"])).expect("it says where it listens")
    }

    /// The card of a key that is made for what an upload is of.
    fn card(&self, name: &str, upload: &Upload, strain: bool) -> KeyCard {
        let mut arguments = vec!["frame", "key", "create", "--tail", upload.tail.as_str()];
        match strain {
            true => arguments.push("--strain"),
            false => arguments.extend([
                "--position",
                upload.position.as_str(),
                "--part-number",
                upload.part_number.as_str(),
                "--serial-number",
                upload.serial_number.as_str(),
            ]),
        }
        let card = self.succeeds(&arguments);
        fs::write(self.path(name), &card).unwrap();
        serde_json::from_str(&card).unwrap()
    }
}

/// The first flights of a life, one of every five.
fn flights(count: usize) -> Vec<Upload> {
    let model = Model::from_bytes(include_bytes!("../../../../models/default.json")).unwrap();
    let mask: Mask = model.bundle().masks()[0].clone();
    let plan = FleetPlan {
        tails: 1,
        positions: 1,
        seed: 3,
        start: "2024-01-01T00:00:00Z".parse().unwrap(),
        physics: Physics::ClosedForm,
        upkeep: Upkeep { overhauls: 0.0, swaps: 0.0 },
        missions: vec![Mission::ShortHaul],
        pace: Pace::default(),
        weak_transmission: Vec::new(),
    };
    Lives::new(plan, mask).unwrap().flights(0, 5).take(count).map(|flight| flight.upload).collect()
}

async fn post(service: &Service, body: impl Into<reqwest::Body>) -> (u16, Value) {
    let post = http().post(format!("{}/v1/uploads", service.url)).header("content-type", MEDIA_TYPE);
    let answer = post.body(body).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

#[tokio::test]
async fn frames_over_rest_and_grpc_become_a_forecast_and_forged_ones_nothing() {
    let installation = Installation::new();
    let service = installation.serve();
    let uploads = flights(40);
    let (unit, wing) =
        (installation.card("unit.json", &uploads[0], false), installation.card("wing.json", &uploads[0], true));
    let mut grpc = IngestClient::new(Endpoint::new(service.url.clone()).unwrap().connect().await.unwrap());
    for (upload, counter) in uploads.iter().zip(1..) {
        let frame = Measured::of(upload, &unit.subject).unwrap().frame(counter, &unit.key).unwrap();
        let strain = MeasuredStrain::of(upload, &wing.subject).unwrap().unwrap().frame(counter, &wing.key).unwrap();
        if counter % 2 == 0 {
            let (frame, strain_frame) = (frame.bytes().to_vec(), strain.bytes().to_vec());
            let answer = grpc.upload_frame(v1::UploadFrameRequest { frame, strain_frame }).await.unwrap().into_inner();
            assert_eq!(answer.status(), v1::UploadStatus::Accepted);
        } else {
            let (status, ack) = post(&service, to_base32(strain.bytes()) + "\n" + &to_base32(frame.bytes())).await;
            assert_eq!(status, 202, "{ack}");
            assert_eq!(ack["upload_id"], format!("frame:{}:{counter}", unit.key.id()));
        }
    }
    let (tail, position) = (&uploads[0].tail, &uploads[0].position);
    let url = format!("{}/v1/tails/{tail}/positions/{position}/rul", service.url);
    let mut rul = Value::Null;
    for _ in 0..600 {
        rul = http().get(&url).send().await.unwrap().json().await.unwrap();
        if rul["as_of"]["flight_hours"].as_f64() == Some(uploads[39].flight_hours) {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    assert!(rul["rul_fh"]["p50"].as_f64().is_some() || rul["horizon_fh"].as_f64().is_some(), "{rul}");
    assert!(rul["pace"].is_object() || rul["load_agreement"].is_object(), "the load is told by strain: {rul}");
    forged_frames_are_refused(&installation, &service, &uploads[39], &unit).await;
    let said = installation.succeeds(&["verify"]);
    assert!(said.contains("rows match their checksums"), "{said}");
}

async fn forged_frames_are_refused(installation: &Installation, service: &Service, upload: &Upload, unit: &KeyCard) {
    let plain = Upload { strain: None, flight_hours: upload.flight_hours + 4.0, ..upload.clone() };
    let frame = Measured::of(&plain, &unit.subject).unwrap().frame(99, &unit.key).unwrap();
    let good = frame.bytes().to_vec();
    assert_eq!(post(service, good.clone()).await.0, 202);
    assert_eq!(post(service, good.clone()).await.0, 200, "again");
    for bit in [0, 9 * 8, 20 * 8, 60 * 8 + 3, 8 * good.len() - 1] {
        let mut flipped = good.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let (status, problem) = post(service, flipped).await;
        assert!(
            (400..=422).contains(&status) && problem["type"].as_str().unwrap().contains("frame"),
            "{bit}: {problem}"
        );
    }
    let id = unit.key.id().to_string();
    let listed: Value = serde_json::from_str(&installation.succeeds(&["frame", "key", "list", "--json"])).unwrap();
    assert_eq!((&listed[0]["id"], &listed[0]["revoked_at"]), (&id.clone().into(), &Value::Null));
    installation.succeeds(&["frame", "key", "revoke", &id]);
    let late = Measured::of(&plain, &unit.subject).unwrap().frame(100, &unit.key).unwrap();
    let (status, problem) = post(service, late.bytes().to_vec()).await;
    assert_eq!((status, &problem["type"]), (422, &"/problems/frame-key-revoked".into()), "{problem}");
    let mut grpc = IngestClient::new(Endpoint::new(service.url.clone()).unwrap().connect().await.unwrap());
    let request = v1::UploadFrameRequest { frame: late.bytes().to_vec(), strain_frame: Vec::new() };
    assert_eq!(grpc.upload_frame(request).await.unwrap_err().code(), Code::PermissionDenied);
    // Neither the secret nor a key that follows from it is in the database.
    let secret = unit.key.reveal();
    let kept = all_bytes(&installation.path(""));
    let hex: Vec<&str> = vec![secret.split_once('.').unwrap().1, "0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f"];
    for secret in hex {
        assert!(!kept.windows(secret.len()).any(|window| window == secret.as_bytes()));
    }
}

/// The database as it is on the disk.
fn all_bytes(folder: &Path) -> Vec<u8> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let database = files.filter(|path| path.file_name().unwrap().to_string_lossy().starts_with("fleet.sqlite"));
    let bytes: Vec<u8> = database.flat_map(|path| fs::read(path).unwrap()).collect();
    assert!(bytes.windows(16).any(|window| window == b"frame_key_create"), "the log of acts is looked at");
    bytes
}

#[test]
fn an_upload_is_encoded_decoded_and_refused_in_one_line() {
    let installation = Installation::new();
    drop(installation.serve());
    let upload = flights(1).remove(0);
    let (unit, _) = (installation.card("unit.json", &upload, false), installation.card("wing.json", &upload, true));
    let write = |name: &str, upload: &Upload| {
        fs::write(installation.path(name), serde_json::to_string(&UploadBody::from(upload.clone())).unwrap()).unwrap();
    };
    write("upload.json", &upload);
    let encode = ["frame", "encode", "--key", "unit.json", "--counter", "7"];
    let strain = ["--strain-key", "wing.json", "--strain-counter", "8"];
    let frames = installation.succeeds(&[&encode[..], &strain, &["upload.json"]].concat());
    let (first, second) = frames.trim_end().split_once('\n').unwrap();
    assert_eq!((first.len(), second.len()), (117, 205), "the strain, then the actuator");
    fs::write(installation.path("frame.txt"), second).unwrap();
    let table = installation.succeeds(&["frame", "decode", "--key", "unit.json", "frame.txt"]);
    let hours = format!("{:<35}  {} h", "flight_hours", upload.flight_hours);
    assert!(table.contains(&hours) && table.contains("mac"), "{table}");
    let json = installation.succeeds(&["frame", "decode", "--key", "unit.json", "--json", "frame.txt"]);
    let body: UploadBody = serde_json::from_str(&json).unwrap();
    assert_eq!(body.upload_id, format!("frame:{}:7", unit.key.id()));
    // What came out goes in again, in hexadecimal and through a pipe.
    fs::write(installation.path("again.json"), &json).unwrap();
    let hex = installation.succeeds(&[&encode[..], &["--hex", "again.json"]].concat());
    let mut decode = installation.actuary(&["frame", "decode", "--key", "unit.json", "--json", "-"]);
    let mut decode = decode.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    std::io::Write::write_all(&mut decode.stdin.take().unwrap(), hex.as_bytes()).unwrap();
    assert_eq!(String::from_utf8(decode.wait_with_output().unwrap().stdout).unwrap(), json);

    installation.refuses(&[&encode[..], &["upload.json"]].concat(), "--strain-key");
    write("hot.json", &Upload { strain: None, temperature_c: Some(151.0), ..upload.clone() });
    installation.refuses(&[&encode[..], &["hot.json"]].concat(), "hot.json: #/temperature_c: 151");
    let other = Upload { strain: None, serial_number: "other".parse().unwrap(), ..upload };
    write("other.json", &other);
    installation.refuses(&[&encode[..], &["other.json"]].concat(), "#/serial_number");
    fs::write(installation.path("cut.txt"), &second[..200]).unwrap();
    installation.refuses(&["frame", "decode", "cut.txt"], "cut.txt: the frame is cut: 125 bytes of 128");
    fs::write(installation.path("other.txt"), second.replacen('A', "B", 1)).unwrap();
    installation.refuses(&["frame", "decode", "other.txt"], "layout");
    installation
        .refuses(&["frame", "decode", "--key", "wing.json", "frame.txt"], "no key in force here wrote this frame");
    installation.refuses(&["frame", "key", "revoke", &unit.key.reveal()], "16 lower-case");
    installation.refuses(&["frame", "key", "revoke", "0123456789abcdef"], "has no frame key");
    fs::write(installation.path("bad.key"), "secret").unwrap();
    installation.refuses(&["serve", "--port", "0", "--frame-key-file", "bad.key"], "bad.key");
}
