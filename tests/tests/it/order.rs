//! What the service knows is a function of the set of uploads: order, repetition and accidents leave no trace.
//!
//! Failures here: uploads late, out of order and sent again; SIGKILL in the middle; a component that
//! moves between tails; an upload whose hours cannot be. Nondeterminism left on purpose: which uploads
//! meet in one lease.

use std::path::Path;

use numerics::Stream;
use serde_json::{Value, json};
use tests::{Service, digest, items};

const FLIGHTS: usize = 60;

/// Uploads of two components, as (tail, body). The first moves from one tail to the other in mid-life.
async fn uploads(service: &Service) -> Vec<(&'static str, Value)> {
    let model = items(service.get("/v1/models").await)[0]["hash"].as_str().unwrap().to_owned();
    let mask = service.get(&format!("/v1/models/{model}/mask")).await;
    let points = mask["points"].as_array().unwrap().len();
    let mut uploads = Vec::new();
    for (serial, stays) in [("moving", false), ("staying", true)] {
        let mut stream = Stream::new(7, &["order", serial]);
        for flight in 0..FLIGHTS {
            let tail = if stays || flight >= FLIGHTS / 2 { "EC-ORB" } else { "EC-ORA" };
            let position = if stays { "FLAP-L" } else { "AIL-R" };
            let wear = 1.0 - 1e-4 * (flight as f64 / 15.0).exp();
            let samples: Vec<f64> = (0..points).map(|_| 0.0752 * (wear + 0.01 * stream.normal())).collect();
            // One upload claims hours that nobody can have flown.
            let flight_hours = 4.0 * flight as f64 + if flight == 40 && stays { 5000.0 } else { 0.0 };
            let (day, hour) = (flight / 2 + 1, 12 * (flight % 2));
            uploads.push((
                tail,
                json!({
                    "upload_id": format!("{serial}.{flight}"), "position": position, "part_number": "EMA-48V",
                    "serial_number": serial, "flight_hours": flight_hours, "mask_id": mask["mask_id"],
                    "recorded_at": format!("2026-01-{day:02}T{hour:02}:30:00Z"), "samples": samples,
                    "load_ratio": 0.1, "sample_noise": 0.01, "temperature_c": 15.0,
                    "air_data": { "dynamic_pressure_pa": 1500.0 + stream.normal(), "airspeed_m_s": 49.5,
                        "angle_of_attack_rad": 0.05, "roll_rate_rad_s": 0.0, "flap_rad": 0.1, "aileron_rad": 0.05 },
                }),
            ));
        }
    }
    uploads
}

async fn send(service: &Service, uploads: &[(&'static str, Value)]) {
    for (tail, body) in uploads {
        let url = format!("{}/v1/tails/{tail}/uploads", service.url);
        let answer = tests::http().post(url).json(body).send().await.unwrap();
        assert!(answer.status().is_success(), "{}: {}", answer.status(), answer.text().await.unwrap());
    }
}

fn url(database: &Path) -> String {
    format!("sqlite:{}", database.display())
}

/// All in random order, three in ten of them twice.
fn shuffled(uploads: &[(&'static str, Value)], seed: u64) -> Vec<(&'static str, Value)> {
    let mut stream = Stream::new(seed, &["shuffle"]);
    let copies = uploads.iter().flat_map(|upload| vec![upload.clone(); if stream.uniform() < 0.3 { 2 } else { 1 }]);
    let mut arrivals: Vec<_> = copies.collect();
    stream.shuffle(&mut arrivals);
    arrivals
}

#[tokio::test]
async fn slow_any_order_with_duplicates_and_kills_gives_the_same_digest() {
    let folder = tempfile::tempdir().unwrap();
    let in_order = folder.path().join("in_order.sqlite");
    let service = Service::start(&in_order, 0);
    let all = uploads(&service).await;
    send(&service, &all).await;
    let fleet = service.settled_fleet().await;
    let aside = items(service.get("/v1/uploads?state=set_aside").await);
    service.kill();
    assert_eq!(fleet.len(), 2, "the moved component left its first tail: {fleet:?}");
    assert_eq!(aside.len(), 1, "{aside:?}");
    assert_eq!((&aside[0]["upload_id"], &aside[0]["reason"]), (&json!("staying.40"), &json!("implausible_hours")));
    let expected = digest(&url(&in_order));

    for seed in [1, 2] {
        let database = folder.path().join(format!("shuffled{seed}.sqlite"));
        let disturbed = shuffled(&all, seed);
        let service = Service::start(&database, 0);
        send(&service, &disturbed[..disturbed.len() / 2]).await;
        service.kill();
        let service = Service::start(&database, 0);
        send(&service, &disturbed[disturbed.len() / 3..]).await;
        service.settled_fleet().await;
        service.kill();
        assert_eq!(digest(&url(&database)), expected, "seed {seed}");
    }
}
