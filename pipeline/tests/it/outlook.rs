//! Estimates and outlooks with the bundle that ships: pure functions of a set, the same bits always.

use std::sync::LazyLock;

use domain::{
    Ahead, Component, ContentHash, Diagnosis, DoubtKind, Estimate, FaultVector, Life, LoadRatio, MapFit, MapSamples,
    Mask, NUMERICS_VERSION, Outcome, Prognosis, Reading, SetAsideReason, State, Timestamp, Upload,
    prognosis::{Forecast, Status},
};
use ema::{closed_form, faults::ElectricalFaults};
use numerics::Stream;
use pipeline::{LifeContext, Model, Outlook};
use proptest::prelude::*;

fn model() -> Model {
    Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap()
}

fn life() -> Life {
    let component = Component {
        operator: "default".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
    };
    Life { component, overhaul_index: 0 }
}

fn outlook(model: &Model, estimates: &[Estimate], known: &[State]) -> Outlook {
    let life = life();
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    model.outlook(&context, &model.course(&context, estimates), known, None, false, &Ahead::default()).unwrap()
}

/// Estimates every four hours of a short that grows exponentially.
fn estimates(model: &Model, count: u32) -> Vec<Estimate> {
    growing(model, 0.02, count)
}

/// The same from another beginning: the shorter the rest of the life, the quicker its draws.
fn growing(model: &Model, from: f64, count: u32) -> Vec<Estimate> {
    let mut stream = Stream::new(4, &["estimates"]);
    let mut estimate = |i: u32| {
        let flight_hours = 4.0 * f64::from(i + 1);
        let k1 = from * (flight_hours / 1000.0).exp() + 0.004 * stream.normal();
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
            load: None,
            temperature: None,
            load_ratio: None,
            on_ground: false,
        }
    };
    (0..count).map(&mut estimate).collect()
}

/// An upload of closed-form samples without noise.
fn upload(mask: &Mask, k_nom: f64, faults: &FaultVector, r: Option<f64>) -> Upload {
    let electrical = ElectricalFaults::try_from(faults).unwrap();
    let load = r.unwrap_or(0.1);
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: "u1".parse().unwrap(),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
        flight_hours: 12.5,
        flight_cycles: None,
        recorded_at: "2026-03-01T12:30:00Z".parse().unwrap(),
        reading: Reading::Samples(MapSamples {
            mask_id: mask.id(),
            samples: mask
                .bins()
                .iter()
                .map(|&bin| Some(k_nom * closed_form::back_emf(&electrical, bin, load)))
                .collect(),
            load_ratio: r.map(|r| LoadRatio::PerSample(vec![Some(r); mask.len()])),
            sample_noise: Some(0.01),
        }),
        strain: None,
        air_data: None,
        temperature_c: None,
        winding_temperature_c: None,
        on_ground: None,
    }
}

fn samples(upload: &mut Upload) -> &mut [Option<f64>] {
    &mut upload.reading.samples_mut().unwrap().samples
}

fn diagnosis(model: &Model, upload: &Upload) -> Diagnosis {
    match model.estimate(upload, Some(&model.bundle().masks()[0]), None).unwrap().outcome {
        Outcome::Diagnosed(diagnosis) => diagnosis,
        other => panic!("{other:?}"),
    }
}

#[test]
fn samples_of_known_faults_are_diagnosed_with_and_without_load_ratio() {
    let model = model();
    let mask = &model.bundle().masks()[0];
    let truth = FaultVector(vec![0.12, 0.03, 0.0, 0.55, 0.47]);
    for (r, within) in [(Some(0.1), 0.01), (Some(-0.2), 0.01), (None, 0.03)] {
        let found = diagnosis(&model, &upload(mask, model.summary().k_nom, &truth, r));
        let fit = found.fit.as_ref().unwrap();
        assert!(fit.plausible);
        assert_eq!(fit.load_invariant, r.is_some());
        for (k, truth) in found.fault_vector.values().iter().zip(truth.values()) {
            assert!((k - truth).abs() < within, "{r:?}: {found:?}");
        }
    }
}

/// No signal, a reversed one, V/rpm for V s/rad, mV, and a stronger magnet than there is, each with 1 % noise.
#[test]
fn signals_that_no_motor_gives_are_not_plausible() {
    let model = model();
    let (mask, k_nom) = (&model.bundle().masks()[0], model.summary().k_nom);
    let mut stream = Stream::new(5, &["signals"]);
    for (r, faults) in [(Some(0.1), 0.0), (None, 0.0), (Some(0.3), 0.2), (None, 0.2)] {
        let truth = FaultVector(vec![faults, 0.0, 0.0, 0.5, 0.5]);
        let mut times = |factor: f64| {
            let mut upload = upload(mask, k_nom, &truth, r);
            samples(&mut upload).iter_mut().flatten().for_each(|y| *y = factor * *y + 0.01 * k_nom * stream.normal());
            diagnosis(&model, &upload).is_plausible()
        };
        for factor in [0.0, -1.0, std::f64::consts::PI / 30.0, 1.5, 16.0, 1000.0] {
            assert!(!times(factor), "{factor} with {r:?} and {faults}");
        }
        assert!([0.95, 1.0, 1.05].into_iter().all(times), "{r:?} and {faults}");
    }
}

#[test]
fn missing_samples_cost_certainty_and_too_few_leave_nothing_to_say() {
    let model = model();
    let mask = &model.bundle().masks()[0];
    let whole = upload(mask, model.summary().k_nom, &FaultVector(vec![0.1, 0.0, 0.0, 0.5, 0.5]), Some(0.1));
    let without = |missing: usize| {
        let mut upload = whole.clone();
        samples(&mut upload)[..missing].fill(None);
        upload
    };
    let spread = |diagnosis: Diagnosis| diagnosis.sigma.iter().sum::<f64>();
    assert!(spread(diagnosis(&model, &without(2))) > spread(diagnosis(&model, &whole)));
    let needed = model.summary().min_samples;
    let few = model.estimate(&without(mask.len() - needed + 1), Some(mask), None).unwrap();
    assert_eq!(few.outcome, Outcome::Undiagnosable { valid_samples: needed - 1, needed });
    assert!(matches!(
        model.estimate(&without(mask.len()), Some(mask), None).unwrap().outcome,
        Outcome::Undiagnosable { .. }
    ));
}

#[test]
fn a_life_without_a_closed_block_says_what_is_missing() {
    let model = model();
    assert_eq!(outlook(&model, &[], &[]).prognosis, None);
    for count in [1, 2, 3, 4] {
        let prognosis = outlook(&model, &estimates(&model, count), &[]).prognosis.unwrap();
        let missing = prognosis.forecast.unwrap_err().missing;
        assert!(missing.contains(&count.to_string()), "{missing}");
    }
    let prognosis = outlook(&model, &estimates(&model, 6), &[]).prognosis.unwrap();
    assert!(prognosis.forecast.is_ok());
}

#[test]
fn implausible_estimates_teach_nothing() {
    let model = model();
    let mut estimates = estimates(&model, 40);
    let expected = outlook(&model, &estimates, &[]);
    let mut stranger = estimates[20].clone();
    stranger.upload_id = "stranger".parse().unwrap();
    if let Outcome::Diagnosed(diagnosis) = &mut stranger.outcome {
        diagnosis.fit.as_mut().unwrap().plausible = false;
        diagnosis.fault_vector = FaultVector(vec![0.9; 5]);
    }
    estimates.insert(21, stranger);
    assert_eq!(outlook(&model, &estimates, &[]), expected);
}

#[test]
fn what_is_missing_says_why_uploads_that_were_judged_do_not_count() {
    let model = model();
    let mut all = estimates(&model, 9);
    for (i, estimate) in all.iter_mut().enumerate() {
        match &mut estimate.outcome {
            Outcome::Diagnosed(diagnosis) if i < 4 => diagnosis.fit.as_mut().unwrap().plausible = false,
            outcome if i < 7 => *outcome = Outcome::Undiagnosable { valid_samples: 3, needed: 11 },
            _ => {}
        }
    }
    let missing =
        |estimates: &[Estimate]| outlook(&model, estimates, &[]).prognosis.unwrap().forecast.unwrap_err().missing;
    assert!(missing(&all[..7]).starts_with("no upload so far could be diagnosed; 4 implausible"));
    assert!(missing(&all).starts_with("2 of at least 3 usable observations"));
    assert!(missing(&all).contains("; 3 undiagnosable"));
}

/// A sender that makes a new name at each attempt teaches no more than one that keeps to it.
#[test]
fn the_same_measurement_counts_once() {
    let model = model();
    let mut once = estimates(&model, 30);
    for (i, estimate) in once.iter_mut().enumerate() {
        estimate.measurement = Some(ContentHash::of(&[i as u8]));
    }
    let expected = outlook(&model, &once, &[]);
    let resent = |estimate: &Estimate, name: &str| {
        let upload_id = format!("{name}-{}", estimate.upload_id).parse().unwrap();
        Estimate { upload_id, ..estimate.clone() }
    };
    let mut all: Vec<Estimate> =
        once.iter().flat_map(|one| [one.clone(), resent(one, "v"), resent(one, "w")]).collect();
    all.sort_by(Estimate::life_order);
    let found = outlook(&model, &all, &[]);
    assert_eq!((&found.states, &found.prognosis), (&expected.states, &expected.prognosis));
    assert!(found.excluded.iter().all(|one| one.reason == SetAsideReason::RepeatedMeasurement));
    let set_aside: Vec<_> = found.excluded.iter().map(|one| one.upload_id.as_str()).collect();
    assert_eq!((set_aside.len(), set_aside[0], set_aside[1]), (60, "v-u00000", "w-u00000"));
    assert!(found.excluded[1].detail.contains("upload u00000"));

    // Without the first, the next one counts; other samples of the same moment are another measurement.
    all.remove(0);
    all[1].measurement = Some(ContentHash::of(b"other"));
    assert_eq!(outlook(&model, &all, &[]).excluded.len(), 58);
}

/// A life from 400 hours on, and uploads of a counter that restarted behind it.
#[test]
fn a_forecast_is_doubted_where_a_third_of_the_uploads_contradict_it() {
    let model = model();
    let mut old = growing(&model, 0.0, 60);
    old.iter_mut().for_each(|estimate| estimate.flight_hours += 400.0);
    let expected = outlook(&model, &old, &[]).prognosis.unwrap();
    for (new, doubted) in [(20, false), (30, true)] {
        let mut restarted = growing(&model, 0.0, new);
        for (i, estimate) in restarted.iter_mut().enumerate() {
            estimate.upload_id = format!("v{i}").parse().unwrap();
            estimate.recorded_at = estimate.recorded_at.plus_hours(1000.0);
        }
        restarted.extend(old.iter().cloned());
        let found = outlook(&model, &restarted, &[]);
        assert_eq!(found.excluded.len(), new as usize);
        let prognosis = found.prognosis.unwrap();
        let status = prognosis.status(old[59].recorded_at, 720.0);
        assert!(!doubted || status == Status::Inconsistent, "{status:?}");
        assert_eq!(prognosis.as_of, expected.as_of);
        let rul = |prognosis: &Prognosis| prognosis.forecast.clone().unwrap().rul;
        assert_eq!(rul(&prognosis), rul(&expected));
        let doubts = prognosis.forecast.unwrap().doubts;
        assert_eq!(doubts.iter().any(|doubt| doubt.kind == DoubtKind::Hours), doubted);
    }
}

#[test]
fn known_states_are_kept_and_those_behind_a_late_upload_replaced() {
    let model = model();
    let all = estimates(&model, 60);
    let whole = outlook(&model, &all, &[]);
    let kept = outlook(&model, &all, &whole.states);
    assert_eq!((kept.states_from, kept.states.len()), (None, 0));
    assert_eq!(kept.prognosis, whole.prognosis);

    let mut before = all.clone();
    before.remove(33);
    let known = outlook(&model, &before, &[]).states;
    let late = outlook(&model, &all, &known);
    let from = late.states_from.unwrap();
    assert_eq!(from, (all[33].flight_hours / 20.0) as u64);
    let stored: Vec<State> = known.into_iter().filter(|state| state.block < from).chain(late.states).collect();
    assert_eq!(stored, whole.states);
}

/// A life that is followed from a filter kept before is the same life, bit for bit.
#[test]
fn a_recalled_filter_changes_nothing() {
    let (model, life) = (model(), life());
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    let all = estimates(&model, 60);
    let course = model.course(&context, &all);
    let whole = outlook(&model, &all, &[]);
    for (count, standing) in [(60, 12), (60, 9), (45, 9), (45, 4), (6, 1)] {
        let kept = outlook(&model, &all[..count], &[]).latest.unwrap();
        let known = &whole.states[..standing.min(whole.states.len())];
        let wanted = course.recallable(known).contains(&(kept.block, kept.digest));
        assert_eq!(wanted, known.iter().any(|state| state.block == kept.block), "{count} of {standing}");
        let recalled = model.outlook(&context, &course, known, Some(kept), false, &Ahead::default()).unwrap();
        assert_eq!(recalled.states, whole.states[known.len()..]);
        assert_eq!((recalled.prognosis, recalled.latest), (whole.prognosis.clone(), whole.latest.clone()));
    }
}

/// Where newer data wait, only a forecast that no new state calls for is left to them.
#[test]
fn a_superseded_forecast_is_left_out_unless_a_block_was_closed() {
    let (model, life) = (model(), life());
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    let all = estimates(&model, 62);
    let superseded = |count: usize, known: &[State]| {
        let course = model.course(&context, &all[..count]);
        model.outlook(&context, &course, known, None, true, &Ahead::default()).unwrap()
    };
    let whole = outlook(&model, &all[..60], &[]);
    let known = &whole.states;
    let waiting = superseded(61, known);
    assert_eq!((waiting.states_from, waiting.prognosis), (None, None));
    assert_eq!(waiting.latest, whole.latest);
    assert_eq!(superseded(60, &known[..known.len() - 1]).prognosis, whole.prognosis, "a block was closed");
    let young = outlook(&model, &all[..2], &[]);
    assert_eq!(superseded(2, &[]).prognosis, young.prognosis, "nothing was forecast before");
}

/// A healthy life of 40 uploads, and one of `behind` a few hours apart from 3,200 hours on, with that much of a short.
fn silent(model: &Model, behind: u32, k1: f64) -> Vec<Estimate> {
    let mut all = growing(model, 0.0, 40 + behind);
    for (i, estimate) in all[40..].iter_mut().enumerate() {
        estimate.flight_hours = 3200.0 + 5.0 * i as f64;
        estimate.recorded_at = estimate.recorded_at.plus_hours(10_000.0);
        if let Outcome::Diagnosed(diagnosis) = &mut estimate.outcome {
            diagnosis.fault_vector.0[0] += k1;
        }
    }
    all
}

fn read(estimates: &[Estimate], outlook: &Outlook) -> (Status, Forecast) {
    let prognosis = outlook.prognosis.as_ref().unwrap();
    let now = estimates.last().unwrap().recorded_at;
    (prognosis.status(now, 720.0), prognosis.forecast.clone().unwrap())
}

#[test]
fn what_is_seen_behind_a_gap_counts_before_a_block_closes() {
    let model = model();
    for behind in 1..=3 {
        let all = silent(&model, behind, 0.0);
        let (status, forecast) = read(&all, &outlook(&model, &all, &[]));
        assert!(matches!(status, Status::Current | Status::BeyondHorizon), "{status:?}");
        assert!(forecast.probability_failed < 0.1, "{}", forecast.probability_failed);
        let [doubt] = forecast.doubts.as_slice() else { panic!("{:?}", forecast.doubts) };
        assert_eq!(doubt.kind, DoubtKind::Gap);
        assert!(doubt.detail.contains("no data from 160 to 3200 fh"), "{}", doubt.detail);
    }
}

#[test]
fn a_failure_behind_a_gap_is_told_by_three_observations_and_not_by_fewer() {
    let model = model();
    for (behind, expected) in [(1, Status::Inconsistent), (2, Status::Inconsistent), (3, Status::Failed)] {
        let all = silent(&model, behind, 0.7);
        let (status, forecast) = read(&all, &outlook(&model, &all, &[]));
        assert!(forecast.probability_failed >= 0.5, "{behind}: {}", forecast.probability_failed);
        assert!(forecast.doubts.iter().any(|doubt| doubt.kind == DoubtKind::Gap));
        assert_eq!(status, expected, "{behind}");
    }
}

/// One upload in 2,000 hours.
#[test]
fn a_life_of_gaps_is_never_said_to_have_failed_by_one_observation() {
    let model = model();
    for k1 in [0.0, 0.7] {
        let mut all = growing(&model, k1, 7);
        for (i, estimate) in all.iter_mut().enumerate() {
            estimate.flight_hours = 2000.0 * i as f64;
            estimate.recorded_at = estimate.recorded_at.plus_hours(10_000.0 * i as f64);
        }
        assert!(outlook(&model, &all[..3], &[]).prognosis.unwrap().forecast.is_err());
        for count in 4..=7 {
            let found = outlook(&model, &all[..count], &[]);
            let (status, forecast) = read(&all[..count], &found);
            assert_ne!(status, Status::Failed);
            assert!(forecast.doubts.iter().any(|doubt| doubt.kind == DoubtKind::Gap));
        }
    }
}

/// How a forecast moved is told from one block to the next.
#[test]
fn movement_adds_up_from_block_to_block() {
    let model = model();
    let states = outlook(&model, &estimates(&model, 40), &[]).states;
    assert_eq!(states[0].shift, None);
    let mut known = 0;
    for pair in states.windows(2) {
        let shift = pair[1].shift.as_ref().unwrap();
        assert_eq!(shift.since, pair[0].as_of);
        assert_eq!(shift.passed_fh, pair[1].as_of.flight_hours - pair[0].as_of.flight_hours);
        let medians = [&pair[0], &pair[1]].map(|state| state.rul_quantiles_fh[3]);
        let (Some(moved_fh), [Some(before), Some(now)]) = (shift.moved_fh, medians) else { continue };
        // The states' own quantiles come from other random numbers: 200 draws of an sd of at most 2,000 h.
        assert!((moved_fh - (now + shift.passed_fh - before)).abs() < 1000.0);
        assert!(shift.standard_error_fh.unwrap() < 400.0);
        known += 1;
    }
    assert!(known > 0, "both medians are within the horizon at some block");
}

/// What is stored of a life after its estimates have arrived in this order, looked at now and then. An
/// estimate that is there already arrives in vain.
fn arrive(model: &Model, all: &[Estimate], order: &[usize], batch: usize) -> Outlook {
    let (mut arrived, mut stored): (Vec<Estimate>, Vec<State>) = (Vec::new(), Vec::new());
    let mut last = outlook(model, &[], &[]);
    for indices in order.chunks(batch) {
        let news = indices.iter().map(|&i| &all[i]);
        for new in news {
            if arrived.iter().all(|old| old.upload_id != new.upload_id) {
                arrived.push(new.clone());
            }
        }
        arrived.sort_by(Estimate::life_order);
        last = outlook(model, &arrived, &stored);
        if let Some(from) = last.states_from {
            stored.retain(|state| state.block < from);
            stored.append(&mut last.states);
        }
    }
    Outlook { states_from: Some(0), states: stored, ..last }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5, failure_persistence: None, ..ProptestConfig::default() })]

    /// However the estimates of a life arrive, and in however many batches, states and prognosis are the same.
    #[test]
    fn the_order_of_arrival_does_not_matter(
        order in Just((0..30_usize).collect::<Vec<_>>()).prop_shuffle(),
        batch in 1..12_usize,
    ) {
        let (model, all, whole) = &*ONE_LIFE;
        prop_assert_eq!(arrive(model, all, &order, batch), Outlook { states_from: Some(0), ..whole.clone() });
    }
}

/// A life near its end, whose draws are quick, and its outlook.
static ONE_LIFE: LazyLock<(Model, Vec<Estimate>, Outlook)> = LazyLock::new(|| {
    let model = model();
    let all = growing(&model, 0.4, 30);
    let whole = outlook(&model, &all, &[]);
    assert!(whole.states.len() > 4 && whole.prognosis.is_some());
    (model, all, whole)
});

/// A short life with an upload that cannot be, three in ten uploads sent twice. `ACTUARY_PERMUTATIONS` sets
/// how many orders are tried.
#[test]
fn slow_any_order_of_arrival_gives_one_digest() {
    let permutations = std::env::var("ACTUARY_PERMUTATIONS").map_or(100, |count| count.parse().unwrap());
    let model = model();
    let mut all = growing(&model, 0.45, 18);
    all[7].flight_hours += 3000.0;
    all.sort_by(Estimate::life_order);
    let whole = outlook(&model, &all, &[]);
    assert_eq!((whole.states.len(), whole.excluded.len()), (3, 1));
    let expected = ContentHash::of_json(&(&whole.states, &whole.prognosis, &whole.excluded));
    for permutation in 0..permutations {
        let mut stream = Stream::new(6, &["permutation"]).substream(permutation);
        let mut order: Vec<usize> = (0..all.len()).chain((0..all.len()).filter(|_| stream.uniform() < 0.3)).collect();
        stream.shuffle(&mut order);
        let batch = 6 + stream.below(order.len());
        let found = arrive(&model, &all, &order, batch);
        let digest = ContentHash::of_json(&(&found.states, &found.prognosis, &found.excluded));
        assert_eq!(digest, expected, "permutation {permutation}");
    }
}
