//! When tails are in the hangar: said for one tail, or for many in a table.

use domain::Scope;
use proto::v1::{self, fleet_health_client::FleetHealthClient};
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tonic::Code;
use tonic_types::StatusExt;

use crate::house::{House, forecast, problem};

const CHECKS: &str = "/v1/tails/EC-MXA/checks";
const ALL: &str = "/v1/checks";

/// A house with two tails on 1 March, the first of which flies 8 hours a day.
async fn flown() -> House {
    let house = House::open().await;
    for i in 0..6 {
        let hours = 40.0 * f64::from(i);
        assert_eq!(house.upload("EC-MXA", &house.body(&format!("u{i}"), hours)).await.status(), 202);
    }
    let mut other = house.body("other", 10.0);
    other["serial_number"] = json!("0002");
    assert_eq!(house.upload("EC-MXB", &other).await.status(), 202);
    house.work(Ok(forecast(80))).await;
    house
}

async fn put(house: &House, path: &str, kind: &str, body: impl Into<String>) -> Response {
    let request = house.client.put(format!("{}{path}", house.url)).header("content-type", kind);
    request.body(body.into()).send().await.unwrap()
}

async fn set(house: &House, tail: &str, checks: Value) -> Value {
    let set = put(house, &format!("/v1/tails/{tail}/checks"), "application/json", checks.to_string()).await;
    assert_eq!(set.status(), StatusCode::OK);
    set.json().await.unwrap()
}

async fn import(house: &House, query: &str, table: &str) -> Value {
    let done = put(house, &format!("{ALL}{query}"), "text/csv", table).await;
    assert_eq!(done.status(), StatusCode::OK);
    done.json().await.unwrap()
}

/// The pointers of a refusal.
async fn pointers(response: Response) -> Vec<String> {
    let problem = problem(response, 422).await;
    let errors = problem["errors"].as_array().unwrap().iter();
    errors.map(|error| error["pointer"].as_str().unwrap().to_owned()).collect()
}

fn terms(name: &str, date: Option<&str>, hours: Option<(f64, &str)>) -> Value {
    let (remaining_fh, as_of) = hours.unzip();
    json!({"name": name, "date": date, "remaining_fh": remaining_fh, "as_of": as_of})
}

#[tokio::test]
async fn checks_are_told_with_the_day_on_which_they_come() {
    let house = flown().await;
    let none = json!({"tail": "EC-MXA", "set_at": null, "set_by": null, "checks": []});
    assert_eq!(house.read(CHECKS).await, none);
    let checks = json!([
        {"name": "C-check", "date": "2026-10-01"},
        {"name": "A-check", "remaining_fh": 80, "as_of": "2026-02-20"},
        {"name": "today", "date": "2026-03-01"}
    ]);
    let told = set(&house, "EC-MXA", checks.clone()).await;
    assert_eq!((&told["set_at"], &told["set_by"]), (&json!("2026-03-01T12:00:00Z"), &json!("loopback")));
    let expected = json!([
        {"name": "C-check", "date": "2026-10-01", "remaining_fh": null, "as_of": null,
         "expected_date": "2026-10-01", "utilisation_source": null, "past": false},
        {"name": "A-check", "date": null, "remaining_fh": 80.0, "as_of": "2026-02-20",
         "expected_date": "2026-03-02", "utilisation_source": "learned", "past": false},
        {"name": "today", "date": "2026-03-01", "remaining_fh": null, "as_of": null,
         "expected_date": "2026-03-01", "utilisation_source": null, "past": false}
    ]);
    assert_eq!(told["checks"], expected);
    assert_eq!(house.read(CHECKS).await, told);
    house.wait_days(1.0);
    assert_eq!(house.read(CHECKS).await["checks"][2]["past"], true, "its day is over");
    assert_eq!(set(&house, "EC-MXB", json!([checks[1]])).await["checks"][0]["expected_date"], Value::Null);
    let plan = json!({"stretches": [{"from": "2026-02-01", "utilisation_fh_per_day": 4}]});
    assert_eq!(put(&house, "/v1/tails/EC-MXB/plan", "application/json", plan.to_string()).await.status(), 200);
    let planned = &house.read("/v1/tails/EC-MXB/checks").await["checks"][0];
    assert_eq!((&planned["expected_date"], &planned["utilisation_source"]), (&json!("2026-03-12"), &json!("plan")));
    assert_eq!(set(&house, "EC-MXA", json!([])).await["checks"], json!([]));
}

#[tokio::test]
async fn days_are_those_of_the_operators_time_zone() {
    let house = flown().await;
    let zone = json!({"time_zone": "Pacific/Auckland"}).to_string();
    assert_eq!(put(&house, "/v1/settings", "application/json", zone).await.status(), 200);
    // It is the second of March there.
    let today = json!([{"name": "C", "date": "2026-03-01"}]).to_string();
    assert_eq!(pointers(put(&house, CHECKS, "application/json", today).await).await, ["#/0/date"]);
    assert_eq!(set(&house, "EC-MXA", json!([{"name": "C", "date": "2026-03-02"}])).await["checks"][0]["past"], false);
}

#[tokio::test]
async fn checks_that_cannot_be_are_refused_by_their_fields() {
    let house = flown().await;
    for (body, expected) in [
        (json!([{"name": "C", "date": "2026-02-28"}]), "#/0/date"),
        (json!([{"name": "C", "date": "2026-02-30"}]), "#/0/date"),
        (json!([{"name": "C", "date": "2026-10-01", "remaining_fh": 5, "as_of": "2026-03-01"}]), "#/0/date"),
        (json!([{"name": "C", "date": "2026-10-01"}, {"name": "C", "date": "2026-11-01"}]), "#/1/name"),
        (json!([{"name": "next", "date": "2026-10-01"}]), "#/0/name"),
        (json!([{"name": "C", "remaining_fh": -5, "as_of": "2026-03-01"}]), "#/0/remaining_fh"),
        (json!([{"name": "C", "date": "2026-10-01", "tail": "EC-MXB"}]), "#/0/tail"),
        (json!({"checks": []}), "#"),
        (json!((0..21).map(|i| json!({"name": format!("C{i}"), "date": "2026-10-01"})).collect::<Vec<_>>()), "#"),
    ] {
        assert_eq!(
            pointers(put(&house, CHECKS, "application/json", body.to_string()).await).await,
            [expected],
            "{body}"
        );
    }
    problem(put(&house, CHECKS, "application/json", "[{").await, 400).await;
    problem(put(&house, CHECKS, "text/csv", "[]").await, 415).await;
    problem(put(&house, "/v1/tails/EC-MXZ/checks", "application/json", "[]").await, 404).await;
    house.refused("/v1/tails/EC-MXZ/checks", 404).await;
    assert_eq!(house.read(CHECKS).await["set_at"], Value::Null, "nothing was changed");
}

#[tokio::test]
async fn a_table_sets_the_checks_of_the_tails_that_it_names() {
    let house = flown().await;
    set(&house, "EC-MXA", json!([{"name": "C", "date": "2026-10-01"}, {"name": "A", "date": "2026-04-01"}])).await;
    set(&house, "EC-MXB", json!([{"name": "C", "date": "2026-11-01"}])).await;
    let table =
        "\u{feff}tail,name,date,remaining_fh,as_of,\r\nEC-MXA,C,2026-12-01,,,\r\n,,,,,\r\nEC-MXA,B,,50,2026-02-27,\r\n";
    let before = house.read(ALL).await;
    let preview = import(&house, "?preview=true", table).await;
    let expected = json!({"tail": "EC-MXA",
        "added": [terms("B", None, Some((50.0, "2026-02-27")))],
        "removed": [terms("A", Some("2026-04-01"), None)],
        "changed": [{"before": terms("C", Some("2026-10-01"), None), "after": terms("C", Some("2026-12-01"), None)}]});
    assert_eq!(preview, json!({"applied": false, "tails": [expected.clone()]}));
    assert_eq!(house.read(ALL).await, before, "nothing was changed");
    assert_eq!(import(&house, "", table).await, json!({"applied": true, "tails": [expected]}));
    let names = |of: &Value| of["checks"].as_array().unwrap().iter().map(|one| one["name"].clone()).collect::<Vec<_>>();
    assert_eq!(names(&house.read(CHECKS).await), ["C", "B"]);
    let after = house.read(ALL).await;
    assert_eq!(after["items"][1], before["items"][1], "the other tail keeps its own");
}

#[tokio::test]
async fn an_exported_table_is_taken_as_it_is() {
    let house = flown().await;
    set(&house, "EC-MXA", json!([{"name": "=C, big", "date": "2026-10-01"}, {"name": "over", "date": "2026-03-01"}]))
        .await;
    set(&house, "EC-MXB", json!([{"name": "A", "remaining_fh": 412.5, "as_of": "2026-02-20"}])).await;
    house.wait_days(2.0);
    let exported = house.get("/v1/checks?format=csv").await;
    assert!(exported.headers()["content-type"].to_str().unwrap().starts_with("text/csv"));
    let table = exported.text().await.unwrap();
    let expected = "tail,name,date,remaining_fh,as_of\r\nEC-MXA,\"'=C, big\",2026-10-01,,\r\n\
                    EC-MXB,A,,412.5,2026-02-20\r\n";
    assert_eq!(table, expected);
    let done = import(&house, "", &table).await;
    assert_eq!(done["tails"][0]["removed"], json!([terms("over", Some("2026-03-01"), None)]), "it was over");
    assert_eq!(done["tails"][1], json!({"tail": "EC-MXB", "added": [], "removed": [], "changed": []}));
    assert_eq!(house.get("/v1/checks?format=csv").await.text().await.unwrap(), table);
    let first = house.read("/v1/checks?limit=1").await;
    assert_eq!((&first["items"][0]["tail"], &first["next_cursor"]), (&json!("EC-MXA"), &json!("EC-MXA")));
    let second = house.read("/v1/checks?limit=5&cursor=EC-MXA").await;
    assert_eq!((&second["items"][0]["tail"], &second["next_cursor"]), (&json!("EC-MXB"), &Value::Null));
}

#[tokio::test]
async fn a_table_with_anything_wrong_changes_nothing_and_names_each_row() {
    let house = flown().await;
    let table = "tail,name,date\nEC-MXA,C,2026-10-01\nEC-MXZ,C,2026-10-01\nEC-MXB,C,2026-02-01\n";
    let refused = put(&house, ALL, "text/csv", table).await;
    assert_eq!(pointers(refused).await, ["#/3/tail", "#/4/date"]);
    for (table, expected) in [("", "#"), ("tail;name;date\n", "#/1"), ("tail,name,date\nEC-MXA,\"C\n", "#/2")] {
        assert_eq!(pointers(put(&house, ALL, "text/csv", table).await).await, [expected], "{table:?}");
    }
    problem(put(&house, ALL, "application/json", "[]").await, 415).await;
    problem(put(&house, "/v1/checks?preview=maybe", "text/csv", table).await, 422).await;
    problem(put(&house, ALL, "text/csv", "x".repeat((2 << 20) + 1)).await, 413).await;
    assert_eq!(house.read(ALL).await["items"], json!([]), "nothing was changed");
}

#[tokio::test]
async fn rows_are_set_together_and_too_many_are_refused() {
    let house = flown().await;
    let rows: String = (0..20).map(|i| format!("EC-MXA,check {i},2026-10-{:02},,\n", i + 1)).collect();
    let many = format!("tail,name,date,remaining_fh,as_of\n{}", rows.repeat(501));
    assert_eq!(pointers(put(&house, ALL, "text/csv", many).await).await, ["#"], "too many");
    let table = format!("tail,name,date,remaining_fh,as_of\n{rows}");
    assert_eq!(import(&house, "", &table).await["tails"][0]["added"].as_array().unwrap().len(), 20);
}

#[tokio::test]
async fn no_operator_learns_anything_of_anothers_checks_and_settings() {
    let house = House::open().await;
    let admins =
        [house.token("default", Scope::Admin).await.reveal(), house.token("elsewhere", Scope::Admin).await.reveal()];
    let ask = async |who: usize, method: Method, path: &str, kind: &str, body: String| {
        let request = house.client.request(method, format!("{}{path}", house.url)).bearer_auth(&admins[who]);
        request.header("content-type", kind).body(body).send().await.unwrap()
    };
    let json = "application/json";
    let upload = house.body("u", 10.0).to_string();
    assert_eq!(ask(0, Method::POST, "/v1/tails/EC-MXA/uploads", json, upload).await.status(), 202);
    let checks = json!([{"name": "C", "date": "2026-10-01"}]).to_string();
    assert_eq!(ask(0, Method::PUT, CHECKS, json, checks.clone()).await.status(), 200);
    assert_eq!(ask(0, Method::PUT, "/v1/settings", json, json!({"risk": 0.03}).to_string()).await.status(), 200);
    assert_eq!(ask(1, Method::GET, CHECKS, json, String::new()).await.status(), 404);
    assert_eq!(ask(1, Method::PUT, CHECKS, json, checks).await.status(), 404);
    let listed: Value = ask(1, Method::GET, ALL, json, String::new()).await.json().await.unwrap();
    assert_eq!(listed, json!({"items": [], "next_cursor": null}));
    let table =
        ask(1, Method::PUT, "/v1/checks?preview=true", "text/csv", "tail,name,date\nEC-MXA,C,2026-12-01\n".to_owned());
    assert_eq!(pointers(table.await).await, ["#/2/tail"]);
    let settings: Value = ask(1, Method::GET, "/v1/settings", json, String::new()).await.json().await.unwrap();
    assert_eq!((&settings["risk"], &settings["set_at"]), (&json!(0.1), &Value::Null));
    let ops = house.token("default", Scope::Ops).await.reveal();
    for path in [CHECKS, ALL, "/v1/settings"] {
        let put = house.client.put(format!("{}{path}", house.url)).bearer_auth(&ops).header("content-type", json);
        problem(put.body("[]").send().await.unwrap(), 403).await;
    }
}

#[tokio::test]
async fn checks_and_settings_are_the_same_over_grpc() {
    let house = flown().await;
    let mut client = FleetHealthClient::new(house.channel().await);
    let tail = || "EC-MXA".to_owned();
    let none = client.get_checks(v1::GetChecksRequest { tail: tail() }).await.unwrap().into_inner();
    assert_eq!(none, v1::TailChecks { tail: tail(), ..Default::default() });
    let check = |name: &str, hours| v1::Check {
        name: name.to_owned(),
        remaining_fh: Some(hours),
        as_of: Some("2026-02-20".to_owned()),
        date: None,
    };
    let request = v1::SetChecksRequest { tail: tail(), checks: vec![check("A", 80.0)] };
    let set = client.set_checks(request).await.unwrap().into_inner();
    assert_eq!(set, client.get_checks(v1::GetChecksRequest { tail: tail() }).await.unwrap().into_inner());
    let told = house.read(CHECKS).await;
    let [one] = &set.checks[..] else { panic!("{set:?}") };
    assert_eq!((one.check.as_ref(), set.set_by.as_deref()), (Some(&check("A", 80.0)), told["set_by"].as_str()));
    assert_eq!(one.expected_date.as_deref(), told["checks"][0]["expected_date"].as_str());
    assert_eq!(one.utilisation_source(), v1::UtilisationSource::Learned);
    let bad = v1::SetChecksRequest { tail: tail(), checks: vec![check("A", 80.0), check("A", 0.0)] };
    let status = client.set_checks(bad).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);
    let fields: Vec<_> =
        status.get_details_bad_request().unwrap().field_violations.into_iter().map(|one| one.field).collect();
    assert_eq!(fields, ["checks[1].name", "checks[1].remaining_fh"]);
    let function = v1::Function { name: "roll".to_owned(), positions: vec!["AIL-L".to_owned()], needed: 1 };
    let wanted = v1::SetSettingsRequest { risk: Some(0.05), functions: vec![function.clone()], ..Default::default() };
    let set = client.set_settings(wanted).await.unwrap().into_inner();
    assert_eq!((set.risk, &set.functions, set.stale_after_days), (0.05, &vec![function], 30.0));
    assert_eq!(set, client.get_settings(v1::GetSettingsRequest {}).await.unwrap().into_inner());
    assert_eq!(house.read("/v1/settings").await["risk"], 0.05);
    let status =
        client.set_settings(v1::SetSettingsRequest { risk: Some(1.0), ..Default::default() }).await.unwrap_err();
    assert_eq!(status.get_details_bad_request().unwrap().field_violations[0].field, "risk");
}
