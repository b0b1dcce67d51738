//! An acknowledged upload is never lost, whatever happens to the process.
//!
//! Failures here: SIGKILL of the service at arbitrary points of a fleet's traffic. Not covered: power
//! cuts (SIGKILL says nothing about fsync), a full disk.

use std::{
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use serde_json::Value;
use tests::Service;

fn fleet(url: &str) -> Command {
    let mut command = Command::new(tests::binary());
    let start = "2026-01-01T00:00:00Z";
    command.args(["simulate", "fleet", "--url", url, "--physics", "closed-form", "--tails", "2", "--seed", "3"]);
    command.args(["--hours", "40", "--start", start]).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// What must be the same whatever happened on the way; times of reading are not.
fn numbers(fleet: &[Value]) -> Vec<Value> {
    let kept = ["serial_number", "as_of", "rul_fh", "probability_of_failure", "fault_vector", "propagation"];
    fleet.iter().map(|rul| kept.iter().map(|name| rul[*name].clone()).collect()).collect()
}

async fn undisturbed(database: &Path) -> Vec<Value> {
    let service = Service::start(database, 0);
    let flown = fleet(&service.url).output().unwrap();
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    service.settled_fleet().await
}

#[tokio::test]
async fn slow_killed_services_lose_nothing_and_answer_as_if_nothing_had_happened() {
    let folder = tempfile::tempdir().unwrap();
    let expected = undisturbed(&folder.path().join("undisturbed.sqlite")).await;

    let database = folder.path().join("killed.sqlite");
    let mut service = Service::start(&database, 0);
    let flying = fleet(&service.url).spawn().unwrap();
    for _ in 0..5 {
        tokio::time::sleep(Duration::from_millis(700)).await;
        let port = service.port();
        service.kill();
        service = Service::start(&database, port);
    }
    let flown = flying.wait_with_output().unwrap();
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    let fleet_after = service.settled_fleet().await;
    assert_eq!(numbers(&fleet_after), numbers(&expected));

    let again = fleet(&service.url).output().unwrap();
    let words = String::from_utf8(again.stdout).unwrap();
    assert!(words.starts_with("0 uploads accepted"), "everything was there already: {words}");
}
