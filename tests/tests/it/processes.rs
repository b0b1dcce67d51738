//! Processes around a database: what they refuse, what they answer to probes, how they end.

use std::{
    fs::{self, File},
    io::Write,
    net::TcpStream,
    process::Command,
    time::{Duration, Instant},
};

use serde_json::Value;
use tests::{Service, binary, run};

fn refused(arguments: &[&str], code: i32, words: &str) {
    let output = run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(stderr.contains(words) && stderr.lines().count() == 1, "{arguments:?}: {stderr}");
}

#[test]
fn an_sqlite_file_is_worked_on_by_the_process_that_serves_it() {
    let folder = tempfile::tempdir().unwrap();
    let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    refused(&["worker", "--database-url", &url], 2, "needs Postgres");
    refused(&["serve", "--no-worker", "--port", "0", "--database-url", &url], 2, "needs Postgres");
}

#[test]
fn migrating_twice_is_migrating_once() {
    let folder = tempfile::tempdir().unwrap();
    let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    for _ in 0..2 {
        let output = run(&["migrate", "--database-url", &url]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let output = run(&["verify", "--database-url", &url]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_password_in_a_url_is_in_no_message() {
    for url in ["postgres://service:sesame@127.0.0.1:9/actuary", "mysql://service:sesame@127.0.0.1:9/actuary"] {
        let output = run(&["migrate", "--database-url", url]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && said.contains("127.0.0.1:9") && !said.contains("sesame"), "{said}");
    }
    let help = Command::new(binary())
        .args(["serve", "--help"])
        .env("ACTUARY_DATABASE_URL", "postgres://service:sesame@db/actuary")
        .output()
        .unwrap();
    assert!(help.status.success() && !String::from_utf8_lossy(&help.stdout).contains("sesame"));
}

#[tokio::test]
async fn a_service_tells_how_it_is_and_ends_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(binary());
    let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let service =
        Service::spawn(command.args(["serve", "--port", "0", "--health-port", "0", "--database-url", &url])).unwrap();
    let probe = |path: &str| run(&["healthcheck", "--url", &format!("{}{path}", service.url)]).status.code();
    assert_eq!((probe("/healthz"), probe("/readyz"), probe("/nothing")), (Some(0), Some(0), Some(1)));
    refused(&["healthcheck", "--url", "http://127.0.0.1:9/readyz"], 3, "no service answers");

    // A client that never ends its request, and work under way, hold nothing up.
    let mut half_open = TcpStream::connect(service.url.trim_start_matches("http://")).unwrap();
    half_open.write_all(b"POST /v1/tails/EC-MXA/uploads HTTP/1.1\r\n").unwrap();
    let fleet = ["simulate", "fleet", "--url", &service.url, "--physics", "closed-form", "--tails", "1"];
    let flown = run(&[&fleet[..], &["--hours", "40"]].concat());
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    let (status, after) = service.terminate();
    assert!(status.success(), "{status}");
    println!("ended {:.1} s after SIGTERM", after.as_secs_f64());
}

#[test]
fn a_log_for_programs_is_json_line_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let mut command = Command::new(binary());
    command.args(["serve", "--port", "0", "--log-format", "json", "--database-url", &url]).env_remove("RUST_LOG");
    let service = Service::spawn(command.stderr(File::create(&log).unwrap())).unwrap();
    service.signal("HUP");
    let deadline = Instant::now() + Duration::from_secs(20);
    while !fs::read_to_string(&log).unwrap().contains('\n') {
        assert!(Instant::now() < deadline, "nothing is logged");
        std::thread::sleep(Duration::from_millis(20));
    }
    service.terminate();
    let text = fs::read_to_string(&log).unwrap();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    let told =
        |line: &&Value| line["level"] == "WARN" && line["message"].as_str().unwrap().contains("SIGHUP changes nothing");
    let warning = lines.iter().find(told).unwrap_or_else(|| panic!("{text}"));
    assert!(warning["timestamp"].is_string() && warning["target"].is_string(), "{warning}");
    refused(&["serve", "--log-format", "xml", "--port", "0", "--database-url", &url], 2, "--log-format");
}
