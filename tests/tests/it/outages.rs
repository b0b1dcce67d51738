//! What a service does while it can store nothing, and afterwards.
//!
//! Failures here: a limit on the size of files, which makes writes fail as a full disk does; another process that holds
//! the database. Not covered: a device that fails to read.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

use reqwest::StatusCode;
use serde_json::{Value, json};
use sqlx::{Connection, Executor, SqliteConnection};
use tempfile::TempDir;
use tests::{Service, binary, http, run};

/// Longer than anything here takes: only a hang runs into it.
const HANG: Duration = Duration::from_secs(60);

/// A service on a database of its own, and an aircraft that uploads to it.
struct World {
    folder: TempDir,
    service: Service,
    mask: Value,
    sent: u32,
}

impl World {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(binary());
        let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
        command.args(["serve", "--port", "0", "--database-url", &url]);
        command.stderr(File::create(folder.path().join("log")).unwrap());
        let service = Service::spawn(&mut command).expect("it starts");
        let models = service.get("/v1/models").await;
        let hash = models["items"][0]["hash"].as_str().expect("a model");
        let mask = service.get(&format!("/v1/models/{hash}/mask")).await;
        Self { folder, service, mask, sent: 0 }
    }

    fn database(&self) -> PathBuf {
        self.folder.path().join("fleet.sqlite")
    }

    fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).unwrap()
    }

    /// One more upload.
    fn next(&mut self) -> Value {
        self.sent += 1;
        let hours = self.sent;
        json!({
            "upload_id": format!("u{hours}"), "position": "AIL-L", "part_number": "EMA-48V", "serial_number": "S1",
            "flight_hours": hours, "recorded_at": format!("2026-03-{:02}T{:02}:00:00Z", 1 + hours / 12, hours % 12),
            "mask_id": self.mask["mask_id"], "samples": vec![0.0752; self.mask["points"].as_array().unwrap().len()],
        })
    }

    async fn send(&self, upload: &Value) -> reqwest::Response {
        http().post(format!("{}/v1/tails/EC-MXA/uploads", self.service.url)).json(upload).send().await.unwrap()
    }

    async fn status(&self, path: &str) -> StatusCode {
        http().get(format!("{}{path}", self.service.url)).send().await.unwrap().status()
    }

    async fn becomes_ready(&self) {
        let deadline = Instant::now() + HANG;
        while self.status("/readyz").await != StatusCode::OK {
            assert!(Instant::now() < deadline, "it is never ready again: {}", self.log());
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

/// Lets no file of a process grow beyond so many bytes.
fn limit_files(service: &Service, bytes: &str) {
    let (id, limit) = (service.id().to_string(), format!("--fsize={bytes}:unlimited"));
    assert!(Command::new("prlimit").args(["--pid", &id, &limit]).status().unwrap().success());
}

fn size(path: &Path) -> u64 {
    fs::metadata(path).unwrap().len()
}

/// The kind of a refusal that asks to come back.
async fn kind(refused: reqwest::Response) -> String {
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(refused.headers()["retry-after"], "1");
    refused.json::<Value>().await.unwrap()["type"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_disk_without_room_refuses_what_is_sent_until_there_is_room_and_loses_nothing() {
    const REFUSED: usize = 30;
    let mut world = World::new().await;
    let log = PathBuf::from(format!("{}-wal", world.database().display()));
    let first = world.next();
    assert_eq!(world.send(&first).await.status(), StatusCode::ACCEPTED);
    limit_files(&world.service, &(size(&log) + 50_000).to_string());
    let mut refused = Vec::new();
    while refused.len() < REFUSED {
        assert!(world.sent < 300, "the limit does not bind");
        let upload = world.next();
        match world.send(&upload).await {
            answer if answer.status() == StatusCode::ACCEPTED => {}
            answer => {
                let kind = kind(answer).await;
                assert!(["/problems/storage-full", "/problems/io-error"].contains(&&*kind), "{kind}");
                refused.push(upload);
            }
        }
    }
    assert_eq!(world.status("/readyz").await, StatusCode::SERVICE_UNAVAILABLE);
    for path in ["/healthz", "/v1/tails", "/v1/tails/EC-MXA/rul"] {
        assert_eq!(world.status(path).await, StatusCode::OK, "{path}");
    }
    let told = world.log().lines().filter(|line| line.contains("nothing can be stored")).count();
    assert!((1..5).contains(&told), "one line for each outage, not for each upload: {}", world.log());

    limit_files(&world.service, "unlimited");
    world.becomes_ready().await;
    for upload in &refused {
        let answer = world.send(upload).await.status();
        assert!([StatusCode::ACCEPTED, StatusCode::OK].contains(&answer), "{answer}");
    }
    world.service.settled_fleet().await;
    let World { folder, service, sent, .. } = world;
    service.kill();
    let verified = run(&["verify", "--database-url", &format!("sqlite:{}/fleet.sqlite", folder.path().display())]);
    let said = String::from_utf8(verified.stdout).unwrap();
    assert!(
        verified.status.success() && said.contains(&format!("{sent} estimates")),
        "{sent} were acknowledged: {said}"
    );
}

#[tokio::test]
async fn slow_a_database_that_another_process_holds_is_told_and_written_again_when_it_is_free() {
    let mut world = World::new().await;
    let (first, second) = (world.next(), world.next());
    assert_eq!(world.send(&first).await.status(), StatusCode::ACCEPTED);
    let url = format!("sqlite:{}", world.database().display());
    let mut holder = SqliteConnection::connect(&url).await.unwrap();
    holder.execute("begin immediate").await.unwrap();
    assert_eq!(kind(world.send(&second).await).await, "/problems/locked");
    assert_eq!(world.status("/v1/tails").await, StatusCode::OK);
    assert_eq!(world.status("/readyz").await, StatusCode::SERVICE_UNAVAILABLE);
    holder.execute("rollback").await.unwrap();
    holder.close().await.unwrap();
    world.becomes_ready().await;
    assert_eq!(world.send(&second).await.status(), StatusCode::ACCEPTED);
}
