//! `actuary checks` and `actuary settings` set and tell what a running service knows of them.

use std::{fs, process::Output};

use serde_json::{Value, json};
use tests::Service;

fn said(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn refused(output: &Output, words: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.lines().next().is_some_and(|line| line.contains(words)), "{words}: {stderr}");
    assert!(output.stdout.is_empty());
}

#[tokio::test]
async fn checks_and_settings_are_set_listed_and_imported_by_command() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let flown = tests::run(&["simulate", "fleet", "--url", &service.url, "--tails", "1", "--physics", "closed-form"]);
    said(&flown);
    let tails = service.get("/v1/tails").await;
    let tail = tails["items"][0]["tail"].as_str().unwrap().to_owned();
    let run = |arguments: &[&str]| tests::run(&[arguments, &["--url", &service.url]].concat());
    assert_eq!(said(&run(&["checks", "list"])), "No checks are set.\n");
    let told = said(&run(&["checks", "set", &tail, "C-check=2199-10-01", "A-check=412.5@2026-01-20"]));
    assert!(told.contains("C-check") && told.contains("412.5 fh from 2026-01-20 on"), "{told}");
    let answer = service.get(&format!("/v1/tails/{tail}/checks")).await;
    let listed: Value = serde_json::from_str(&said(&run(&["checks", "list", "--json"]))).unwrap();
    assert_eq!(listed, json!([answer]));

    let table = said(&run(&["checks", "list", "--csv"]));
    let file = folder.path().join("checks.csv");
    let name = file.display().to_string();
    fs::write(&file, table.replace("2199-10-01", "2199-11-01")).unwrap();
    let preview = said(&run(&["checks", "import", &name, "--preview"]));
    assert!(
        preview.contains("~ C-check: 2199-10-01 -> 2199-11-01") && preview.contains("nothing was done"),
        "{preview}"
    );
    assert_eq!(service.get(&format!("/v1/tails/{tail}/checks")).await, answer);
    assert!(said(&run(&["checks", "import", &name])).contains("1 of 1 tails changed"));
    assert_eq!(service.get(&format!("/v1/tails/{tail}/checks")).await["checks"][0]["date"], "2199-11-01");
    fs::write(&file, "tail,name,date\nEC-ZZZ,C,2199-10-01\n").unwrap();
    refused(&run(&["checks", "import", &name]), "row 2, column tail: tail EC-ZZZ is not known");
    refused(&run(&["checks", "import", "no-such.csv"]), "no-such.csv");
    refused(&run(&["checks", "set", &tail, "C-check=2020-10-01"]), "#/0/date: 2020-10-01 is past");
    refused(&run(&["checks", "set", &tail, "C-check"]), "NAME=DATE");
    refused(&run(&["checks", "set", &tail]), "CHECK");
    refused(&run(&["checks", "set", "EC-ZZZ", "--none"]), "EC-ZZZ");
    assert_eq!(said(&run(&["checks", "set", &tail, "--none"])), "No checks are set.\n");

    assert!(said(&run(&["settings"])).contains("these are the defaults"));
    let file = folder.path().join("settings.json");
    let name = file.display().to_string();
    fs::write(&file, r#"{"risk": 0.05, "time_zone": "Europe/Madrid"}"#).unwrap();
    assert!(said(&run(&["settings", "set", &name])).contains("Europe/Madrid"));
    let told = said(&run(&["settings", "--json"]));
    assert_eq!(serde_json::from_str::<Value>(&told).unwrap(), service.get("/v1/settings").await);
    fs::write(&file, &told).unwrap();
    assert!(said(&run(&["settings", "set", &name])).contains("5 %"), "what was printed is taken");
    fs::write(&file, r#"{"risk": 2}"#).unwrap();
    refused(&run(&["settings", "set", &name]), "#/risk: 2 is not a probability");
    fs::write(&file, "risk = 2").unwrap();
    refused(&run(&["settings", "set", &name]), "is no JSON");
    for command in [["checks", "list"].as_slice(), &["settings"]] {
        let absent = tests::run(&[command, &["--url", "http://127.0.0.1:9"]].concat());
        assert_eq!(absent.status.code(), Some(3));
    }
}
