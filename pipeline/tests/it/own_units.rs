//! Forecasts of faults of an own diagnosis, in whatever units a fleet counts.

use std::sync::OnceLock;

use domain::{
    Ahead, Component, Diagnosis, Estimate, FaultMeasure, FaultModel, FaultVector, Life, NUMERICS_VERSION, Outcome,
    State, Timestamp,
};
use numerics::Stream;
use pipeline::{Assessment, Bundle, LifeContext, Model, Outlook, PastLife};
use prognosis::{EndedLife, Ending, Lesson, Observation, REFERENCE_LIMIT, scale::reference_faults};
use serde_json::{Value, json};

use crate::own_faults::cracks;

/// What twelve straight lives of about 5,000 reference hours teach.
fn lesson() -> &'static Lesson {
    static LESSON: OnceLock<Lesson> = OnceLock::new();
    LESSON.get_or_init(|| {
        let mut stream = Stream::new(3, &["own faults"]);
        let mut life = |index: u32| {
            let end_fh = 5000.0 * (0.7 + 0.05 * f64::from(index));
            let seen = |step: u32| {
                let t_fh = end_fh * f64::from(step) / 50.0;
                let deviation = REFERENCE_LIMIT * t_fh / end_fh + SIGMA * stream.normal();
                let fault_vector = FaultVector(vec![deviation]);
                Observation { t_fh, fault_vector, sigma: vec![SIGMA], load: None, temperature: None }
            };
            EndedLife { observations: (0..50).map(seen).collect(), flights: Vec::new(), end_fh, ending: Ending::Failed }
        };
        let lives: Vec<EndedLife> = (0..12).map(&mut life).collect();
        Lesson::learn(&lives, &reference_faults(vec!["wear".to_owned()]), 1).unwrap()
    })
}

/// Noise of one observation, reference deviations.
const SIGMA: f64 = 0.004;

/// A fleet that counts in units of its own.
struct Fleet {
    nominal: f64,
    limit: f64,
    life_fh: f64,
}

impl Fleet {
    fn model(&self) -> Model {
        let Self { nominal, limit, life_fh } = *self;
        let bundle = Bundle {
            faults: FaultModel { nominal: vec![nominal], ..cracks().faults },
            assessment: Assessment::Own(FaultMeasure {
                limits: vec![limit],
                sigma: vec![SIGMA / REFERENCE_LIMIT * (limit - nominal).abs()],
                characteristic_life_fh: life_fh,
            }),
            prior: lesson().clone().into(),
            ..cracks()
        };
        Model::from_bytes(&bundle.to_bytes()).unwrap()
    }

    /// States and forecast of a unit that has gone half its way in six tenths of a characteristic life.
    fn outlook(&self) -> Outlook {
        self.outlook_at(0.5)
    }

    /// The same of one that has gone such a share of its way.
    fn outlook_at(&self, way: f64) -> Outlook {
        let model = self.model();
        let mut stream = Stream::new(4, &["own faults"]);
        let history: Vec<Estimate> = (0..40)
            .map(|number| {
                let share = f64::from(number) / 40.0;
                let severity = way * share + SIGMA / REFERENCE_LIMIT * stream.normal();
                estimate(
                    &model,
                    number,
                    0.6 * share * self.life_fh,
                    self.nominal + severity * (self.limit - self.nominal),
                )
            })
            .collect();
        let component = Component {
            operator: "default".parse().unwrap(),
            part_number: "PANEL".parse().unwrap(),
            serial_number: "1".parse().unwrap(),
        };
        let life = Life { component, overhaul_index: 0 };
        let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
        model.outlook(&context, &model.course(&context, &history), &[], None, false, &Ahead::default()).unwrap()
    }
}

fn estimate(model: &Model, number: u32, flight_hours: f64, value: f64) -> Estimate {
    Estimate {
        upload_id: format!("u{number}").parse().unwrap(),
        flight_hours,
        recorded_at: Timestamp::from_micros(0).plus_hours(3.0 * flight_hours),
        mask_id: None,
        model: model.summary().hash,
        numerics_version: NUMERICS_VERSION,
        measurement: None,
        outcome: Outcome::Diagnosed(Diagnosis {
            fault_vector: FaultVector(vec![value]),
            sigma: model.bundle().measure().unwrap().sigma.clone(),
            fit: None,
        }),
        load: None,
        temperature: None,
        load_ratio: None,
        on_ground: false,
    }
}

#[test]
fn forecasts_scale_with_the_units_of_faults_and_of_hours_and_with_nothing_else() {
    // Cracks that grow from 9 to 49.8, and an index of health that falls from 82 to .4 in four times the hours.
    let growing = Fleet { nominal: 9.0, limit: 49.8, life_fh: 800.0 }.outlook();
    let falling = Fleet { nominal: 82.0, limit: 0.4, life_fh: 3200.0 }.outlook();
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-5 * (1.0 + b.abs()), "{a} {b}");
    let states = growing.states.iter().zip(&falling.states);
    assert!(growing.states.len() > 30 && growing.states.len() == falling.states.len());
    for (grown, fallen) in states {
        for (a, b) in grown.rul_quantiles_fh.iter().zip(fallen.rul_quantiles_fh) {
            a.iter().zip(b).for_each(|(a, b)| near(4.0 * a, b));
        }
        near(4.0 * grown.horizon_fh, fallen.horizon_fh);
        let (a, b) = (&grown.faults[0], &fallen.faults[0]);
        near(100.0 - 2.0 * a.value, b.value);
        near(2.0 * a.sigma, b.sigma);
        near(-0.5 * a.trend_per_1000_fh, b.trend_per_1000_fh);
        near(0.25 * grown.propagation.state_matrix[0][0], fallen.propagation.state_matrix[0][0]);
        near(-0.5 * grown.propagation.control_matrix[0][0], fallen.propagation.control_matrix[0][0]);
        let surprises = |state: &State| state.shift.as_ref().map(|shift| shift.surprises[0].clone());
        if let (Some(a), Some(b)) = (surprises(grown), surprises(fallen)) {
            near(100.0 - 2.0 * a.seen, b.seen);
            near(100.0 - 2.0 * a.expected, b.expected);
            near(-a.z, b.z);
        }
    }
    let [grown, fallen] = [growing, falling].map(|outlook| outlook.prognosis.unwrap().forecast.unwrap());
    let [a, b] = [&grown, &fallen].map(|forecast| forecast.rul.quantile_fh(0.5).unwrap());
    near(4.0 * a, b);
    near(4.0 * grown.median_error_fh.unwrap(), fallen.median_error_fh.unwrap());
    // Half of the way took .6 of a characteristic life of 800 h.
    assert!((300.0..650.0).contains(&a), "{a}");
    assert!((grown.faults[0].value - 29.0).abs() < 2.0, "{:?}", grown.faults);
}

#[test]
fn a_unit_beyond_its_limit_has_failed_however_late_past_lives_were_seen_to() {
    let fleet = Fleet { nominal: 82.0, limit: 0.4, life_fh: 800.0 };
    let failed = |share: f64| fleet.outlook_at(share).prognosis.unwrap().forecast.unwrap().probability_failed;
    assert!(failed(1.2) > 0.99 && failed(0.8) < 0.01, "{} {}", failed(1.2), failed(0.8));
}

#[test]
fn a_bundle_that_lives_have_taught_passes_its_rehearsal_and_one_that_forecasts_nonsense_does_not() {
    Fleet { nominal: 9.0, limit: 49.8, life_fh: 800.0 }.model().rehearse().unwrap();
    let mut bundle: Value =
        serde_json::from_slice(&Fleet { nominal: 9.0, limit: 49.8, life_fh: 800.0 }.model().bundle().to_bytes())
            .unwrap();
    bundle["prior"]["companions"]["stacked"]["weights"] = json!([0.9, 0.4, -0.3]);
    let model = Model::from_bytes(&serde_json::to_vec(&bundle).unwrap()).unwrap();
    let refused = model.rehearse().unwrap_err().to_string();
    assert!(refused.contains("#/prior/companions/stacked/weights"), "{refused}");
}

#[test]
fn lives_that_have_ended_teach_a_prior_in_units_of_its_own() {
    let fleet = Fleet { nominal: 9.0, limit: 49.8, life_fh: 800.0 };
    let model = fleet.model();
    let past = |index: u32| {
        let failure_fh = 640.0 + 40.0 * f64::from(index);
        let estimates = (0..40).map(|number| {
            let share = f64::from(number) / 40.0;
            estimate(&model, 100 * index + number, share * failure_fh, 9.0 + 40.8 * share)
        });
        PastLife { estimates: estimates.collect(), began_fh: 0.0, failure_fh: Some(failure_fh) }
    };
    let learned = model.learn_prior(&(0..8).map(past).collect::<Vec<_>>()).unwrap();
    assert_ne!(learned.hash, model.prior().hash);
    let error = learned.body.first().failure_time_error.unwrap();
    assert!(error.offset_fh.abs() < 500.0, "lives of 780 h end where the limit is crossed: {error:?}");
}
