//! Bad input is refused with the name of the field, and nothing of it is stored.

use proto::{
    grpc::from_upload,
    json::{UploadBody, example_sensor_configuration},
    v1::{self, ListHealthRequest, fleet_health_client::FleetHealthClient, ingest_client::IngestClient},
};
use reqwest::Method;
use serde_json::{Value, json};
use tonic::{Code, Status};
use tonic_types::StatusExt;

use crate::house::{House, PROBLEM, problem};

/// What is wrong, the body, the status and the field.
type Case = (&'static str, String, u16, &'static str);

/// A good body with one field replaced, or removed by null.
fn with(house: &House, field: &str, value: Value) -> String {
    let mut body = house.body("bad", 10.0);
    match value {
        Value::Null => drop(body.as_object_mut().unwrap().remove(field)),
        value => body[field] = value,
    }
    body.to_string()
}

/// A good body with a text in the place of the first sample.
fn with_sample(house: &House, text: &str) -> String {
    house.body("bad", 10.0).to_string().replacen("0.07,", &format!("{text},"), 1)
}

fn cases(house: &House) -> Vec<Case> {
    let with = |field: &str, value: Value| with(house, field, value);
    let sample = |text: &str| with_sample(house, text);
    vec![
        ("nothing", String::new(), 400, "#"),
        ("no JSON", "samples=1".into(), 400, "#"),
        ("cut off", house.body("bad", 10.0).to_string()[..60].into(), 400, "#"),
        ("two bodies", format!("{0}{0}", house.body("bad", 10.0)), 400, "#"),
        ("a list", "[]".into(), 422, "#"),
        ("NaN", sample("NaN"), 400, "#/samples/0"),
        ("Infinity", sample("-Infinity"), 400, "#/samples/0"),
        ("a number beyond doubles", sample("1e400"), 400, "#/samples/0"),
        ("text for a number", sample("\"x\""), 422, "#/samples/0"),
        ("an absurd sample", sample("1e300"), 422, "#/samples/0"),
        ("absurd hours", with("flight_hours", json!(-1)), 422, "#/flight_hours"),
        ("absurd cycles", with("flight_cycles", json!(-1)), 422, "#/flight_cycles"),
        ("absurd temperature", with("temperature_c", json!(1e6)), 422, "#/temperature_c"),
        ("absurd load ratio", with("load_ratio", json!([99, 0, null, 0])), 422, "#/load_ratio/0"),
        ("a load ratio too few", with("load_ratio", json!([0, 0, 0])), 422, "#/load_ratio"),
        ("a sample too few", with("samples", json!([0.07, 0.07, 0.07])), 422, "#/samples"),
        ("a sample too many", with("samples", json!([0.07, 0.07, 0.07, 0.07, 0.07])), 422, "#/samples"),
        ("an unknown mask", with("mask_id", json!("0".repeat(64))), 422, "#/mask_id"),
        ("no mask", with("mask_id", json!("round")), 422, "#/mask_id"),
        ("a time without offset", with("recorded_at", json!("2026-03-01T12:30:00")), 422, "#/recorded_at"),
        ("a position of another form", with("position", json!("A/B")), 422, "#/position"),
        ("an upload_id of another form", with("upload_id", json!("a b")), 422, "#/upload_id"),
        ("a serial number with a newline", with("serial_number", json!("1\n2")), 422, "#/serial_number"),
        ("an unknown field", with("colour", json!("red")), 422, "#/colour"),
        ("strain of too few gratings", with("strain", strain()), 422, "#/strain/wavelengths_nm"),
        ("air data without a field", with("air_data", json!({"flap_rad": 0})), 422, "#/air_data/dynamic_pressure_pa"),
        (
            "deep nesting",
            with("samples", json!(0)).replace(":0,", &format!(":{},", "[".repeat(50_000))),
            422,
            "#/samples/0",
        ),
        ("deep nesting of an unknown field", format!("{{\"x\":{}", "[".repeat(50_000)), 422, "#/x"),
    ]
}

fn strain() -> Value {
    json!({"wavelengths_nm": [1550], "temperature_wavelengths_nm": [null, null, null, null]})
}

async fn nothing_is_stored(house: &House) {
    assert_eq!(house.store.pending().await.unwrap(), 0);
    assert_eq!(house.read("/v1/tails").await, json!({"items": [], "next_cursor": null}));
    house.refused("/v1/uploads/bad", 404).await;
}

#[tokio::test]
async fn every_bad_body_is_refused_by_the_name_of_the_field() {
    let house = House::open().await;
    for (what, body, status, pointer) in cases(&house) {
        let response = house.post("EC-MXA", "application/json", body).await;
        assert_eq!(response.status().as_u16(), status, "{what}");
        let refused = problem(response, status).await;
        let named = refused["errors"][0]["pointer"].as_str().unwrap_or_default();
        assert!(if pointer == "#" { named.starts_with('#') } else { named == pointer }, "{what}: {refused}");
    }
    nothing_is_stored(&house).await;
}

#[tokio::test]
async fn every_missing_field_is_named() {
    let house = House::open().await;
    let required =
        ["upload_id", "position", "part_number", "serial_number", "flight_hours", "recorded_at", "mask_id", "samples"];
    for field in required {
        let response = house.post("EC-MXA", "application/json", with(&house, field, Value::Null)).await;
        assert_eq!(problem(response, 422).await["errors"][0]["pointer"], format!("#/{field}"));
    }
    nothing_is_stored(&house).await;
}

#[tokio::test]
async fn all_violations_are_told_at_once() {
    let house = House::open().await;
    let mut body = house.body("bad", -1.0);
    body["samples"] = json!([1e9, null, null, -1e9]);
    let refused = problem(house.upload("EC-MXA", &body).await, 422).await;
    let pointers: Vec<_> = refused["errors"].as_array().unwrap().iter().map(|error| &error["pointer"]).collect();
    assert_eq!(pointers, ["#/flight_hours", "#/samples/0", "#/samples/3", "#/load_ratio/1"][..pointers.len()]);
    assert!(pointers.len() >= 3);
}

#[tokio::test]
async fn an_answer_names_fifty_violations_and_no_more() {
    let house = House::open().await;
    let mut body = house.body("bad", 10.0);
    body["samples"] = json!(vec![0.07; 10_000]);
    body["load_ratio"] = json!(vec![Value::Null; 10_000]);
    let refused = problem(house.upload("EC-MXA", &body).await, 422).await;
    assert_eq!(refused["errors"].as_array().unwrap().len(), 50);
    let mut request = house.request("bad", 10.0);
    request.missing = vec![7; 100_000];
    let refused = IngestClient::new(house.channel().await).upload(request).await.unwrap_err();
    assert_eq!(refused.code(), Code::InvalidArgument);
    assert_eq!(refused.get_error_details().bad_request().unwrap().field_violations.len(), 50);
}

#[tokio::test]
async fn size_and_type_are_checked() {
    let house = House::open().await;
    let large = with(&house, "colour", json!("x".repeat(300_000)));
    problem(house.post("EC-MXA", "application/json", large.clone()).await, 413).await;
    let unannounced = reqwest::Body::wrap_stream(tokio_stream::iter([Ok::<_, std::io::Error>(large)]));
    problem(house.post("EC-MXA", "application/json", unannounced).await, 413).await;
    problem(house.post("EC-MXA", "text/csv", "a,b").await, 415).await;
    let untyped = house.client.post(format!("{}/v1/tails/EC-MXA/uploads", house.url)).body("{}");
    problem(untyped.send().await.unwrap(), 415).await;
    nothing_is_stored(&house).await;
}

#[tokio::test]
async fn parameters_are_refused_by_name() {
    let house = House::open().await;
    let place = "/v1/tails/EC-MXA/positions/AIL-L";
    let cases = [
        ("/v1/tails/ec-mxa".to_owned(), "tail"),
        ("/v1/tails/%FF".to_owned(), "tail"),
        ("/v1/tails/EC-MXA/positions/A%20B/rul".to_owned(), "position"),
        ("/v1/uploads/a%20b".to_owned(), "upload_id"),
        ("/v1/models/abc".to_owned(), "hash"),
        ("/v1/tails?limit=0".to_owned(), "limit"),
        ("/v1/tails?limit=1001".to_owned(), "limit"),
        ("/v1/tails?cursor=x".to_owned(), "cursor"),
        ("/v1/tails?colour=red".to_owned(), "colour"),
        (format!("{place}/rul?within_fh=soon"), "within_fh"),
        (format!("{place}/health?from_fh=NaN"), "from_fh"),
        (format!("{place}/health?to_fh=-1"), "to_fh"),
        (format!("{place}/health?view=all"), "view"),
        (format!("{place}/health?cursor=5"), "cursor"),
        (format!("{place}/health?view=states&cursor=1_2_u"), "cursor"),
        ("/v1/components/%FF/1".to_owned(), "part"),
        ("/v1/components/EMA/%0A".to_owned(), "serial"),
        (format!("/v1/components/{}/1", "x".repeat(33)), "part"),
        ("/v1/components/EMA/1/health?from_fh=1e309".to_owned(), "from_fh"),
        ("/v1/components/EMA/1/health?cursor=NaN_1_u".to_owned(), "cursor"),
        ("/v1/components/EMA/1/health?view=%00".to_owned(), "view"),
        ("/v1/components/EMA/1/health?limit=1.5".to_owned(), "limit"),
        ("/v1/tails/%20/sensor-configurations".to_owned(), "tail"),
        ("/v1/uploads".to_owned(), "state"),
        ("/v1/uploads?state=lost".to_owned(), "state"),
        ("/v1/uploads?state=pending&state=voided".to_owned(), "state"),
        ("/v1/uploads?state=pending&limit=-1".to_owned(), "limit"),
        ("/v1/uploads?state=pending&cursor=a%20b".to_owned(), "cursor"),
        ("/v1/uploads?state=pending&colour=red".to_owned(), "colour"),
    ];
    for (path, parameter) in cases {
        assert_eq!(house.refused(&path, 422).await["errors"][0]["parameter"], parameter, "{path}");
    }
    for path in ["/v1/uploads/a%20b/void", "/v1/uploads/%FF/retry"] {
        assert_eq!(problem(house.act(path).await, 422).await["errors"][0]["parameter"], "upload_id", "{path}");
    }
    let posted = problem(house.upload("ec-mxa", &house.body("bad", 1.0)).await, 422).await;
    assert_eq!(posted["errors"][0]["parameter"], "tail");
    nothing_is_stored(&house).await;
}

/// What is done to a good request.
type Change = fn(&mut v1::UploadRequest);

fn field(refused: &Status) -> String {
    assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    refused.get_error_details().bad_request().unwrap().field_violations[0].field.clone()
}

#[tokio::test]
async fn grpc_names_the_field_too() {
    let house = House::open().await;
    let mut grpc = IngestClient::new(house.channel().await);
    let body: UploadBody = serde_json::from_value(house.body("bad", 10.0)).unwrap();
    let good = from_upload(body.into_upload("EC-MXA".parse().unwrap()).unwrap());
    let cases: [(Change, &str); 9] = [
        (|r| r.tail = "ec".into(), "tail"),
        (|r| r.samples[1] = f64::NAN, "samples[1]"),
        (|r| r.samples[1] = f64::NEG_INFINITY, "samples[1]"),
        (|r| r.samples.push(0.07), "samples"),
        (|r| r.missing = vec![4], "missing[0]"),
        (|r| r.flight_hours = None, "flight_hours"),
        (|r| r.recorded_at = None, "recorded_at"),
        (|r| r.mask_id = "0".repeat(64), "mask_id"),
        (|r| r.load_ratio[0] = 1e9, "load_ratio[0]"),
    ];
    for (change, name) in cases {
        let mut request = good.clone();
        change(&mut request);
        assert_eq!(field(&grpc.upload(request).await.unwrap_err()), name);
    }
    let mut large = good.clone();
    large.samples = vec![0.07; 100_000];
    assert_eq!(grpc.upload(large).await.unwrap_err().code(), Code::OutOfRange);
    nothing_is_stored(&house).await;
}

/// The example of a sensor configuration with one place of it replaced, or removed by null.
fn configuration(pointer: &str, value: Value) -> String {
    let mut body = json!({
        "effective_from": "2026-03-01T00:00:00Z",
        "configuration": json!(example_sensor_configuration()),
    });
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    match (body.pointer_mut(parent).unwrap(), value) {
        (Value::Object(map), Value::Null) => drop(map.remove(name)),
        (Value::Object(map), value) => drop(map.insert(name.to_owned(), value)),
        (Value::Array(list), value) => list[name.parse::<usize>().unwrap()] = value,
        _ => panic!("{pointer}"),
    }
    body.to_string()
}

fn configuration_cases() -> Vec<Case> {
    let with = |pointer: &str, value: Value| configuration(&format!("/configuration{pointer}"), value);
    let number =
        |text: &str| with("/gain_noise", json!(0.5)).replace("\"gain_noise\":0.5", &format!("\"gain_noise\":{text}"));
    vec![
        ("nothing", String::new(), 400, "#"),
        ("a list", "[]".into(), 422, "#"),
        ("NaN", number("NaN"), 400, "#/configuration/gain_noise"),
        ("a number beyond doubles", number("1e400"), 400, "#/configuration/gain_noise"),
        ("an absurd gain", number("-1"), 422, "#/configuration/gain_noise"),
        ("no time", configuration("/effective_from", Value::Null), 422, "#/effective_from"),
        ("a time that is none", configuration("/effective_from", json!("soon")), 422, "#/effective_from"),
        ("no configuration", configuration("/configuration", Value::Null), 422, "#/configuration"),
        ("an unknown field", configuration("/colour", json!(1)), 422, "#/colour"),
        ("an unknown field within", with("/colour", json!(1)), 422, "#/configuration/colour"),
        ("too few gratings", with("/strain_gratings", json!([])), 422, "#/configuration/strain_gratings"),
        ("a row too short", with("/strain_map/3", json!([0, 0, 0, 0])), 422, "#/configuration/strain_map/3"),
        ("an absurd factor", with("/strain_map/3/1", json!(1e9)), 422, "#/configuration/strain_map/3/1"),
        (
            "a station outside",
            with("/strain_gratings/2/station", json!(4)),
            422,
            "#/configuration/strain_gratings/2/station",
        ),
        (
            "a negative station",
            with("/strain_gratings/2/station", json!(-4)),
            422,
            "#/configuration/strain_gratings/2/station",
        ),
        (
            "a bonding day",
            with("/strain_gratings/0/bonded_at", json!("monday")),
            422,
            "#/configuration/strain_gratings/0/bonded_at",
        ),
        (
            "an absurd wavelength",
            with("/temperature_wavelengths_nm/1", json!(1)),
            422,
            "#/configuration/temperature_wavelengths_nm/1",
        ),
        (
            "another surface",
            with("/positions/AIL-L/surface", json!("rudder")),
            422,
            "#/configuration/positions/AIL-L/surface",
        ),
        (
            "deep nesting",
            with("/strain_map", json!(0))
                .replace("\"strain_map\":0", &format!("\"strain_map\":{}", "[".repeat(50_000))),
            422,
            "#/configuration/strain_map/0/0",
        ),
    ]
}

#[tokio::test]
async fn every_bad_sensor_configuration_is_refused_by_the_name_of_the_field() {
    let house = House::open().await;
    let url = format!("{}/v1/tails/EC-MXA/sensor-configurations", house.url);
    let post = |content_type: &'static str, body: Vec<u8>| {
        house.client.post(&url).header("content-type", content_type).body(body).send()
    };
    for (what, body, status, pointer) in configuration_cases() {
        let response = post("application/json", body.into_bytes()).await.unwrap();
        assert_eq!(response.status().as_u16(), status, "{what}");
        let refused = problem(response, status).await;
        let named = refused["errors"][0]["pointer"].as_str().unwrap_or_default();
        assert!(if pointer == "#" { named.starts_with('#') } else { named == pointer }, "{what}: {refused}");
    }
    problem(post("application/json", vec![b' '; 300_000]).await.unwrap(), 413).await;
    problem(post("application/json", b"{\"effective_from\":\"\xff\"}".to_vec()).await.unwrap(), 400).await;
    problem(post("application/x-ndjson", b"{}".to_vec()).await.unwrap(), 415).await;
    let packed = house.client.post(&url).header("content-type", "application/json").header("content-encoding", "gzip");
    problem(packed.body("x").send().await.unwrap(), 415).await;
    house.refused("/v1/tails/EC-MXA/sensor-configurations", 404).await;
}

/// Texts in the place of names, percent-encoded.
const ODD_NAMES: [&str; 9] =
    ["%00", "%FF", "%20", "..%2F..", "a%2Fb", "%F0%9F%9B%A9", "'%3B%20drop%20table%20uploads--", "NaN", "%7Btail%7D"];
const ODD_QUERY: &str = "limit=NaN&cursor=%FF%00&view=%F0&state=&within_fh=,&from_fh=inf&to_fh=-0x1&a[]=1&=&&%";

#[tokio::test]
async fn odd_names_queries_and_methods_are_never_a_fault_of_the_server() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    let long = "9".repeat(2000);
    for path in document["paths"].as_object().unwrap().keys().filter(|path| path.starts_with("/v1")) {
        for name in ODD_NAMES.into_iter().chain([long.as_str()]) {
            let filled: Vec<String> = path
                .split('/')
                .map(|step| if step.starts_with('{') { name.to_owned() } else { step.to_owned() })
                .collect();
            let url = format!("{}{}?{ODD_QUERY}", house.url, filled.join("/"));
            for method in [Method::GET, Method::POST, Method::PUT, Method::DELETE] {
                let request = house.client.request(method.clone(), &url).header("content-type", "application/json");
                let response = request.body(vec![0xff, 0xfe, b'{']).send().await.unwrap();
                let status = response.status();
                // Collections that take no parameters ignore them.
                let listed = status == 200 && method == Method::GET && path == "/v1/models";
                assert!(listed || status.is_client_error(), "{method} {url}: {status}");
                assert!(listed || response.headers()["content-type"] == PROBLEM, "{method} {url}");
            }
        }
    }
    nothing_is_stored(&house).await;
}

#[tokio::test]
async fn grpc_questions_are_refused_by_the_name_of_the_field() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 10.0)).await.status(), 202);
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place = ListHealthRequest { tail: "EC-MXA".into(), position: "AIL-L".into(), ..Default::default() };
    let unit = ListHealthRequest { part_number: "EMA-500".into(), serial_number: "SN 1".into(), ..Default::default() };
    let cases = [
        (ListHealthRequest::default(), "tail"),
        (ListHealthRequest { part_number: "EMA-500".into(), ..place.clone() }, "part_number"),
        (ListHealthRequest { position: String::new(), ..place.clone() }, "position"),
        (ListHealthRequest { tail: "ec mxa".into(), ..place.clone() }, "tail"),
        (ListHealthRequest { serial_number: "1\n2".into(), ..unit.clone() }, "serial_number"),
        (ListHealthRequest { view: 7, ..place.clone() }, "view"),
        (ListHealthRequest { limit: 1001, ..place.clone() }, "limit"),
        (ListHealthRequest { from_fh: Some(f64::NAN), ..place.clone() }, "from_fh"),
        (ListHealthRequest { to_fh: Some(f64::INFINITY), ..place.clone() }, "to_fh"),
        (ListHealthRequest { cursor: "5".into(), ..place.clone() }, "cursor"),
        (ListHealthRequest { cursor: "1_2_u".into(), view: 2, ..unit.clone() }, "cursor"),
    ];
    for (request, name) in cases {
        assert_eq!(field(&grpc.list_health(request.clone()).await.unwrap_err()), name, "{request:?}");
    }
    let unknown = ListHealthRequest { serial_number: "SN 2".into(), ..unit };
    assert_eq!(grpc.list_health(unknown).await.unwrap_err().code(), Code::NotFound);
    assert_eq!(field(&grpc.get_tail(v1::GetTailRequest { tail: "\0".into() }).await.unwrap_err()), "tail");
}
