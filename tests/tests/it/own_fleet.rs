//! A fleet with a health index of its own, from recorded lives to remaining lives over REST.
//!
//! What: half of 68 fatigue cracks teach a bundle, the other half are flown through a service with that bundle, and what it answers is
//! scored beside the backtest of the same lives and beside climatology.
//! Not covered: several faults, removals, gRPC.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use domain::Timestamp;
use serde_json::{Value, json};
use tests::Service;

const LIMIT_MM: f64 = 49.8;
/// A fleet that flies a hundred load cycles an hour.
const CYCLES_PER_H: f64 = 100.0;
/// Flight hours between forecasts that are judged.
const EVERY_FH: f64 = 250.0;
/// Levels of the quantiles that a service answers with, and of as many columns of predictions.
const LEVELS: [(f64, &str); 7] =
    [(0.05, "q05"), (0.1, "q10"), (0.25, "q25"), (0.5, "q50"), (0.75, "q75"), (0.9, "q90"), (0.95, "q95")];

/// Flight hours and lengths, mm, of a crack.
type Crack = Vec<(f64, f64)>;

/// The cracks of the fixture, by specimen.
fn cracks() -> BTreeMap<u32, Crack> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real/virkler.csv");
    let mut cracks: BTreeMap<u32, Crack> = BTreeMap::new();
    for line in fs::read_to_string(file).unwrap().lines().skip(1) {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        cracks.entry(fields[0] as u32).or_default().push((fields[1] / CYCLES_PER_H, fields[2]));
    }
    cracks
}

/// When a crack passes the limit.
fn end_fh(crack: &Crack) -> f64 {
    let pair = crack.windows(2).find(|pair| pair[1].1 >= LIMIT_MM).expect("every specimen fails");
    let ((t0, a0), (t1, a1)) = (pair[0], pair[1]);
    t0 + (LIMIT_MM - a0) / (a1 - a0) * (t1 - t0)
}

fn table(cracks: &BTreeMap<u32, Crack>) -> String {
    let rows =
        cracks.iter().flat_map(|(specimen, crack)| crack.iter().map(move |(t, a)| format!("{specimen},{t},{a}\n")));
    format!("specimen,hours,crack_mm\n{}", rows.collect::<String>())
}

fn actuary(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(tests::binary()).args(arguments).current_dir(folder).output().expect("the binary starts")
}

fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = actuary(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The one line in which a command refuses, and writes nothing.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = actuary(folder, arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
    let below: Vec<_> = errors.lines().skip(1).collect();
    assert!(below.iter().all(|line| line.starts_with("Usage:")), "{arguments:?}: {errors}");
    assert!(!folder.join("refused.json").exists(), "nothing half-written");
    errors
}

/// The mean quantile score of a forecast of the hours at which life ends: half its continuous ranked probability score or so.
fn score(quantiles: &[f64], end: f64) -> f64 {
    let pinball =
        |((level, _), q): (&(f64, &str), &f64)| if end < *q { (1.0 - level) * (q - end) } else { level * (end - q) };
    2.0 * LEVELS.iter().zip(quantiles).map(pinball).sum::<f64>() / LEVELS.len() as f64
}

/// Mean scores of an estimator of a backtest over specimens and times; the quantiles are of remaining lives.
fn backtested(predictions: &str, estimator: &str, ends: &BTreeMap<u32, f64>) -> BTreeMap<(u32, u32), f64> {
    let mut lines = predictions.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name}"));
    let scored = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let (specimen, t) = (fields[place("unit")].parse::<u32>().unwrap(), fields[place("t")].parse::<f64>().unwrap());
        let quantiles = LEVELS.map(|(_, name)| fields[place(name)].parse::<f64>().map_or(f64::NAN, |left| t + left));
        ((specimen, (t / EVERY_FH).round() as u32), score(&quantiles, ends[&specimen]))
    };
    lines.filter(|line| line.split(',').next() == Some(estimator)).map(scored).collect()
}

/// A service whose lives are judged by a bundle.
fn serve(folder: &Path, bundle: &str) -> Service {
    Service::start(&folder.join("fleet.sqlite"), 0).kill();
    let database = ["--database-url", "sqlite:fleet.sqlite"];
    let added = said(folder, &[&["model", "add", bundle][..], &database].concat());
    let hash = added.split_whitespace().next().unwrap().to_owned();
    said(folder, &[&["model", "activate", &hash][..], &database].concat());
    Service::start(&folder.join("fleet.sqlite"), 0)
}

/// Uploads rows of a crack, the first of them being the `first`-th.
async fn fly(service: &Service, specimen: u32, crack: &[(f64, f64)], first: usize) {
    let line = |(index, (hours, length)): (usize, &(f64, f64))| {
        let recorded_at = Timestamp::from_micros(1_600_000_000_000_000).plus_hours(3.0 * hours).to_string();
        json!({
            "upload_id": format!("{specimen}.{}", first + index), "position": "FLAP-L", "part_number": "PANEL",
            "serial_number": specimen.to_string(), "flight_hours": hours, "recorded_at": recorded_at,
            "faults": {"crack_mm": {"value": length}},
        })
        .to_string()
    };
    let lines: Vec<String> = crack.iter().enumerate().map(line).collect();
    if lines.is_empty() {
        return;
    }
    let url = format!("{}/v1/tails/T-{specimen}/uploads", service.url);
    let request = tests::http().post(url).header("content-type", "application/x-ndjson").body(lines.join("\n"));
    let answer = request.send().await.unwrap().text().await.unwrap();
    assert_eq!(answer.matches(r#""status":"accepted""#).count(), lines.len(), "{answer}");
}

/// Scores of what the service answers for every crack at every multiple of the time between forecasts.
async fn served(
    service: &Service,
    cracks: &BTreeMap<u32, Crack>,
    ends: &BTreeMap<u32, f64>,
) -> BTreeMap<(u32, u32), f64> {
    let mut scores = BTreeMap::new();
    let longest = ends.values().fold(0.0, |a: f64, b| a.max(*b));
    for step in 1..=(longest / EVERY_FH) as u32 {
        let now_fh = EVERY_FH * f64::from(step);
        let going_on = || cracks.iter().filter(|(specimen, _)| ends[specimen] > now_fh);
        for (specimen, crack) in going_on() {
            let until = |fh: f64| crack.partition_point(|(t, _)| *t <= fh);
            let (sent, upto) = (until(now_fh - EVERY_FH), until(now_fh));
            let sent = if step == 1 { 0 } else { sent };
            fly(service, *specimen, &crack[sent..upto], sent).await;
        }
        let fleet = service.settled_fleet().await;
        for (specimen, crack) in going_on() {
            let serial = specimen.to_string();
            let rul = fleet.iter().find(|rul| rul["serial_number"] == *serial).expect("it was uploaded");
            let as_of_fh = rul["as_of"]["flight_hours"].as_f64().unwrap();
            assert_eq!(as_of_fh, crack[crack.partition_point(|(t, _)| *t <= now_fh) - 1].0);
            scores.insert((*specimen, step), score(&quantiles(rul, as_of_fh), ends[specimen]));
        }
    }
    scores
}

/// Quantiles of the hours at which life ends.
fn quantiles(rul: &Value, as_of_fh: f64) -> Vec<f64> {
    let told =
        |(level, _): &(f64, &str)| rul["rul_fh"][format!("p{:02}", 100.0 * level)].as_f64().map(|left| as_of_fh + left);
    LEVELS.iter().map(|level| told(level).unwrap_or_else(|| panic!("{rul}"))).collect()
}

#[tokio::test]
async fn slow_half_of_the_cracks_teach_a_bundle_by_which_a_service_forecasts_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (teach, fly): (BTreeMap<_, _>, BTreeMap<_, _>) =
        cracks().into_iter().partition(|(specimen, _)| specimen % 2 == 1);
    fs::write(folder.join("teach.csv"), table(&teach)).unwrap();
    fs::write(folder.join("fly.csv"), table(&fly)).unwrap();
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/default.json").display().to_string();
    let limit = format!("crack_mm={LIMIT_MM}");
    let train = ["train", "--histories", "teach.csv", "--limit", &limit, "--model", &base, "--out", "cracks.json"];
    let printed = said(folder, &train);
    assert!(printed.contains("34 lives taught, 34 of them failed") && printed.contains("weights: growth"), "{printed}");
    let every = EVERY_FH.to_string();
    let backtest = ["backtest", "--prior", "teach.csv", "--histories", "fly.csv", "--limit", &limit, "--every", &every];
    let chosen = ["--estimator", "mixture", "--estimator", "climatology", "--out", "bench"];
    said(folder, &[&backtest[..], &chosen].concat());
    let predictions = fs::read_to_string(folder.join("bench/predictions.csv")).unwrap();

    let ends: BTreeMap<u32, f64> = fly.iter().map(|(specimen, crack)| (*specimen, end_fh(crack))).collect();
    let service = serve(folder, "cracks.json");
    let served = served(&service, &fly, &ends).await;
    let [mixture, climatology] = ["mixture", "climatology"].map(|name| backtested(&predictions, name, &ends));
    let mean = |scores: &BTreeMap<(u32, u32), f64>| {
        let common = served.keys().filter_map(|key| scores.get(key));
        common.clone().sum::<f64>() / common.count() as f64
    };
    let [served_fh, mixture_fh, climatology_fh] = [&served, &mixture, &climatology].map(mean);
    println!(
        "{} forecasts: served {served_fh:.2}, mixture {mixture_fh:.2}, climatology {climatology_fh:.2} h",
        served.len()
    );
    assert!(served.len() > 250 && served.keys().all(|key| mixture.contains_key(key)), "{}", served.len());
    assert!((served_fh / mixture_fh - 1.0).abs() < 0.05, "served {served_fh}, by backtest {mixture_fh}");
    assert!(served_fh < 0.8 * climatology_fh, "served {served_fh}, climatology {climatology_fh}");
}

#[test]
fn lives_that_teach_no_bundle_are_refused_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let few: BTreeMap<_, _> = cracks().into_iter().take(4).collect();
    fs::write(folder.join("hours.csv"), table(&few)).unwrap();
    fs::write(folder.join("cycles.csv"), table(&few).replace("hours", "cycles")).unwrap();
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/default.json").display().to_string();
    let says = |words: &str, histories: &str, arguments: &[&str]| {
        let command = ["train", "--out", "refused.json", "--histories", histories];
        let line = refused(folder, &[&command[..], arguments].concat());
        assert!(line.contains(words), "{line} should say {words}");
    };
    let limit = ["--limit", "crack_mm=49.8"];
    let with = |more: &[&'static str]| [&limit[..], &["--model", base.as_str()], more].concat();
    says("times are counted in cycles, a service counts flight hours", "cycles.csv", &with(&[]));
    says(
        "--nominal crack_mm=first:N gives each unit a nominal value",
        "hours.csv",
        &with(&["--nominal", "crack_mm=first:3"]),
    );
    says("nothing can be learned of failure", "hours.csv", &["--limit", "crack_mm=60", "--model", &base]);
    says("column length of --limit is missing", "hours.csv", &["--limit", "length=60", "--model", &base]);
    says("the limit lies on the healthy side", "hours.csv", &["--limit", "crack_mm=5", "--model", &base]);
    says("hours.csv: not a model bundle", "hours.csv", &["--limit", "crack_mm=49.8", "--model", "hours.csv"]);
    says("--model <FILE>", "hours.csv", &limit);
    says("'--seed <SEED>'", "hours.csv", &with(&["--seed", "3"]));
    says("'--truth <FILE>...'", "hours.csv", &with(&["--truth", "hours.csv"]));
    says("--sigma is for lives with --limit", "hours.csv", &["--model", &base, "--sigma", "crack_mm=1"]);
    says("hours.csv: column run_id is missing", "hours.csv", &["--model", &base]);
    let without = refused(folder, &["train", "--out", "refused.json", "--limit", "crack_mm=49.8"]);
    assert!(without.contains("--limit is for lives of --histories"), "{without}");
}
