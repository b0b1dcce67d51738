//! Loads that act: outlooks of lives whose flights tell of load and temperature, by a bundle that knows what they do.

use domain::{
    Ahead, ContentHash, Diagnosis, Estimate, FaultVector, HingeLoad, Life, LoadSource, MapFit, NUMERICS_VERSION,
    Outcome, State, Timestamp,
    ahead::{LoadAhead, Stretch, TemperatureAhead},
    prognosis::Forecast,
};
use numerics::Stream;
use pipeline::{Bundle, LifeContext, Model, Outlook};
use prognosis::{Coefficient, LifePrior, PaceLaw};

/// The bundle that ships, told an exponent and a temperature coefficient.
fn model(pace: Option<[f64; 2]>) -> Model {
    let shipped = Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap();
    let Some(told) = pace else { return shipped };
    let [exponent, temperature] = told.map(|mean| Coefficient { mean, sd: 0.1 });
    let prior = LifePrior { pace: Some(PaceLaw::told(exponent, temperature)), ..shipped.bundle().prior.clone() };
    Model::from_bytes(&Bundle { prior, ..shipped.bundle().clone() }.to_bytes()).unwrap()
}

fn life() -> Life {
    let component = domain::Component {
        operator: "default".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
    };
    Life { component, overhaul_index: 0 }
}

/// Estimates every four hours of a short that grows exponentially by hours of wear, flown at some load and temperature.
fn flown(model: &Model, count: u32, surroundings: impl Fn(u32) -> Option<(f64, f64)>) -> Vec<Estimate> {
    let mut stream = Stream::new(4, &["flown"]);
    let mut worn_h = 0.0;
    let mut estimate = |i: u32| {
        let flight_hours = 4.0 * f64::from(i + 1);
        worn_h += 4.0 * surroundings(i).map_or(1.0, |(load, temperature)| load * load * libm::exp(0.3 * temperature));
        let k1 = 0.02 * libm::exp(worn_h / 1000.0) + 0.004 * stream.normal();
        let load = surroundings(i).map(|(ratio, _)| HingeLoad {
            hinge_moment_nm: 100.0 * ratio,
            sigma_nm: 1.0,
            ratio,
            source: LoadSource::StrainAndAirData,
            excluded_sensors: Vec::new(),
            sensor_configuration: ContentHash::of(b"sensors"),
        });
        Estimate {
            upload_id: format!("u{i:05}").parse().unwrap(),
            flight_hours,
            recorded_at: "2026-01-01T00:00:00Z".parse::<Timestamp>().unwrap().plus_hours(3.0 * flight_hours),
            mask_id: Some(model.bundle().masks()[0].id()),
            model: model.summary().hash,
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome: Outcome::Diagnosed(Diagnosis {
                fault_vector: FaultVector(vec![k1.max(0.0), 0.0, 0.0, 0.5, 0.5]),
                sigma: vec![0.004; 5],
                fit: Some(MapFit { plausible: true, chi_square: 20.0, degrees_of_freedom: 21, load_invariant: true }),
            }),
            load,
            temperature: surroundings(i).map(|(_, temperature)| temperature),
            load_ratio: None,
            on_ground: false,
        }
    };
    (0..count).map(&mut estimate).collect()
}

fn outlook(model: &Model, estimates: &[Estimate], known: &[State], ahead: &Ahead) -> Outlook {
    let life = life();
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    model.outlook(&context, &model.course(&context, estimates), known, None, false, ahead).unwrap()
}

fn forecast(model: &Model, estimates: &[Estimate], ahead: &Ahead) -> Forecast {
    outlook(model, estimates, &[], ahead).prognosis.unwrap().forecast.unwrap()
}

fn median_fh(forecast: &Forecast) -> f64 {
    forecast.rul.quantile_fh(0.5).unwrap()
}

fn from_now(load: Option<LoadAhead>, temperature: Option<TemperatureAhead>) -> Ahead {
    Ahead { stretches: vec![Stretch { from_fh: 0.0, load, temperature }] }
}

#[test]
fn without_any_load_or_with_no_effect_of_it_all_numbers_are_as_ever() {
    let blind = model(None);
    for (told, surroundings) in [([2.0, 0.3], None), ([0.0, 0.0], Some((1.4, 0.5)))] {
        let paced = model(Some(told));
        let [as_ever, now] = [&blind, &paced].map(|model| {
            let all = flown(model, 150, |_| surroundings);
            outlook(model, &all, &[], &Ahead::default())
        });
        let [as_ever_told, now_told] =
            [&as_ever, &now].map(|outlook| outlook.prognosis.clone().unwrap().forecast.unwrap());
        assert_eq!(now_told, as_ever_told, "{told:?}");
        let numbers = |outlook: &Outlook| -> Vec<State> {
            let digest = ContentHash::of(b"of prior and bundle");
            outlook.states.iter().map(|state| State { digest, ..state.clone() }).collect()
        };
        assert_eq!(numbers(&now), numbers(&as_ever));
    }
}

/// A life that was flown alike all along goes on as it would without a clock of wear, and is told its pace.
#[test]
fn a_life_flown_alike_all_along_is_forecast_about_as_without_its_load() {
    let (blind, paced) = (model(None), model(Some([2.0, 0.3])));
    let [without, with] =
        [&blind, &paced].map(|model| forecast(model, &flown(model, 150, |_| Some((1.2, 0.0))), &Ahead::default()));
    let ratio = median_fh(&with) / median_fh(&without);
    println!("medians {:.0} and {:.0}", median_fh(&without), median_fh(&with));
    assert!((0.75..1.33).contains(&ratio), "{ratio}");
    assert_eq!(without.pace, None);
    let pace = with.pace.clone().unwrap();
    println!("{pace:?}");
    assert!((pace.now - 1.44).abs() < 0.05 && (pace.last_200_fh - 1.44).abs() < 1e-6, "{pace:?}");
    assert!((pace.load - 1.2).abs() < 1e-9 && pace.known_share > 0.99, "{pace:?}");
    let trends = |forecast: &Forecast| forecast.faults[0].trend_per_1000_fh;
    assert!((trends(&with) / trends(&without) - 1.0).abs() < 0.2, "per flight hour, both");
    let b = &with.propagation.control_matrix[0];
    // x' = A x + b at the pace of the mission, whatever its columns are called.
    let total = b[0] + b[1] * pace.load + b[2] * pace.temperature;
    let x = with.faults[0].value;
    let grows = with.propagation.state_matrix[0][0] * x + total;
    assert!((1000.0 * grows / trends(&with) - 1.0).abs() < 0.3, "{grows} and {}", trends(&with));
    assert!(b[1] > 0.0 && with.propagation.control_matrix_sigma[0][1] > 0.0, "load has its column: {b:?}");
}

#[test]
fn flights_ahead_that_are_told_act_on_the_forecast_and_on_no_state() {
    let model = model(Some([2.0, 0.3]));
    let all = flown(&model, 150, |_| Some((1.0, 0.0)));
    let as_now = outlook(&model, &all, &[], &Ahead::default());
    let usual_fh = median_fh(&forecast(&model, &all, &Ahead::default()));
    let told = |load, temperature| median_fh(&forecast(&model, &all, &from_now(load, temperature)));
    let harder_fh = told(Some(LoadAhead::Times(1.5)), None);
    assert!((harder_fh * 2.25 / usual_fh - 1.0).abs() < 0.1, "{harder_fh} and {usual_fh}");
    let absolute_fh = told(Some(LoadAhead::Ratio(1.5)), Some(TemperatureAhead::Celsius(15.0)));
    assert!((absolute_fh / harder_fh - 1.0).abs() < 0.1, "{absolute_fh} and {harder_fh}");
    let warmer_fh = told(None, Some(TemperatureAhead::Above(20.0)));
    assert!((warmer_fh * libm::exp(0.3) / usual_fh - 1.0).abs() < 0.1, "{warmer_fh}");
    let harder = outlook(&model, &all, &[], &from_now(Some(LoadAhead::Times(1.5)), None));
    assert_eq!(harder.states, as_now.states);
}

/// A tail that changes its route: what the new route does is seen before the faults show it.
#[test]
fn a_change_of_the_mission_is_forecast_at_once() {
    let model = model(Some([2.0, 0.3]));
    let route = |harder: f64| move |i: u32| Some((if i < 150 { 1.0 } else { harder }, 0.0));
    let [stays, changes] =
        [1.0, 1.5].map(|harder| median_fh(&forecast(&model, &flown(&model, 200, route(harder)), &Ahead::default())));
    // After 200 hours of the new route the faults are hardly another, the hours to come are.
    println!("{stays:.0} and {changes:.0}");
    assert!(changes < 0.6 * stays, "{changes} and {stays}");
}

/// The order of arrival changes nothing: states that stand and those behind a late upload make the same life.
#[test]
fn a_late_load_makes_the_same_states_as_one_in_time() {
    let model = model(Some([2.0, 0.3]));
    let all = flown(&model, 90, |i| Some((1.0 + 0.2 * libm::sin(f64::from(i)), 0.1)));
    let whole = outlook(&model, &all, &[], &Ahead::default());
    for missing in [3, 33, 60] {
        let mut before = all.clone();
        before.remove(missing);
        let known = outlook(&model, &before, &[], &Ahead::default()).states;
        let late = outlook(&model, &all, &known, &Ahead::default());
        let from = late.states_from.unwrap();
        let stored: Vec<State> = known.into_iter().filter(|state| state.block < from).chain(late.states).collect();
        assert_eq!(stored, whole.states, "{missing}");
        assert_eq!(late.prognosis, whole.prognosis);
    }
}

/// An upload that cannot be diagnosed still tells its load.
#[test]
fn what_cannot_be_diagnosed_counts_as_flown() {
    let model = model(Some([2.0, 0.3]));
    let all = flown(&model, 90, |i| Some((if i % 2 == 0 { 1.0 } else { 1.4 }, 0.0)));
    let mut some = all.clone();
    for estimate in some.iter_mut().skip(1).step_by(2) {
        estimate.outcome = Outcome::Undiagnosable { valid_samples: 3, needed: 20 };
    }
    let pace = |estimates: &[Estimate]| forecast(&model, estimates, &Ahead::default()).pace.unwrap();
    let [all, some] = [&all, &some].map(|estimates| pace(estimates));
    assert!((some.last_200_fh - all.last_200_fh).abs() < 1e-9, "{some:?} and {all:?}");
    let mut grounded = flown(&model, 90, |_| Some((1.2, 0.0)));
    grounded[80].on_ground = true;
    grounded[80].load.as_mut().unwrap().ratio = 50.0;
    assert!((pace(&grounded).last_200_fh - 1.44).abs() < 1e-9, "on the ground no hours are flown");
}

/// A filter that was kept goes on as the life does.
#[test]
fn a_recalled_filter_changes_nothing() {
    let model = model(Some([2.0, 0.3]));
    let life = life();
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    // The first hours are known by then, so that nothing before changes.
    let all = flown(&model, 110, |i| Some((1.0 + 0.2 * libm::sin(f64::from(i)), 0.1)));
    let course = model.course(&context, &all);
    let whole = outlook(&model, &all, &[], &Ahead::default());
    let kept = outlook(&model, &all[..80], &[], &Ahead::default()).latest.unwrap();
    let known = &whole.states[..16];
    assert!(course.recallable(known).contains(&(kept.block, kept.digest)));
    let bytes = kept.filter.to_bytes();
    let kept = pipeline::Checkpoint::restore(&model, model.prior(), kept.block, kept.digest, &bytes).unwrap();
    let recalled = model.outlook(&context, &course, known, Some(kept), false, &Ahead::default()).unwrap();
    assert_eq!(recalled.states, whole.states[known.len()..]);
    assert_eq!((recalled.prognosis, recalled.latest), (whole.prognosis, whole.latest));
}
