//! The command line for people asks a running service: tables for them, JSON for scripts.

use std::process::{Command, Output};

use serde_json::Value;
use tests::Service;

/// What a command says in a terminal of so many columns.
fn run_in(columns: usize, service: &Service, arguments: &[&str]) -> Output {
    let mut command = Command::new(tests::binary());
    command.args(arguments).env("ACTUARY_URL", &service.url).env("COLUMNS", columns.to_string());
    command.env("NO_COLOR", "1").output().expect("the binary starts")
}

fn said(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn told(service: &Service, arguments: &[&str]) -> String {
    said(&run_in(200, service, arguments))
}

fn json(service: &Service, arguments: &[&str]) -> Value {
    serde_json::from_str(&told(service, &[arguments, &["--json"]].concat())).unwrap()
}

fn text<'a>(item: &'a Value, name: &str) -> &'a str {
    item[name].as_str().unwrap_or_default()
}

/// A service with a fleet that has flown.
async fn flown(folder: &std::path::Path) -> (Service, Vec<Value>) {
    let service = Service::start(&folder.join("fleet.sqlite"), 0);
    let flown = tests::run(&["simulate", "fleet", "--url", &service.url, "--tails", "2", "--physics", "closed-form"]);
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    let fleet = service.settled_fleet().await;
    (service, fleet)
}

#[tokio::test]
async fn people_are_told_what_scripts_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let (service, units) = flown(folder.path()).await;
    let (tail, position) = (text(&units[0], "tail"), text(&units[0], "position"));
    let (part, serial) = (text(&units[0], "part_number"), text(&units[0], "serial_number"));

    let rest = service.get("/v1/fleet/rul?sort=urgency&limit=1000").await;
    assert_eq!(json(&service, &["fleet"]), rest);
    let rest = service.get("/v1/fleet/rul?sort=urgency&limit=1000&urgency=unknown&within_fh=300&risk=0.05").await;
    assert_eq!(json(&service, &["fleet", "--urgency", "unknown", "--within-fh", "300", "--risk", "5%"]), rest);
    assert_eq!(json(&service, &["rul", tail]), service.get(&format!("/v1/tails/{tail}/rul")).await);
    let rest = service.get(&format!("/v1/tails/{tail}/positions/{position}/rul?by=2199-01-01")).await;
    assert_eq!(json(&service, &["rul", tail, position, "--by", "2199-01-01"]), rest);
    let rest = service.get("/v1/fleet/due?by=2199-01-01&limit=1000").await;
    assert_eq!(json(&service, &["due", "--by", "2199-01-01"]), rest);
    let component = json(&service, &["component", part, serial]);
    assert_eq!(component["component"], service.get(&format!("/v1/components/{part}/{serial}")).await);
    assert_eq!(text(&component["rul"], "serial_number"), serial);

    let fleet = told(&service, &["fleet"]);
    assert!(fleet.starts_with(&format!("{} units: ", units.len())), "{fleet}");
    for unit in &units {
        let line = fleet.lines().find(|line| line.contains(text(unit, "serial_number"))).unwrap();
        assert!(line.contains(&text(unit, "urgency").replace('_', " ")), "{line}");
    }
    assert_eq!(told(&service, &["watch"]), fleet, "what is no terminal gets the table of now");
    let one = told(&service, &["rul", tail, position]);
    for part in [tail, position, serial, "10 % end by", "no maintenance credit"] {
        assert!(one.contains(part), "{part}: {one}");
    }
    let one = told(&service, &["component", part, serial]);
    assert!(one.contains(&format!("{tail} {position} since ")) && one.contains("life "), "{one}");
    assert!(told(&service, &["due", "--check", "next"]).contains("before their next check"));
}

#[tokio::test]
async fn tables_fit_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let (service, units) = flown(folder.path()).await;
    let tail = text(&units[0], "tail");
    for columns in [40, 80, 200] {
        for arguments in [
            &["fleet"][..],
            &["rul", tail],
            &["due", "--within-fh", "9000"],
            &["rul", tail, text(&units[0], "position")],
        ] {
            let said = said(&run_in(columns, &service, arguments));
            assert!(said.lines().all(|line| line.chars().count() <= columns), "{columns} {arguments:?}: {said}");
            assert!(!said.contains('\u{1b}'), "{said}");
            assert!(said.contains(tail), "{said}");
        }
    }
    let narrow = said(&run_in(40, &service, &["fleet"]));
    assert!(narrow.contains("replace by") && !narrow.contains("serial"), "{narrow}");
    assert!(said(&run_in(200, &service, &["fleet"])).contains("serial"));
}

#[test]
fn what_cannot_be_asked_is_refused_in_one_line_that_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    for (arguments, words) in [
        (&["rul", "EC-ZZZ"][..], "EC-ZZZ"),
        (&["rul", "EC-ZZZ", "AIL-L"], "EC-ZZZ"),
        (&["rul", "not a tail"], "not a tail"),
        (&["component", "EMA", "none"], "404"),
        (&["fleet", "--by", "2026-02-30"], "there is no such day"),
        (&["fleet", "--by", "2020-01-01"], "is past"),
        (&["fleet", "--by", "2199-01-01", "--check", "C-check"], "'--check <NAME>'"),
        (&["due", "--by", "2199-01-01", "--within-fh", "3"], "'--within-fh <H>'"),
        (&["fleet", "--urgency", "soon"], "urgency"),
        (&["fleet", "--status", "fine"], "status"),
        (&["fleet", "--risk", "100%"], "risk"),
        (&["fleet", "--risk", "little"], "5%"),
        (&["watch", "--every", "0"], "--every"),
        (&["watch", "--check", " "], "check"),
    ] {
        let output = run_in(80, &service, arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.lines().next().is_some_and(|line| line.contains(words)), "{words}: {stderr}");
        assert!(output.stdout.is_empty());
    }
    assert_eq!(said(&run_in(80, &service, &["fleet"])), "No units.\n");
    for arguments in [&["fleet"][..], &["rul", "EC-A001"], &["component", "A", "B"], &["watch"], &["due"]] {
        let output = tests::run(&[arguments, &["--url", "http://127.0.0.1:9"]].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), stderr.lines().count()), (Some(3), 1), "{arguments:?}: {stderr}");
    }
}
