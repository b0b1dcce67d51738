//! The main job, as a new user runs it.

use serde_json::Value;

fn demo(arguments: &[&str]) -> Vec<Value> {
    let fixed = ["demo", "--tails", "1", "--hours", "24", "--port", "0", "--exit", "--json"];
    let output = tests::run(&[&fixed, arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("an array of RUL objects on standard output, and nothing else")
}

#[test]
fn slow_the_demo_prints_remaining_lives_and_repeats_itself() {
    let fleet = demo(&["--seed", "5"]);
    assert_eq!(fleet.len(), 2, "one aircraft with two actuators");
    for rul in &fleet {
        assert_eq!(rul["pending_uploads"], 0);
        let quantiles = ["p05", "p10", "p25", "p50", "p75", "p90", "p95"].map(|name| rul["rul_fh"][name].as_f64());
        let known: Vec<f64> = quantiles.into_iter().flatten().collect();
        assert!(known.len() >= 4 && known.is_sorted(), "{quantiles:?}");
        assert!(rul["advisory"].as_str().is_some_and(|advisory| advisory.contains("no maintenance credit")));
    }
    assert_eq!(fleet, demo(&["--seed", "5"]), "the same seed gives the same answers");
}

#[test]
fn slow_the_demo_goes_on_where_its_data_ends() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let hours = |fleet: &[Value]| fleet[0]["as_of"]["flight_hours"].as_f64().unwrap();
    let first = demo(&["--seed", "6", "--data", data]);
    let second = demo(&["--seed", "6", "--data", data]);
    assert_eq!(hours(&second), hours(&first) + 24.0);
    assert_eq!(first[0]["serial_number"], second[0]["serial_number"]);
}

#[test]
fn the_demo_refuses_a_database_that_asks_for_tokens() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("actuary.sqlite").display());
    let created = tests::run(&["token", "create", "--scope", "ops", "--database-url", &database]);
    assert!(created.status.success(), "{}", String::from_utf8_lossy(&created.stderr));
    let refused = tests::run(&["demo", "--data", folder.path().to_str().unwrap(), "--port", "0", "--exit"]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), said.lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("tokens were created in") && said.contains("give another folder"), "{said}");
}
