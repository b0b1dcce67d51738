//! Compares chains of diagnosis on the same high-fidelity maps: error, conditioning, time.
//!
//! ```text
//! cargo run --release --example chains -p pipeline [FOLDER]
//! ```
//!
//! Prints the tables of docs/chains.md. FOLDER holds dataset folders `val_hf` and `val_hf_op`; without it, the
//! project's own maps alone are judged: as many under the acquisition's motion, as many under random command and load.

mod gauss_newton;

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::Mutex,
    time::Instant,
};

use diagnosis::{Diagnoser, LoadInput, MapKind, Measurement, TrainingMap, ValidationSettings, validate};
use domain::{FaultVector, LoadRatio, Mask};
use ema::{
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map},
};
use numerics::Stream;
use pipeline::{Bundle, ChainSettings, Lf1Form, MaskRule, Progress, TrainSettings, train};
use reduction::{ImportanceSampling, condition_number};

/// Maps of the project's own sets.
const OWN_MAPS: usize = 100;
/// Noise of a sample, units of k_nom.
const NOISES: [f64; 3] = [0.0, 0.01, 0.05];
/// Batches of diagnoses that are timed, of which the fastest counts, and diagnoses of a batch.
const TIMED: [usize; 2] = [50, 100];

type Anything<T> = Result<T, Box<dyn Error>>;

fn main() -> Anything<()> {
    let mut sets = vec![("own maps", own(false)), ("own maps, random command and load", own(true))];
    if let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) {
        for name in ["val_hf", "val_hf_op"] {
            sets.push((name, read(&folder.join(name))?));
        }
    }
    let mut rows: Vec<Row> = Vec::new();
    for (name, chain) in chains() {
        eprintln!("{name}");
        rows.extend(trained(name, chain, &sets)?);
    }
    rows.push(closed_form(&sets)?);
    for (i, (set, maps)) in sets.iter().enumerate() {
        println!("\n### {set}: {} maps\n", maps.len());
        println!("| chain | 0 % noise | 1 % | 5 % |\n|---|---|---|---|");
        for row in &rows {
            println!("| {} | {} |", row.name, row.errors[i].join(" | "));
        }
    }
    println!("\n| chain | cond(G) | training, s | one diagnosis, us |\n|---|---|---|---|");
    for row in &rows {
        println!("| {} | {} | {} | {:.1} |", row.name, row.condition, row.training_s, row.diagnosis_us);
    }
    Ok(())
}

/// The two named chains, and what each link does to them.
fn chains() -> Vec<(&'static str, ChainSettings)> {
    let (thesis, default) = (ChainSettings::thesis(), ChainSettings::default());
    vec![
        ("thesis", thesis),
        ("thesis, 6 modes", ChainSettings { modes: 6, ..thesis }),
        ("thesis, QR mask", ChainSettings { mask: MaskRule::Qr, ..thesis }),
        ("thesis, D-optimal mask", ChainSettings { mask: MaskRule::DOptimal, ..thesis }),
        ("thesis, pair form", ChainSettings { lf1: Lf1Form::Pair, ..thesis }),
        ("default, raw map", ChainSettings { map: MapKind::Raw, ..default }),
        ("default, thesis form", ChainSettings { lf1: Lf1Form::Thesis, ..default }),
        ("default", default),
    ]
}

/// What the tables say of one chain.
struct Row {
    name: String,
    /// For each set and noise: err_k median / mean / p95, %.
    errors: Vec<Vec<String>>,
    condition: String,
    training_s: String,
    diagnosis_us: f64,
}

/// Trains a chain and judges it at its mask, the default one at the uniform mask too.
fn trained(name: &str, chain: ChainSettings, sets: &[(&str, Vec<TrainingMap>)]) -> Anything<Vec<Row>> {
    let stages = Stages::default();
    // Few lives: the fleet has no part in a diagnosis.
    let settings = TrainSettings { motor: Motor::default(), samples: 1000, lives: 20, seed: 1, chain };
    let bundle = train(&settings, None, &stages)?;
    let training_s = format!("{:.0}", stages.until("lives of the fleet"));
    let row = |name: String, mask: &Mask| row(name, &bundle, mask, &training_s, sets);
    let mut rows = vec![row(name.to_owned(), &bundle.masks()[0])?];
    if chain == ChainSettings::default() {
        rows.push(row(format!("{name}, sampled at the uniform mask"), &bundle.masks()[1])?);
    }
    Ok(rows)
}

fn row(
    name: String,
    bundle: &Bundle,
    mask: &Mask,
    training_s: &str,
    sets: &[(&str, Vec<TrainingMap>)],
) -> Anything<Row> {
    let diagnoser = &bundle.maps().expect("trained on maps").with_load_ratio;
    let load = match diagnoser.reader.kind {
        MapKind::LoadInvariant => LoadInput::PerSample,
        MapKind::Raw => LoadInput::None,
    };
    let error = |maps: &[TrainingMap], noise: f64| -> Anything<String> {
        let settings = ValidationSettings { load, noise, repeats: repeats(noise) };
        let found = validate(diagnoser, mask, maps, &settings, &Stream::new(1, &["chains"]))?;
        Ok(percent(found.median, found.mean, found.p95))
    };
    let of_set = |(_, maps): &(&str, Vec<TrainingMap>)| NOISES.map(|noise| error(maps, noise)).into_iter().collect();
    Ok(Row {
        name,
        errors: sets.iter().map(of_set).collect::<Anything<_>>()?,
        condition: format!("{:.2}", condition_number(&diagnoser.basis, mask)?),
        training_s: training_s.to_owned(),
        diagnosis_us: diagnosis_us(diagnoser, mask, &sets[0].1)?,
    })
}

/// The Gauss-Newton fit at the uniform mask: it learns nothing, so no mask suits it better.
fn closed_form(sets: &[(&str, Vec<TrainingMap>)]) -> Anything<Row> {
    let mask = reduction::MaskDesign::default().uniform(sets[0].1[0].y.len())?;
    let samples = |map: &TrainingMap, noise: f64, stream: &mut Stream| -> Vec<gauss_newton::Sample> {
        let sample =
            |&bin: &usize| gauss_newton::Sample { bin, y: map.y[bin] + noise * stream.normal(), r: map.r[bin] };
        mask.bins().iter().map(sample).collect()
    };
    let error = |maps: &[TrainingMap], noise: f64| {
        let mut stream = Stream::new(1, &["chains", "closed form"]);
        let repeated = maps.iter().flat_map(|map| std::iter::repeat_n(map, repeats(noise)));
        let mut errors: Vec<f64> =
            repeated.map(|map| err_k(&gauss_newton::fit(&samples(map, noise, &mut stream)), &map.faults)).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let quantile = |q: f64| errors[(q * errors.len() as f64) as usize];
        percent(quantile(0.5), errors.iter().sum::<f64>() / errors.len() as f64, quantile(0.95))
    };
    let timed = samples(&sets[0].1[0], 0.01, &mut Stream::new(1, &["chains", "time"]));
    Ok(Row {
        name: "Gauss-Newton fit of the closed form".to_owned(),
        errors: sets.iter().map(|(_, maps)| NOISES.map(|noise| error(maps, noise)).to_vec()).collect(),
        condition: "-".to_owned(),
        training_s: "0".to_owned(),
        diagnosis_us: time_us(|| gauss_newton::fit(&timed)),
    })
}

/// Without noise every repeat would be the same.
fn repeats(noise: f64) -> usize {
    if noise > 0.0 { 20 } else { 1 }
}

fn err_k(found: &FaultVector, truth: &FaultVector) -> f64 {
    let squares = found.0.iter().zip(&truth.0).map(|(found, truth)| (found - truth) * (found - truth));
    (squares.sum::<f64>() / truth.0.len() as f64).sqrt()
}

fn percent(median: f64, mean: f64, p95: f64) -> String {
    let [median, mean, p95] = [median, mean, p95].map(|error| 100.0 * error);
    format!("{median:.2} / {mean:.2} / {p95:.2}")
}

/// Time of one diagnosis with its plausibility and uncertainty, microseconds.
fn diagnosis_us(diagnoser: &Diagnoser, mask: &Mask, maps: &[TrainingMap]) -> Anything<f64> {
    let gappy = diagnoser.on_mask(mask)?;
    let at_mask = |values: &[f64]| mask.bins().iter().map(|bin| Some(values[*bin])).collect::<Vec<_>>();
    let samples = at_mask(&maps[0].y);
    let load_ratio = LoadRatio::PerSample(at_mask(&maps[0].r));
    let measurement = Measurement { samples: &samples, load_ratio: Some(&load_ratio), noise: Some(0.01) };
    Ok(time_us(|| diagnoser.diagnose(&gappy, &measurement)))
}

/// Mean time of a run in the fastest batch, microseconds.
fn time_us<T>(run: impl Fn() -> T) -> f64 {
    let [batches, size] = TIMED;
    let batch = |_| {
        let start = Instant::now();
        (0..size).for_each(|_| drop(std::hint::black_box(run())));
        1e6 * start.elapsed().as_secs_f64() / size as f64
    };
    (0..batches).map(batch).fold(f64::INFINITY, f64::min)
}

/// High-fidelity maps of incipient faults that no training has seen.
fn own(operating: bool) -> Vec<TrainingMap> {
    let stream = Stream::new(1, &["chains", "own maps"]);
    let map = |(index, faults): (usize, FaultVector)| {
        let manoeuvre = match operating {
            true => Manoeuvre::operating(&mut stream.substream(index as u64)),
            false => Manoeuvre::acquisition(),
        };
        let electrical = ElectricalFaults::try_from(&faults).expect("importance samples are faults");
        let settings = Settings::new(Model::HighFidelity, 2.0);
        let map = simulate_map(Model::HighFidelity, &Motor::default(), &electrical, &manoeuvre, &settings);
        let whole = |values: &[Option<f64>]| values.iter().map(|v| v.expect("two seconds pass every bin")).collect();
        TrainingMap { y: whole(&map.y), r: whole(&map.r), mean_r: map.mean_r.expect("passes"), faults }
    };
    let faults = ImportanceSampling::INCIPIENT.draw(OWN_MAPS, &mut Stream::new(1, &["chains", "own faults"]));
    faults.into_iter().enumerate().map(map).collect()
}

/// The maps of a dataset folder with load ratios per point.
fn read(folder: &Path) -> Anything<Vec<TrainingMap>> {
    let table = |name: &str, header: usize| -> Anything<Vec<Vec<f64>>> {
        let text = std::fs::read_to_string(folder.join(name))?;
        let row = |line: &str| line.split(',').map(|x| Ok(x.parse()?)).collect();
        text.lines().skip(header).map(row).collect()
    };
    let (maps, ratios, means, faults) =
        (table("Y.csv", 0)?, table("R.csv", 0)?, table("r.csv", 1)?, table("K.csv", 1)?);
    let k_nom = Motor::default().back_emf_v_s_rad;
    let rows = maps.into_iter().zip(ratios).zip(means).zip(faults);
    let map = |(((y, r), mean), faults): (((Vec<f64>, _), Vec<f64>), _)| TrainingMap {
        y: y.into_iter().map(|y| y / k_nom).collect(),
        r,
        mean_r: mean[0],
        faults: FaultVector(faults),
    };
    Ok(rows.map(map).collect())
}

/// When the stages of a training began.
#[derive(Default)]
struct Stages(Mutex<Vec<(&'static str, Instant)>>);

impl Progress for Stages {
    fn stage(&self, name: &'static str, _: usize) {
        self.0.lock().expect("nobody panics").push((name, Instant::now()));
    }

    fn step(&self) {}
}

impl Stages {
    /// Seconds from the first stage to this one.
    fn until(&self, name: &str) -> f64 {
        let stages = self.0.lock().expect("nobody panics");
        let end = stages.iter().find(|stage| stage.0 == name).expect("a stage of training");
        end.1.duration_since(stages[0].1).as_secs_f64()
    }
}
