//! `actuary due` asks a running service, and says in words what it answers.

use std::process::Output;

use serde_json::Value;
use tests::Service;

fn due(service: &Service, arguments: &[&str]) -> Output {
    tests::run(&[&["due", "--url", &service.url], arguments].concat())
}

fn said(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[tokio::test]
async fn the_due_list_is_a_table_or_what_the_service_says() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let flown = tests::run(&["simulate", "fleet", "--url", &service.url, "--tails", "1", "--physics", "closed-form"]);
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    service.settled_fleet().await;
    let question = ["--within-fh", "9000", "--risk", "0.01"];
    let answer = service.get("/v1/fleet/due?within_fh=9000&risk=0.01&limit=1000").await;
    let listed = |list: &str| answer[list].as_array().unwrap().len();
    assert_eq!(listed("items") + listed("unknown"), 2, "both actuators are near the end of 9,000 hours, or unknown");

    let json: Value = serde_json::from_str(&said(&due(&service, &[&question[..], &["--json"]].concat()))).unwrap();
    assert_eq!(json, answer);
    let csv = said(&due(&service, &[&question[..], &["--csv"]].concat()));
    assert_eq!(csv, service.text("/v1/fleet/due?format=csv&within_fh=9000&risk=0.01").await);
    let table = said(&due(&service, &question));
    assert!(
        table.contains("of 2 actuators have failed, or fail within 9000 fh") && table.contains("more than 1 %"),
        "{table}"
    );
    for item in answer["items"].as_array().unwrap().iter().chain(answer["unknown"].as_array().unwrap()) {
        assert!(table.contains(item["serial_number"].as_str().unwrap()), "{table}");
    }
    assert!(table.contains("no maintenance credit"), "{table}");
}

#[test]
fn bad_questions_exit_with_2_and_absent_services_with_3() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let refused = |output: &Output, code: i32, words: &str| {
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        assert!(stderr.lines().next().is_some_and(|line| line.contains(words)), "{words}: {stderr}");
        assert!(output.stdout.is_empty());
    };
    for (arguments, words) in [
        (["--risk", "1.5"], "risk: \"1.5\" must be a probability above 0 and below 1"),
        (["--risk", "NaN"], "risk"),
        (["--within-fh", "-5"], "within_fh"),
        (["--within-fh", "10001"], "the horizon of forecasts"),
        (["--within-fh", "soon"], "--within-fh"),
        (["--csv", "--json"], "--json"),
    ] {
        refused(&due(&service, &arguments), 2, words);
    }
    for url in ["nowhere", "ftp://localhost", "127.0.0.1:8080"] {
        refused(&tests::run(&["due", "--url", url]), 2, url);
    }
    refused(&tests::run(&["due", "--url", "http://127.0.0.1:9"]), 3, "http://127.0.0.1:9");
}
