//! Durable uploads per second against the number of concurrent callers.
//!
//! `cargo run -p store --example accept_throughput [FOLDER | URL]`: FOLDER decides which disk is measured by SQLite; URL
//! is that of an empty Postgres database that is migrated, as the role that serves.

use std::time::Instant;

use domain::{
    Actor, BundleSummary, ContentHash, Coordinate, FaultModel, LoadRatio, MapSamples, Mask, OperatorId, Reading,
    Timestamp, Upload,
};
use store::{Options, Store};
use tokio::task::JoinSet;

const UPLOADS: usize = 8000;
const COMPONENTS: usize = 500;

fn mask() -> Mask {
    Mask::new(Coordinate::ElectricalAngleRad, 360, (0..360).step_by(18).collect()).expect("distinct bins")
}

/// About 1 kB of JSON.
fn upload(round: usize, number: usize) -> Upload {
    let unit = number % COMPONENTS;
    let sample = |i: usize| Some(0.0752 + 1e-3 * ((number + i) as f64).sin());
    Upload {
        tail: format!("T{:03}", unit / 5).parse().expect("a tail"),
        upload_id: format!("round-{round}-upload-{number}").parse().expect("an id"),
        position: format!("P{}", unit % 5).parse().expect("a position"),
        part_number: "EMA-500".parse().expect("a part"),
        serial_number: format!("{unit:05}").parse().expect("a serial"),
        flight_hours: (round * UPLOADS + number) as f64 / COMPONENTS as f64,
        flight_cycles: None,
        recorded_at: Timestamp::from_micros(1_772_366_400_000_000 + (round * UPLOADS + number) as i64 * 1_000_000),
        reading: Reading::Samples(MapSamples {
            mask_id: mask().id(),
            samples: (0..20).map(sample).collect(),
            load_ratio: Some(LoadRatio::PerSample((0..20).map(sample).collect())),
            sample_noise: Some(0.01),
        }),
        strain: None,
        air_data: None,
        temperature_c: Some(15.0),
        winding_temperature_c: None,
        on_ground: Some(true),
    }
}

async fn opened(place: &str) -> Result<Store, store::StoreError> {
    let file = format!("sqlite:{place}/throughput.db");
    let url = if place.contains("://") { place } else { &file };
    let store = Store::open(url, Options::default()).await?;
    let (body, now) = (b"bundle", Timestamp::from_micros(1_772_366_400_000_000));
    let (hash, faults, masks) = (ContentHash::of(body), FaultModel::electrical(), vec![mask()]);
    let bundle = BundleSummary { hash, prior: hash, faults, masks, k_nom: 0.0752, min_samples: 8, measure: None };
    store.register_bundle(&bundle, body, Actor::Cli.at(now)).await?;
    store.activate_bundle(&hash, Actor::Cli.at(now)).await?;
    Ok(store)
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let temporary = tempfile::tempdir()?;
    let place = std::env::args().nth(1).unwrap_or_else(|| temporary.path().display().to_string());
    let store = opened(&place).await?;
    for (round, (callers, uploads)) in [(1, UPLOADS / 8), (32, UPLOADS), (128, UPLOADS)].into_iter().enumerate() {
        let begin = Instant::now();
        let mut tasks = JoinSet::new();
        for caller in 0..callers {
            let store = store.clone();
            tasks.spawn(async move {
                for number in (caller..uploads).step_by(callers) {
                    let upload = upload(round, number);
                    let received_at = upload.recorded_at;
                    store.accept(&OperatorId::default(), upload, received_at).await.expect("accepted");
                }
            });
        }
        tasks.join_all().await;
        println!("{callers:>4} callers: {:>7.0} uploads/s", uploads as f64 / begin.elapsed().as_secs_f64());
    }
    store.close().await;
    Ok(())
}
