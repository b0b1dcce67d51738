//! Bundles with one thing changed, as a slip of the hand or of a program changes it: each is refused, or answers as the original.

use domain::{
    Ahead, Component, Diagnosis, Estimate, FaultVector, Life, LoadRatio, NUMERICS_VERSION, Outcome, Timestamp,
};
use ema::{closed_form, faults::ElectricalFaults};
use numerics::Stream;
use pipeline::{LifeContext, Measurement, Model};
use serde_json::{Value, json};

fn default() -> Value {
    serde_json::from_slice(include_bytes!("../../../models/default.json")).unwrap()
}

/// Why a bundle is refused, or the model.
fn judge(bundle: &Value) -> Result<Model, String> {
    let bytes = serde_json::to_vec(bundle).unwrap();
    std::panic::catch_unwind(|| {
        let model = Model::from_bytes(&bytes).map_err(|error| error.to_string())?;
        model.rehearse().map_err(|error| error.to_string())?;
        Ok(model)
    })
    .unwrap_or_else(|_| Err("a calculation ended abnormally".to_owned()))
}

/// What a model says of units that no rehearsal knows: faults and their sigmas, then hours and probabilities.
#[derive(Debug)]
struct Answers {
    faults: Vec<f64>,
    sigmas: Vec<f64>,
    medians_fh: Vec<f64>,
    failed: Vec<f64>,
}

impl Answers {
    fn of(model: &Model) -> Self {
        let mut answers = Self { faults: Vec::new(), sigmas: Vec::new(), medians_fh: Vec::new(), failed: Vec::new() };
        for (faults, r) in [
            ([0.0, 0.0, 0.0, 0.5, 0.5], 0.15),
            ([0.13, 0.02, 0.05, 0.56, 0.47], 0.05),
            ([0.02, 0.0, 0.3, 0.42, 0.5], 0.1),
        ] {
            answers.diagnose(model, &faults, r);
        }
        // Without a fault, with an eccentricity, with a short of the second phase near its end.
        answers.foresee(model, 60, |_| [0.0; 5]);
        answers.foresee(model, 160, |t_fh| [0.0, 0.0, 0.0, 0.05 * libm::exp(9e-4 * t_fh), 0.0]);
        answers.foresee(model, 240, |t_fh| [0.0, 0.03 * libm::exp(8e-4 * t_fh), 0.0, 0.0, 0.0]);
        answers
    }

    fn diagnose(&mut self, model: &Model, faults: &[f64; 5], r: f64) {
        let mut stream = Stream::new(7, &["mutants"]);
        let electrical = ElectricalFaults::try_from(&FaultVector(faults.to_vec())).unwrap();
        let mask = &model.bundle().masks()[0];
        let mut sample = |&bin: &usize| Some(closed_form::back_emf(&electrical, bin, r) + 0.005 * stream.normal());
        let samples: Vec<_> = mask.bins().iter().map(&mut sample).collect();
        for load_ratio in [None, Some(LoadRatio::Mean(r)), Some(LoadRatio::PerSample(vec![Some(r); mask.len()]))] {
            let measurement = Measurement { samples: &samples, load_ratio: load_ratio.as_ref(), noise: Some(0.005) };
            let Ok(Outcome::Diagnosed(found)) = model.diagnose(&measurement, mask) else { continue };
            self.faults.extend(found.fault_vector.values());
            self.sigmas.extend(&found.sigma);
        }
    }

    fn foresee(&mut self, model: &Model, uploads: u32, deviation: impl Fn(f64) -> [f64; 5]) {
        let mut stream = Stream::new(8, &["mutants"]);
        let mut estimate = |i: u32| {
            let flight_hours = 5.0 * f64::from(i + 1);
            let noisy = |(i, x): (usize, f64)| {
                let [nominal, sigma] = if i < 3 { [0.0, 0.0075] } else { [0.5, 0.02] };
                (nominal + x + sigma * stream.normal()).clamp(0.0, 1.0)
            };
            Estimate {
                upload_id: format!("u{i:05}").parse().unwrap(),
                flight_hours,
                recorded_at: Timestamp::from_micros(0).plus_hours(3.0 * flight_hours),
                mask_id: Some(model.bundle().masks()[0].id()),
                model: model.summary().hash,
                numerics_version: NUMERICS_VERSION,
                measurement: None,
                outcome: Outcome::Diagnosed(Diagnosis {
                    fault_vector: FaultVector(deviation(flight_hours).into_iter().enumerate().map(noisy).collect()),
                    sigma: vec![0.0075, 0.0075, 0.0075, 0.02, 0.02],
                    fit: None,
                }),
                load: None,
                temperature: None,
                load_ratio: None,
                on_ground: false,
            }
        };
        let history: Vec<Estimate> = (0..uploads).map(&mut estimate).collect();
        let component = Component {
            operator: "default".parse().unwrap(),
            part_number: "EMA-48V".parse().unwrap(),
            serial_number: "0001".parse().unwrap(),
        };
        let life = Life { component, overhaul_index: 0 };
        let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
        let outlook =
            model.outlook(&context, &model.course(&context, &history), &[], None, false, &Ahead::default()).unwrap();
        let forecast = outlook.prognosis.unwrap().forecast.unwrap();
        self.medians_fh.push(forecast.rul.quantile_fh(0.5).unwrap_or(10_000.0));
        self.failed.push(forecast.probability_failed);
    }

    /// What is beyond sense beside the answers of the original.
    fn beyond_sense(&self, original: &Self) -> Option<String> {
        if self.faults.len() != original.faults.len() {
            return Some("maps are not diagnosed".to_owned());
        }
        let pairs = |mine: &[f64], other: &[f64]| mine.iter().copied().zip(other.iter().copied()).collect::<Vec<_>>();
        let off = pairs(&self.faults, &original.faults).into_iter().find(|(a, b)| (a - b).abs() > 0.08);
        let vague = pairs(&self.sigmas, &original.sigmas).into_iter().find(|(a, b)| *a > 5.0 * b || *a < 0.2 * b);
        let late =
            pairs(&self.medians_fh, &original.medians_fh).into_iter().find(|(a, b)| *a > 3.0 * b || *a < b / 3.0);
        let wrong = pairs(&self.failed, &original.failed).into_iter().find(|(a, b)| (a - b).abs() > 0.4);
        let told = [("fault", off), ("sigma", vague), ("median", late), ("P(failed)", wrong)];
        told.into_iter().find_map(|(what, pair)| pair.map(|(mine, other)| format!("{what} {mine} for {other}")))
    }
}

/// Pointers to numbers and to arrays of numbers, which change as one, and to the first number of each.
fn places(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(path.to_owned()),
        Value::Array(items) if items.iter().any(holds_numbers) => {
            found.push(path.to_owned());
            places(&items[0], &format!("{path}/0"), found);
        }
        Value::Array(items) => {
            items.iter().enumerate().take(2).for_each(|(i, item)| places(item, &format!("{path}/{i}"), found))
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(name, field)| places(field, &format!("{path}/{name}"), found))
        }
        _ => {}
    }
}

fn holds_numbers(value: &Value) -> bool {
    match value {
        Value::Array(items) => items.iter().any(holds_numbers),
        other => other.is_number(),
    }
}

/// Changes every number of a value.
fn change(value: &mut Value, by: &dyn Fn(f64) -> f64) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| change(item, by)),
        Value::Number(number) => {
            let changed = by(number.as_f64().unwrap());
            let whole = number.is_u64() && changed >= 0.0 && changed.fract() == 0.0;
            *value = if whole { json!(changed as u64) } else { json!(changed) };
        }
        _ => {}
    }
}

type Slip = (&'static str, fn(&mut Value));

const SLIPS: [Slip; 6] = [
    ("negated", |value| change(value, &|x| -x)),
    ("times 1000", |value| change(value, &|x| 1e3 * x)),
    ("by 1000", |value| change(value, &|x| 1e-3 * x)),
    ("zero", |value| change(value, &|_| 0.0)),
    ("no number", |value| *value = Value::Null),
    ("cut", |value| {
        if let Some(items) = value.as_array_mut() {
            items.pop();
        }
    }),
];

/// Judges every n-th slip, from the `first`; those that are taken though their answers are beyond sense.
fn taken(first: usize, every: usize) -> Vec<String> {
    std::panic::set_hook(Box::new(|_| {}));
    let original = default();
    let answers = Answers::of(&judge(&original).unwrap());
    let mut paths = Vec::new();
    // Neither how it was made nor how good it was decides what it answers.
    for part in ["faults", "motor", "masks", "with_load_ratio", "without_load_ratio", "surrogate", "loads", "prior"] {
        places(&original[part], &format!("/{part}"), &mut paths);
    }
    let slips = paths.iter().flat_map(|path| SLIPS.iter().map(move |slip| (path, slip)));
    let mut taken = Vec::new();
    for (path, (name, slip)) in slips.skip(first).step_by(every) {
        let mut mutant = original.clone();
        slip(mutant.pointer_mut(path).unwrap());
        if mutant == original {
            continue;
        }
        let Ok(model) = judge(&mutant) else { continue };
        if let Some(words) = Answers::of(&model).beyond_sense(&answers) {
            taken.push(format!("{path} {name}: {words}"));
        }
    }
    let _ = std::panic::take_hook();
    taken
}

/// One slip of `ACTUARY_SLIPS` is tried; 1 tries all, which takes many minutes.
#[test]
fn slow_no_bundle_with_a_slip_that_changes_answers_is_taken() {
    let every = std::env::var("ACTUARY_SLIPS").map_or(92, |every| every.parse().unwrap());
    assert_eq!(taken(3 % every, every), Vec::<String>::new());
}

#[test]
fn a_senseless_figure_is_named_by_its_path_and_value() {
    let refused = |path: &str, value: Value| {
        let mut bundle = default();
        *bundle.pointer_mut(path).unwrap() = value;
        judge(&bundle).unwrap_err()
    };
    for (path, value, words) in [
        ("/prior/process_noise", json!(-2.5e-4), "#/prior/process_noise: -0.00025 is outside"),
        ("/prior/growth_changes/probability", json!(1.5), "#/prior/growth_changes/probability: 1.5 is outside 0 to 1"),
        ("/prior/one_sided/rate_weights/0", json!(0.5), "#/prior/one_sided/rate_weights: 1.49"),
        ("/prior/rates_per_h/1", json!(1e-5), "#/prior/rates_per_h/1: 0.00001 is not more than the rate before"),
        ("/prior/consistency/scatter", Value::Null, "prior.consistency.scatter: invalid type: null"),
        ("/faults/names/1", json!("k1"), "faults"),
        (
            "/with_load_ratio/basis/modes/1",
            default()["with_load_ratio"]["basis"]["modes"][0].clone(),
            "#/with_load_ratio/basis/modes/1: its product with mode 0 is",
        ),
        (
            "/with_load_ratio/error_law/weights/0/1",
            json!(-0.1),
            "#/with_load_ratio/error_law/weights/0/1: -0.1 is outside",
        ),
        ("/loads/envelope/covariance/0/0", json!(-1.0), "covariance/0/0: -1 does not fit a covariance"),
        ("/motor/R", json!(-2.0), "#/motor/R: -2 is not a positive number"),
    ] {
        let said = refused(path, value);
        assert!(said.contains(words), "{path}: {said}");
    }
    let groups = |bundle: &mut Value, value: Value| {
        for part in ["/faults", "/with_load_ratio/fault_model", "/without_load_ratio/fault_model"] {
            bundle.pointer_mut(part).unwrap()["groups"] = value.clone();
        }
        judge(bundle).unwrap_err()
    };
    assert!(groups(&mut default(), json!([])).contains("#/faults/groups: fault 0 is in 0 groups"));
    let twice = json!([{"kind": "one_sided", "index": 0}, {"kind": "one_sided", "index": 0}]);
    assert!(groups(&mut default(), twice).contains("#/faults/groups: fault 0 is in 2 groups"));
    let mut swapped = default();
    let with = swapped["with_load_ratio"].take();
    swapped["with_load_ratio"] = swapped["without_load_ratio"].take();
    swapped["without_load_ratio"] = with;
    judge(&swapped).unwrap_err();
}
