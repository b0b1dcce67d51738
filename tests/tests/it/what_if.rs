//! `actuary what-if` asks a running service, and says in words what it answers.

use std::process::Output;

use serde_json::Value;
use tests::Service;

fn what_if(service: &Service, arguments: &[&str]) -> Output {
    tests::run(&[&["what-if", "--url", &service.url], arguments].concat())
}

fn said(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[tokio::test]
async fn a_question_is_answered_in_words_or_as_the_service_says_it() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let flown = tests::run(&["simulate", "fleet", "--url", &service.url, "--tails", "1", "--physics", "closed-form"]);
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    service.settled_fleet().await;
    let tails = service.get("/v1/tails").await;
    let tail = tails["items"][0]["tail"].as_str().unwrap().to_owned();
    let detail = service.get(&format!("/v1/tails/{tail}")).await;
    let forecast = |position: &&Value| position["prognosis"]["rul_fh"].is_object();
    let told = detail["positions"].as_array().unwrap().iter().find(forecast).expect("one has a forecast");
    let position = told["position"].as_str().unwrap();
    let place = ["--tail", &tail, "--position", position];
    let ask = |arguments: &[&str]| what_if(&service, &[&place[..], arguments].concat());

    let json: Value =
        serde_json::from_str(&said(&ask(&["--utilisation", "2", "--within-fh", "300", "--json"]))).unwrap();
    assert_eq!(json["now"], told["prognosis"]);
    assert_eq!(json["assumed"]["rul_fh"], told["prognosis"]["rul_fh"]);
    assert_eq!(json["assumed"]["end_of_life"]["utilisation_fh_per_day"], 2.0);
    assert_eq!(json["probability"]["assumed"]["within_fh"], 300.0);
    let words = said(&ask(&["--utilisation", "2", "--by", "2199-01-01"]));
    for part in ["remaining life, median", "2.0 (assumed)", "P(fails by 2199-01-01)", "no maintenance credit"] {
        assert!(words.contains(part), "{part}: {words}");
    }

    let refused = |output: &Output, words: &str| {
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.lines().next().is_some_and(|line| line.contains(words)), "{words}: {stderr}");
        assert!(output.stdout.is_empty());
    };
    for (arguments, words) in [
        (["--load-factor", "100"], "#/load_factor: 100 is outside 0.1 to 10 times"),
        (["--load-factor", "NaN"], "--load-factor"),
        (["--utilisation", "0"], "#/utilisation_fh_per_day"),
        (["--utilisation", "-3"], "#/utilisation_fh_per_day"),
        (["--by", "2020-01-01"], "is past"),
        (["--by", "soon"], "#/by"),
        (["--within-fh", "10001"], "#/within_fh"),
    ] {
        refused(&ask(&arguments), words);
    }
    refused(&ask(&["--by", "2199-01-01", "--within-fh", "3"]), "--within-fh");
    refused(&what_if(&service, &["--tail", "EC-ZZZ", "--position", position]), "EC-ZZZ");
    refused(&what_if(&service, &["--tail", "not a tail", "--position", position]), "--tail");
    let absent = tests::run(&["what-if", "--url", "http://127.0.0.1:9", "--tail", &tail, "--position", position]);
    assert_eq!(absent.status.code(), Some(3));
}

/// Two tails, one of them on short hops: the answers say why its actuators are due earlier, and what a transfer would change.
#[tokio::test]
async fn missions_are_told_apart_by_their_pace_and_a_transfer_can_be_asked_and_planned() {
    let folder = tempfile::tempdir().unwrap();
    let paced = folder.path().join("paced.json").display().to_string();
    let shipped = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/default.json").display().to_string();
    let told = ["--exponent", "2", "--exponent-sd", "0.2", "--temperature", "0.3", "--out", &paced];
    said(&tests::run(&[&["model", "pace", "--model", &shipped][..], &told].concat()));
    let database = folder.path().join("fleet.sqlite");
    let service = Service::start(&database, 0);
    let url = format!("sqlite:{}", database.display());
    let hash = said(&tests::run(&["model", "add", &paced, "--database-url", &url]));
    said(&tests::run(&["model", "activate", &hash[..12], "--database-url", &url]));
    let fleet = ["simulate", "fleet", "--url", &service.url, "--tails", "2", "--positions", "1"];
    said(&tests::run(&[&fleet[..], &["--physics", "closed-form", "--missions", "short-haul,cruise"]].concat()));
    service.settled_fleet().await;

    let rul = async |tail: &str| service.get(&format!("/v1/tails/{tail}/positions/AIL-L/rul")).await;
    let pace = |rul: &Value| rul["pace"]["now"].as_f64().expect("a pace");
    let (short, cruise) = (rul("EC-A001").await, rul("EC-A002").await);
    assert!(pace(&short) > 1.2 * pace(&cruise), "{} and {}", short["pace"], cruise["pace"]);
    assert!(short["pace"]["known_share"].as_f64().unwrap() > 0.9, "{}", short["pace"]);
    let b = &short["propagation"]["control_matrix"][0];
    assert!(b[1].as_f64().unwrap() != 0.0 && b[2].as_f64().unwrap() != 0.0, "load and temperature have columns: {b}");

    let place = ["--tail", "EC-A002", "--position", "AIL-L", "--json"];
    let ask = |arguments: &[&str]| -> Value {
        serde_json::from_str(&said(&what_if(&service, &[&place[..], arguments].concat()))).unwrap()
    };
    let median = |rul: &Value| rul["rul_fh"]["p50"].as_f64().unwrap_or(10_000.0);
    let harder = ask(&["--load-factor", "1.4", "--temperature-offset", "10"]);
    assert_eq!(harder["now"], cruise);
    assert!(
        median(&harder["assumed"]) < 0.65 * median(&cruise),
        "{} and {}",
        harder["assumed"]["rul_fh"],
        cruise["rul_fh"]
    );
    assert_eq!(rul("EC-A002").await, cruise, "asking changes nothing");

    let load = 1.4 * cruise["pace"]["load"].as_f64().unwrap();
    let plan = serde_json::json!({ "stretches": [{ "from": "2020-01-01", "load": load, "mission": "short-haul" }] });
    let put = tests::http().put(format!("{}/v1/tails/EC-A002/plan", service.url)).json(&plan).send().await.unwrap();
    assert!(put.status().is_success(), "{}", put.text().await.unwrap());
    let mut planned = rul("EC-A002").await;
    for _ in 0..600 {
        if planned["rul_fh"] != cruise["rul_fh"] {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
        planned = rul("EC-A002").await;
    }
    assert!(median(&planned) < 0.7 * median(&cruise), "{} and {}", planned["rul_fh"], cruise["rul_fh"]);
    assert_eq!(planned["pace"]["last_200_fh"], cruise["pace"]["last_200_fh"], "what was flown stays");
}
