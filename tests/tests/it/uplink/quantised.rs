//! What the steps of a frame cost: the same flights, diagnosed and forecast as JSON brings them and as frames do.

use domain::{
    Ahead, Component, Estimate, FaultVector, FrameKeyId, FrameSubject, Life, Mask, OperatorId, Outcome, Upload,
};
use pipeline::{LifeContext, Model};
use proto::frame::{Content, Frame, FrameKey, InstallationKey, Measured, MeasuredStrain, join};
use simulator::{FleetPlan, LifeFlight, Lives, Mission, Pace, Physics, Upkeep};

/// Lives of the fleet, and every how many of their flights are looked at.
const LIVES: usize = 6;
const EVERY: usize = 12;

/// A flight as it is sent, as a frame brings it, and the faults that are hidden.
struct Flight {
    json: Upload,
    framed: Upload,
    truth: FaultVector,
}

fn plan() -> FleetPlan {
    FleetPlan {
        tails: LIVES,
        positions: 1,
        seed: 20,
        start: "2026-01-01T00:00:00Z".parse().unwrap(),
        physics: Physics::HighFidelity,
        upkeep: Upkeep { overhauls: 0.0, swaps: 0.0 },
        missions: vec![Mission::ShortHaul, Mission::Cruise],
        pace: Pace::default(),
        weak_transmission: Vec::new(),
    }
}

fn model() -> Model {
    Model::from_bytes(include_bytes!("../../../../models/default.json")).unwrap()
}

fn key(subject: &FrameSubject) -> FrameKey {
    InstallationKey::new([5; 32]).derive(FrameKeyId::new([1; 8]), &OperatorId::default(), subject)
}

fn opened(frame: &Frame, subject: &FrameSubject) -> Content {
    Frame::parse(frame.bytes()).unwrap().open(&key(subject)).unwrap()
}

/// The upload after its way through the frames of its actuator and of its strain.
fn framed(upload: &Upload) -> Upload {
    let Upload { tail, position, part_number, serial_number, reading, .. } = upload.clone();
    let wing = FrameSubject::Strain { tail: tail.clone() };
    let mask_id = reading.mask_id().unwrap();
    let unit = FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id };
    let frame = Measured::of(upload, &unit).unwrap().frame(1, &key(&unit)).unwrap();
    assert!(frame.bytes().len() <= proto::frame::MAX_BYTES);
    let Content::Actuator(measured) = opened(&frame, &unit) else { panic!("an actuator's") };
    let strain = MeasuredStrain::of(upload, &wing).unwrap().map(|strain| {
        let Content::Strain(strain) = opened(&strain.frame(1, &key(&wing)).unwrap(), &wing) else { panic!("strain") };
        (strain, wing.clone())
    });
    join(upload.upload_id.clone(), (measured, unit), strain).unwrap()
}

fn flights(lives: &Lives, slot: usize) -> Vec<Flight> {
    let unit = plan().unit(slot, 0);
    let flight = |LifeFlight { upload, equivalent_h, .. }| {
        let truth = unit.at(equivalent_h).faults.clone();
        Flight { framed: framed(&upload), json: upload, truth }
    };
    lives.flights(slot, EVERY).map(flight).collect()
}

fn error(estimate: &Estimate, truth: &FaultVector) -> Option<f64> {
    let Outcome::Diagnosed(found) = &estimate.outcome else { return None };
    let squares = found.fault_vector.0.iter().zip(&truth.0).map(|(found, truth)| (found - truth) * (found - truth));
    Some((squares.sum::<f64>() / truth.0.len() as f64).sqrt())
}

fn quantile(values: &[f64], level: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * level).round() as usize]
}

/// The upload with samples that differ by a billionth.
fn touched(upload: &Upload) -> Upload {
    let mut upload = upload.clone();
    let samples = &mut upload.reading.samples_mut().unwrap().samples;
    samples.iter_mut().flatten().enumerate().for_each(|(i, y)| *y *= 1.0 + if i % 2 == 0 { 1e-9 } else { -1e-9 });
    upload
}

fn estimates(model: &Model, mask: &Mask, uploads: impl Iterator<Item = Upload>) -> Vec<Estimate> {
    uploads.map(|upload| model.estimate(&upload, Some(mask), None).unwrap()).collect()
}

/// Quantiles of the remaining life after some of a life's flights; `None` where there is no forecast.
fn remaining(model: &Model, estimates: &[Estimate]) -> Option<[f64; 2]> {
    let component = Component {
        operator: OperatorId::default(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "S20-0001".parse().unwrap(),
    };
    let life = Life { component, overhaul_index: 0 };
    let context = LifeContext { life: &life, generation: 1, prior: model.prior(), began_fh: 0.0 };
    let course = model.course(&context, estimates);
    let outlook = model.outlook(&context, &course, &[], None, false, &Ahead::default()).unwrap();
    let rul = outlook.prognosis?.forecast.ok()?.rul;
    Some([rul.quantile_fh(0.1)?, rul.quantile_fh(0.5)?])
}

/// Over 8 bits of load ratio and 12 of samples nothing is lost that could be seen beside the noise of a sample.
#[test]
fn slow_frames_cost_a_diagnosis_nothing_and_a_forecast_little() {
    let model = model();
    let mask = model.bundle().masks()[0].clone();
    let lives = Lives::new(plan(), mask.clone()).unwrap();
    let (mut json_errors, mut frame_errors) = (Vec::new(), Vec::new());
    // By frames; and by samples of which nothing but the last digits is another: what any change does to a filter's draws.
    let (mut shifts, mut idle) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut load_shifts = Vec::new();
    for slot in 0..LIVES {
        let flights = flights(&lives, slot);
        let json = estimates(&model, &mask, flights.iter().map(|flight| flight.json.clone()));
        let touched = estimates(&model, &mask, flights.iter().map(|flight| touched(&flight.json)));
        let frames = estimates(&model, &mask, flights.iter().map(|flight| flight.framed.clone()));
        for ((json, frame), flight) in json.iter().zip(&frames).zip(&flights) {
            assert_ne!(json.measurement, frame.measurement, "a frame has steps");
            json_errors.extend(error(json, &flight.truth));
            frame_errors.extend(error(frame, &flight.truth));
            if let (Some(json), Some(frame)) = (&json.load, &frame.load) {
                load_shifts.push((frame.hinge_moment_nm / json.hinge_moment_nm - 1.0).abs());
            }
        }
        for share in [0.5, 0.7, 0.85, 0.95] {
            let count = (flights.len() as f64 * share) as usize;
            let known = [&json, &frames, &touched].map(|estimates| remaining(&model, &estimates[..count]));
            let [Some(json), Some(frame), Some(touched)] = known else { continue };
            println!(
                "life {slot}, {share}: p10 and p50 {json:.0?} h by JSON, {frame:.0?} h by frames, {touched:.0?} h touched"
            );
            for (moved, to) in [(&mut shifts, frame), (&mut idle, touched)] {
                let relative = to.iter().zip(&json).map(|(to, from)| (to - from) / from);
                moved.iter_mut().zip(relative).for_each(|(moved, relative)| moved.push(relative));
            }
        }
    }
    assert_eq!(json_errors.len(), frame_errors.len());
    assert!(json_errors.len() > 150, "{} flights", json_errors.len());
    for level in [0.5, 0.95] {
        let (json, frame) = (quantile(&json_errors, level), quantile(&frame_errors, level));
        println!(
            "err_k at {level}: {:.4} % and {:.4} %, of {} flights",
            100.0 * json,
            100.0 * frame,
            json_errors.len()
        );
        assert!(frame <= 1.05 * json, "err_k at {level}: {frame} by frames, {json} by JSON");
    }
    println!(
        "load: {:.4} % median, {:.4} % at most",
        100.0 * quantile(&load_shifts, 0.5),
        100.0 * quantile(&load_shifts, 1.0)
    );
    for (name, (shifts, idle)) in ["p10", "p50"].into_iter().zip(shifts.iter().zip(&idle)) {
        let sizes = |shifts: &[f64]| shifts.iter().map(|shift| 100.0 * shift.abs()).collect::<Vec<_>>();
        let (framed, idle) = (sizes(shifts), sizes(idle));
        let told = |sizes: &[f64]| [0.5, 0.9].map(|level| quantile(sizes, level));
        println!("{name} moves by {:.1?} % (median, 9 of 10) by frames, {:.1?} % touched", told(&framed), told(&idle));
        assert!(framed.len() >= 12 && quantile(&framed, 0.5) < 6.0, "{name} of {} forecasts", framed.len());
    }
}
