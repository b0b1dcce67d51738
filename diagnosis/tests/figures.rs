//! Figures on the large data sets, where they are.

use std::path::{Path, PathBuf};

use diagnosis::{
    LoadInput, MapKind, TrainingMap, TrainingSet, TrainingSettings, Validation, ValidationSettings, train, validate,
};
use domain::{FaultModel, FaultVector, Mask, Stream};
use reduction::{MaskDesign, ModeCount, PodBasis};

const K_NOM: f64 = 0.0752;

/// The folder of the large sets, or nothing with a word on standard output.
fn data() -> Option<PathBuf> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("ACTUARY_DATA").map_or(shared, PathBuf::from).join("ema");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no data");
    None
}

fn rows(path: &Path, header: bool) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().skip(usize::from(header));
    lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect()
}

/// A dataset folder; without load ratios per point the mean serves for all.
fn maps(folder: &Path) -> Vec<TrainingMap> {
    let mean: Vec<f64> = rows(&folder.join("r.csv"), true).into_iter().map(|row| row[0]).collect();
    let y = rows(&folder.join("Y.csv"), false);
    let per_point = folder.join("R.csv");
    let r = if per_point.exists() { rows(&per_point, false) } else { mean.iter().map(|r| vec![*r; 360]).collect() };
    let faults = rows(&folder.join("K.csv"), true);
    let parts = y.into_iter().zip(r).zip(mean).zip(faults);
    parts
        .map(|(((y, r), mean_r), faults)| TrainingMap {
            y: y.into_iter().map(|y| y / K_NOM).collect(),
            r,
            mean_r,
            faults: FaultVector(faults),
        })
        .collect()
}

fn report(name: &str, v: &Validation) {
    let percent: Vec<String> = v.coverage_90.iter().map(|c| format!("{:.1}", 100.0 * c)).collect();
    println!(
        "{name:42} {:.3}/{:.3}/{:.3} %  90 % holds {percent:?} implausible {:.1} %",
        100.0 * v.median,
        100.0 * v.mean,
        100.0 * v.p95,
        100.0 * v.implausible
    );
}

#[test]
fn explore() {
    let Some(folder) = data() else { return };
    let train_maps = maps(&folder.join("train_pair"));
    let (train_maps, rest) = train_maps.split_at(850);
    {
        let (mut a, mut b) = (0.0, 0.0);
        for map in train_maps {
            let m = map.r.iter().sum::<f64>() / 360.0;
            a += (m - map.mean_r) / 850.0;
            b += (m - map.mean_r).powi(2) / 850.0;
        }
        println!("mean R - r {a} rms {}", f64::sqrt(b));
    }
    let train_hf = maps(&folder.join("train_hf"));
    let model = FaultModel::electrical();
    let invariant: Vec<Vec<f64>> = train_maps.iter().map(TrainingMap::load_invariant).collect();
    let clock = std::time::Instant::now();
    let basis = PodBasis::train(&invariant, ModeCount::Fixed(9)).unwrap();
    println!("pod {:?} {:?}", clock.elapsed(), basis.prior_variance());
    let stream = Stream::new(1, &["figures"]);
    let env = |name: &str, default: usize| std::env::var(name).map_or(default, |v| v.parse().unwrap());
    let design = MaskDesign { points: 30, exclusion_bins: env("EXCL", 12) };
    let masks = [("d-optimal", design.d_optimal(&basis).unwrap()), ("uniform", design.uniform(360).unwrap())];
    let modes = env("MODES", 9);
    for (name, mask) in &masks[..env("MASKS", 1)] {
        println!("{name} {:?}", mask.bins());
        for kind in [MapKind::LoadInvariant, MapKind::Raw] {
            let mut settings = TrainingSettings::new(kind);
            settings.modes = ModeCount::Fixed(modes);
            settings.realisations = env("REAL", 6);
            settings.restarts = env("RESTARTS", 2);
            settings.steps = env("STEPS", 60);
            settings.hidden = env("HIDDEN", 14);
            let set = TrainingSet { fault_model: &model, mask, maps: train_maps, calibration: &[] };
            let clock = std::time::Instant::now();
            let diagnoser = train(&set, &settings, &stream).unwrap();
            println!("{kind:?} trained in {:?}, floor {:.5}", clock.elapsed(), diagnoser.reader.floor);
            println!("law {:?}", diagnoser.error_law.weights);
            let loads = match kind {
                MapKind::LoadInvariant => vec![LoadInput::PerSample, LoadInput::Mean],
                MapKind::Raw => vec![LoadInput::None],
            };
            for load in loads {
                let run = |name: &str, maps: &[TrainingMap], noise| {
                    let settings = ValidationSettings { load, noise, repeats: 10 };
                    let v = validate(&diagnoser, mask, maps, &settings, &stream).unwrap();
                    report(&format!("{name} {load:?} {noise}"), &v);
                };
                run("train_hf", &train_hf, 1e-9);
                run("train_hf", &train_hf, 0.01);
                run("train_pair rest", rest, 0.01);
                run("train_pair rest", rest, 0.03);
                if env("VAL", 0) == 0 {
                    continue;
                }
                for set in ["val_hf", "val_hf_op"] {
                    let maps = maps(&folder.join(set));
                    run(set, &maps, 1e-9);
                    run(set, &maps, 0.01);
                    run(set, &maps, 0.05);
                }
            }
        }
    }
}
