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
        assert!(stderr.contains(words) && stderr.lines().count() == 1, "{words}: {stderr}");
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
