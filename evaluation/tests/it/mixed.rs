//! Mixed-effects models on fleets that are made by them.

use domain::FaultVector;
use evaluation::{MixedBrownian, MixedEffects};
use numerics::{Stream, energy, quantile};
use prognosis::{
    Climatology, EndedLife, Ending, Estimator, Observation, PredictionSettings, REFERENCE_LIFE_FH, REFERENCE_LIMIT,
};

const SETTINGS: PredictionSettings = PredictionSettings { draws: 400, horizon_fh: 40.0 * REFERENCE_LIFE_FH };

fn seen(age: f64, severity: f64) -> Observation {
    Observation {
        t_fh: age * REFERENCE_LIFE_FH,
        fault_vector: FaultVector(vec![severity * REFERENCE_LIMIT]),
        sigma: vec![1e-4 * REFERENCE_LIMIT],
        load: None,
        temperature: None,
    }
}

/// A life of forty or so observations along a curve of severity over age, up to where that passes one.
fn life(curve: impl Fn(f64) -> f64, noise: impl Fn(f64, &mut Stream) -> f64, stream: &mut Stream) -> EndedLife {
    let (mut before, mut after) = (0.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (before + after);
        if curve(middle) < 1.0 { before = middle } else { after = middle }
    }
    let ages = (0..).map(|i| 0.025 * f64::from(i)).take_while(|age| *age < before);
    EndedLife {
        observations: ages.map(|age| seen(age, noise(curve(age), stream))).collect(),
        flights: Vec::new(),
        end_fh: before * REFERENCE_LIFE_FH,
        ending: Ending::Failed,
    }
}

/// Lives along parabolas that rise, with coefficients and errors of normal distributions.
fn parabolas(count: usize, noise: f64) -> Vec<EndedLife> {
    let mut stream = Stream::new(5, &["parabolas"]);
    let mut one = |_| {
        let (slope, bend) = (0.35 + 0.05 * stream.normal(), 0.6 + 0.1 * stream.normal());
        let start = 0.05 + 0.01 * stream.normal();
        life(|age| start + age * (slope + age * bend), |x, stream| x + noise * stream.normal(), &mut stream)
    };
    (0..count).map(&mut one).collect()
}

/// Lives in which damage and a quarter of the limit grow exponentially, seen with errors in proportion.
fn exponentials(count: usize) -> Vec<EndedLife> {
    let mut stream = Stream::new(6, &["exponentials"]);
    let mut one = |_| {
        let (start, rate) = (0.25_f64.ln() + 0.1 * stream.normal(), 1.6 + 0.25 * stream.normal());
        let noise = |x: f64, stream: &mut Stream| (x + 0.25) * (0.03 * stream.normal()).exp() - 0.25;
        life(|age| (start + rate * age).exp() - 0.25, noise, &mut stream)
    };
    (0..count).map(&mut one).collect()
}

/// Lives whose damage and a quarter of the limit wander up exponentially, seen as they are.
fn wanderers(count: usize) -> Vec<EndedLife> {
    const STEPS: usize = 10;
    let mut stream = Stream::new(7, &["wanderers"]);
    let mut one = |_| {
        let (mut place, drift) = (0.25_f64.ln(), 1.6 + 0.25 * stream.normal());
        let (mut observations, mut step) = (Vec::new(), 0);
        let dt = 0.025 / STEPS as f64;
        while place.exp() < 1.25 {
            if step % STEPS == 0 {
                observations.push(seen(dt * step as f64, place.exp() - 0.25));
            }
            place += drift * dt + 0.25 * dt.sqrt() * stream.normal();
            step += 1;
        }
        EndedLife {
            flights: Vec::new(),
            observations,
            end_fh: dt * step as f64 * REFERENCE_LIFE_FH,
            ending: Ending::Failed,
        }
    };
    (0..count).map(&mut one).collect()
}

/// Share of 80 % intervals that hold, and the mean CRPS in hours, over predictions at fifths of lives.
fn judged(estimator: &dyn Estimator, lives: &[EndedLife]) -> (f64, f64) {
    let (mut held, mut crps, mut count) = (0, 0.0, 0);
    for (index, life) in lives.iter().enumerate() {
        for fifth in 1..5 {
            let now_fh = 0.2 * f64::from(fifth) * life.end_fh;
            let mut follower = estimator.follow();
            life.observations.iter().filter(|seen| seen.t_fh <= now_fh).for_each(|seen| follower.observe(seen));
            let stream = Stream::new(9, &["judged"]).substream(index as u64);
            let ends = follower.predict(now_fh, &SETTINGS, &stream).ends_fh;
            let ends = quantile::sorted(ends.iter().map(|end| end.unwrap_or(SETTINGS.horizon_fh)).collect());
            let truth = life.end_fh - now_fh;
            held += usize::from((quantile::nearest(&ends, 0.1)..=quantile::nearest(&ends, 0.9)).contains(&truth));
            crps += energy::crps(&ends, truth);
            count += 1;
        }
    }
    (held as f64 / f64::from(count), crps / f64::from(count))
}

/// The model by which lives are made is calibrated on lives that did not teach it, and better than the others and than
/// what knows no damage.
#[test]
fn each_is_calibrated_and_best_on_a_fleet_of_its_own() {
    for (fleet, own) in [
        (parabolas(100, 0.02), "mixed-polynomial"),
        (exponentials(100), "mixed-exponential"),
        (wanderers(100), "mixed-brownian"),
    ] {
        let (teach, judge) = fleet.split_at(50);
        let models: [Box<dyn Estimator>; 3] = [
            Box::new(MixedEffects::polynomial(teach).expect("observed lives")),
            Box::new(MixedEffects::exponential(teach).expect("observed lives")),
            Box::new(MixedBrownian::learn(teach).expect("observed lives")),
        ];
        let lives = teach.iter().map(|life| (life.end_fh, life.ending));
        let (_, climatology) = judged(&Climatology::learn(lives).expect("failures"), judge);
        let scores: Vec<_> = models.iter().map(|model| (model.name(), judged(model.as_ref(), judge))).collect();
        for &(name, (coverage, crps)) in &scores {
            if name == own {
                assert!((0.73..0.87).contains(&coverage) && crps < 0.8 * climatology, "{scores:?}, {climatology}");
            } else {
                let (_, (_, best)) = scores.iter().find(|(name, _)| *name == own).expect("one of them");
                assert!(*best < 0.95 * crps, "{own}: {scores:?}");
            }
        }
    }
}

#[test]
fn a_life_that_is_seen_without_error_is_continued_to_its_limit() {
    let curve = |age: f64| 0.02 + age * (0.3 + 0.7 * age);
    let truth = life(curve, |x, _| x, &mut Stream::new(1, &["exact"]));
    let model = MixedEffects::polynomial(&parabolas(30, 0.0)).expect("observed lives");
    let mut follower = model.follow();
    let half = 0.5 * truth.end_fh;
    truth.observations.iter().filter(|seen| seen.t_fh <= half).for_each(|seen| follower.observe(seen));
    let ends = follower.predict(half, &SETTINGS, &Stream::new(2, &["exact"])).ends_fh;
    let ends = quantile::sorted(ends.into_iter().flatten().collect());
    let median = quantile::median(&ends).expect("draws");
    assert!((median / half - 1.0).abs() < 0.01, "{median} of {half}");
}

/// What is past its limit has no life left; what never moved towards it may never get there; nothing is not finite.
#[test]
fn the_ends_of_what_can_be_said_are_told() {
    let fleet = exponentials(12);
    let model = MixedEffects::exponential(&fleet).expect("observed lives");
    let mut failed = model.follow();
    (0..40).for_each(|i| failed.observe(&seen(0.025 * f64::from(i), 3.0)));
    let ends = failed.predict(REFERENCE_LIFE_FH, &SETTINGS, &Stream::new(3, &["failed"])).ends_fh;
    assert!(ends.iter().all(|end| *end == Some(0.0)), "{ends:?}");
    let mut healthy = model.follow();
    (0..400).for_each(|i| healthy.observe(&seen(0.025 * f64::from(i), -0.5)));
    let ends = healthy.predict(10.0 * REFERENCE_LIFE_FH, &SETTINGS, &Stream::new(3, &["healthy"])).ends_fh;
    let later = ends.iter().filter(|end| end.is_none_or(|end| end.is_finite() && end > REFERENCE_LIFE_FH));
    assert!(later.count() > ends.len() / 2, "{ends:?}");
    assert!(MixedEffects::polynomial(&[]).is_none());
}
