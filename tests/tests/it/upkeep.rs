//! A simulated fleet whose units are swapped and overhauled, against a real service.

use std::{
    collections::BTreeSet,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use serde_json::Value;
use tests::{Service, binary};

fn fleet(url: &str, truth: &Path) -> Command {
    let mut command = Command::new(binary());
    command.args(["simulate", "fleet", "--url", url, "--physics", "closed-form", "--tails", "2", "--seed", "4"]);
    command.args(["--overhauls", "2", "--swaps", "2", "--hours", "200", "--start", "2026-01-01T00:00:00Z"]);
    command.args(["--missions", "short-haul,cruise", "--positions", "5", "--weak-transmission", "EC-A002/ELEV-L"]);
    command.arg("--truth").arg(truth).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn flown(url: &str, truth: &Path) -> String {
    let output = fleet(url, truth).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn digest(database: &Path) -> String {
    let output = tests::run(&["verify", "--digest", "--database-url", &format!("sqlite:{}", database.display())]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    let is_digest = |line: &&str| line.len() == 64 && line.bytes().all(|byte| byte.is_ascii_hexdigit());
    said.lines().find(is_digest).expect("a digest on a line of its own").to_owned()
}

/// What is known of every unit, but for when it was received.
async fn components(service: &Service) -> Vec<Value> {
    let mut known = Vec::new();
    for index in 0..40 {
        let path = format!("{}/v1/components/EMA-48V/S4-{index:04}", service.url);
        let answer = tests::http().get(path).send().await.unwrap();
        if answer.status().as_u16() == 404 {
            continue;
        }
        let mut component: Value = answer.json().await.unwrap();
        component["enrolled_at"] = Value::Null;
        for event in component["events"].as_array_mut().unwrap() {
            event["received_at"] = Value::Null;
        }
        known.push(component);
    }
    known
}

#[tokio::test]
async fn slow_a_fleet_that_is_interrupted_tells_the_same_as_one_that_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let service = Service::start(&file("whole.sqlite"), 0);
    flown(&service.url, &file("whole.csv"));
    service.settled_fleet().await;
    let whole = components(&service).await;
    let lives = whole.iter().flat_map(|component| component["lives"].as_array().unwrap()).count();
    assert!(lives > whole.len(), "some were overhauled");
    let kinds: BTreeSet<&str> = whole
        .iter()
        .flat_map(|component| component["events"].as_array().unwrap())
        .map(|event| event["kind"].as_str().unwrap())
        .collect();
    assert!(kinds.is_superset(&["install", "overhaul", "remove"].into()), "{kinds:?}");
    let contradicted = |component: &Value| !component["contradictions"].as_array().unwrap().is_empty();
    assert!(!whole.iter().any(contradicted), "uploads and events agree");
    service.terminate();

    let service = Service::start(&file("parts.sqlite"), 0);
    for pause_ms in [300, 600, 900] {
        let mut flying = fleet(&service.url, &file("parts.csv")).spawn().unwrap();
        tokio::time::sleep(Duration::from_millis(pause_ms)).await;
        flying.kill().unwrap();
        flying.wait().unwrap();
    }
    flown(&service.url, &file("parts.csv"));
    service.settled_fleet().await;
    let same = components(&service).await;
    assert_eq!(same, whole);
    assert!(flown(&service.url, &file("again.csv")).starts_with("0 uploads accepted, 0 known already"));
    service.terminate();

    assert_eq!(digest(&file("parts.sqlite")), digest(&file("whole.sqlite")));
    let truth = std::fs::read_to_string(file("whole.csv")).unwrap();
    for copy in ["parts.csv", "again.csv"] {
        assert_eq!(std::fs::read_to_string(file(copy)).unwrap(), truth);
    }
    let header = "tail,position,part_number,serial_number,life,flight_hours,t_failure_fh,mission,pace,equivalent_hours,\
                  transmission_efficiency";
    assert_eq!(truth.lines().next(), Some(header));
    for line in truth.lines().skip(1) {
        let fields: Vec<_> = line.split(',').collect();
        let [tail, position, _, serial, life, flown_fh, failure_fh, mission, pace, equivalent_h, efficiency] =
            fields[..]
        else {
            panic!("{line}")
        };
        assert_eq!(mission, if tail == "EC-A001" { "short-haul" } else { "cruise" }, "{line}");
        let number = |field: &str| field.parse::<f64>().unwrap();
        assert!(number(flown_fh) < number(failure_fh) + 4.0 && number(pace) > 0.2, "{line}");
        assert!(life != "0" || number(equivalent_h) > 0.0, "{line}");
        let weak = serial == "S4-0009";
        assert!(weak || efficiency == "1", "{line}");
        let unit = whole.iter().find(|unit| unit["serial_number"] == serial).expect("it is known");
        assert_eq!(life, (unit["lives"].as_array().unwrap().len() - 1).to_string(), "{line}");
        let place = unit["installations"].as_array().unwrap().last().unwrap();
        assert_eq!((&place["tail"], &place["position"]), (&tail.into(), &position.into()), "{line}");
    }
}
