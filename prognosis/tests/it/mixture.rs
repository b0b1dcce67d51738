//! Truths of climatology, similarity and their mixture.

use std::borrow::Cow;

use domain::{FaultModel, FaultVector};
use evaluation::metrics;
use numerics::Stream;
use prognosis::{
    Climatology, EndedLife, Ending, Estimator, Follower, HeldOutSettings, LevelLives, Limits, Members, Mixture,
    NoFailure, Observation, PredictionSettings, REFERENCE_LIFE_FH, REFERENCE_LIMIT, RulEstimate, Scale, Similarity,
    StackSettings, Stacked, scale::reference_faults, stack,
};

const PREDICTION: PredictionSettings = PredictionSettings { draws: 400, horizon_fh: 20_000.0 };

/// How a synthetic fleet wears.
#[derive(Clone, Copy, PartialEq)]
enum Wear {
    /// Evenly, at a rate that differs from life to life: the level tells the end.
    Even,
    /// Not at all until it breaks at some age: the level tells nothing.
    Sudden,
}

fn limits() -> Limits {
    Limits { faults: vec![(0.0, REFERENCE_LIMIT)] }
}

fn model() -> FaultModel {
    reference_faults(vec!["wear".to_owned()])
}

fn life(wear: Wear, index: u64) -> EndedLife {
    let mut random = Stream::new(2, &["mixture"]).substream(index);
    let end_fh = match wear {
        Wear::Even => REFERENCE_LIFE_FH * libm::exp(0.5 * random.normal()),
        Wear::Sudden => REFERENCE_LIFE_FH + 300.0 * random.normal(),
    };
    let mut seen = |t_fh: f64| {
        let share = if wear == Wear::Even { t_fh / end_fh } else { 0.0 };
        let fault_vector = FaultVector(vec![REFERENCE_LIMIT * share + 0.0005 * random.normal()]);
        Observation { t_fh, fault_vector, sigma: vec![0.0005], load: None, temperature: None }
    };
    let observations = (1..).map(|i| 60.0 * f64::from(i)).take_while(|t_fh| *t_fh < end_fh).map(&mut seen).collect();
    EndedLife { observations, flights: Vec::new(), end_fh, ending: Ending::Failed }
}

fn fleet(wear: Wear, count: u64) -> Vec<EndedLife> {
    (0..count).map(|index| life(wear, index)).collect()
}

/// Climatology and similarity.
struct Both {
    model: FaultModel,
    limits: Limits,
}

impl Both {
    fn new() -> Self {
        Self { model: model(), limits: limits() }
    }

    fn similarity(&self, lives: &[&EndedLife]) -> Result<Similarity<'_>, NoFailure> {
        let lives = LevelLives::learn(lives, &self.limits, &self.model.nominal)?;
        Ok(Similarity { lives: Cow::Owned(lives), model: &self.model, boundary: &self.limits })
    }
}

impl Members for Both {
    fn teach(&self, lives: &[&EndedLife]) -> Option<Vec<Box<dyn Estimator + '_>>> {
        let climatology = Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending))).ok()?;
        Some(vec![Box::new(climatology), Box::new(self.similarity(lives).ok()?)])
    }
}

/// One estimator that is as sure as if it knew the end to a twelfth, and wrong by a fifth.
struct Overconfident;

struct Boast {
    t_fh: f64,
    seen: f64,
}

impl Estimator for Overconfident {
    fn name(&self) -> &'static str {
        "overconfident"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Boast { t_fh: 0.0, seen: 0.0 })
    }
}

impl Follower for Boast {
    fn observe(&mut self, observation: &Observation) {
        (self.t_fh, self.seen) = (observation.t_fh, observation.fault_vector.0[0]);
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let mut random = stream.substream(0);
        let left_fh = (REFERENCE_LIMIT / (self.seen.max(1e-3) / self.t_fh.max(60.0)) - now_fh).max(60.0);
        // Its error is the same for all forecasts of a life.
        let wrong = 0.2 * Stream::new(7, &[&(self.seen * 1e6).to_string()]).normal();
        let end_fh = |_| Some(left_fh * libm::exp(wrong + 0.08 * random.normal()));
        RulEstimate { ends_fh: (0..settings.draws).map(end_fh).collect(), propagation: None, doubted: false }
    }
}

struct Alone;

impl Members for Alone {
    fn teach(&self, _: &[&EndedLife]) -> Option<Vec<Box<dyn Estimator + '_>>> {
        Some(vec![Box::new(Overconfident)])
    }
}

fn settings(fixed: &[f64]) -> StackSettings {
    let prediction = PredictionSettings { draws: 100, horizon_fh: 20_000.0 };
    StackSettings { fixed: fixed.to_vec(), held_out: HeldOutSettings { prediction, ..HeldOutSettings::default() } }
}

fn stacked(lives: &[EndedLife]) -> Stacked {
    stack(lives, &Both::new(), &settings(&[0.5, 0.5]))
}

/// Forecasts of a life at a time, by an estimator.
fn forecast(estimator: &dyn Estimator, life: &EndedLife, now_fh: f64) -> RulEstimate {
    let mut follower = estimator.follow();
    life.observations.iter().filter(|seen| seen.t_fh <= now_fh).for_each(|seen| follower.observe(seen));
    follower.predict(now_fh, &PREDICTION, &Stream::new(3, &["mixture"]))
}

/// Mean score over lives that taught nothing, at the middle of each.
fn score(estimator: &dyn Estimator, wear: Wear) -> f64 {
    let of = |index| {
        let life = life(wear, index);
        let now_fh = 0.5 * life.end_fh;
        let ends_fh = forecast(estimator, &life, now_fh).ends_fh;
        assert_eq!(ends_fh.len(), PREDICTION.draws);
        metrics::crps_fh(&ends_fh, life.end_fh - now_fh, PREDICTION.horizon_fh)
    };
    (1000..1030).map(of).sum::<f64>() / 30.0
}

#[test]
fn similarity_wins_where_levels_tell_the_end_and_climatology_where_they_do_not() {
    let both = Both::new();
    for (wear, factor) in [(Wear::Even, 0.5), (Wear::Sudden, 1.25)] {
        let lives = fleet(wear, 40);
        let members = both.teach(&lives.iter().collect::<Vec<_>>()).expect("failures");
        let [climatology, similarity] = [0, 1].map(|member| score(&*members[member], wear));
        let better =
            if wear == Wear::Even { similarity < factor * climatology } else { similarity > factor * climatology };
        assert!(better, "{climatology} {similarity}");
    }
}

#[test]
fn weights_go_to_the_better_member_with_many_lives_and_stay_fixed_with_few() {
    let [even, sudden] = [Wear::Even, Wear::Sudden].map(|wear| stacked(&fleet(wear, 60)).weights);
    assert!(even[1] > 0.8 && sudden[0] > 0.8, "{even:?} {sudden:?}");
    let few = stacked(&fleet(Wear::Even, 3)).weights;
    assert!((few[1] - 0.5).abs() <= 0.5 * 3.0 / 18.0 + 1e-12, "{few:?}");
    assert_eq!(stacked(&[]).weights, [0.5, 0.5]);
    for weights in [even, sudden, few] {
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_order_of_lives_changes_nothing() {
    let mut lives = fleet(Wear::Even, 25);
    lives[3].ending = Ending::Removed;
    let learned = |lives: &[EndedLife]| {
        let limits = limits();
        (LevelLives::learn(&lives.iter().collect::<Vec<_>>(), &limits, &[0.0]), stacked(lives))
    };
    let before = learned(&lives);
    Stream::new(9, &["order"]).shuffle(&mut lives);
    assert!(learned(&lives) == before);
}

#[test]
fn a_unit_of_time_changes_nothing() {
    let both = Both::new();
    let forecast_in = |factor: f64| {
        let scale = Scale { characteristic_life: factor * 123.4 };
        let in_units = |life: &EndedLife| {
            let moved = |t_fh: f64| scale.reference_fh(t_fh / REFERENCE_LIFE_FH * factor * 123.4);
            let mut life = EndedLife { end_fh: moved(life.end_fh), ..life.clone() };
            life.observations.iter_mut().for_each(|seen| seen.t_fh = moved(seen.t_fh));
            life
        };
        let lives: Vec<EndedLife> = fleet(Wear::Even, 20).iter().map(in_units).collect();
        let members = both.teach(&lives.iter().collect::<Vec<_>>()).expect("failures");
        let weights = stack(&lives, &both, &settings(&[0.5, 0.5])).weights;
        let members = weights.into_iter().zip(members).collect();
        let mixture = Mixture { members, recalibration: None };
        let ends_fh = forecast(&mixture, &in_units(&life(Wear::Even, 500)), 1000.0).ends_fh;
        ends_fh.into_iter().map(|end_fh| end_fh.map(|end_fh| scale.time(end_fh) / factor)).collect::<Vec<_>>()
    };
    assert!(forecast_in(64.0) == forecast_in(1.0));
    for (a, b) in forecast_in(3.7).iter().zip(forecast_in(1.0)) {
        let (a, b) = (a.expect("an end"), b.expect("an end"));
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn recalibration_restores_the_coverage_of_an_overconfident_member() {
    let covered = |lives: u64| {
        let teaching = fleet(Wear::Even, lives);
        let Stacked { recalibration, record, .. } = stack(&teaching, &Alone, &settings(&[1.0]));
        let mixture = Mixture { members: vec![(1.0, Box::new(Overconfident) as Box<dyn Estimator>)], recalibration };
        let held = |estimator: &dyn Estimator| {
            let of = |index| {
                let life = life(Wear::Even, index);
                let looks: Vec<f64> = (1..16).map(|look| f64::from(look) / 16.0 * life.end_fh).collect();
                let covered = looks.iter().filter(|now_fh| {
                    metrics::covers(&forecast(estimator, &life, **now_fh).ends_fh, 0.8, life.end_fh - **now_fh)
                });
                covered.count() as f64 / looks.len() as f64
            };
            (2000..2200).map(of).sum::<f64>() / 200.0
        };
        (held(&Overconfident), held(&mixture), record.expect("failures").level_80)
    };
    let (raw, recalibrated, promised) = covered(100);
    assert!(raw < 0.5, "{raw}");
    assert!((0.72..0.88).contains(&recalibrated), "{recalibrated}");
    assert!((0.7..0.9).contains(&promised), "{promised}");
    let (_, with_few, _) = covered(25);
    assert!(with_few > raw + 0.15 && with_few < recalibrated + 0.05, "{with_few}");
}

#[test]
fn removed_lives_lengthen_what_similarity_says_and_teach_nothing_alone() {
    let median = |ending: Ending| {
        let mut lives = fleet(Wear::Sudden, 40);
        // Every other one goes no further than 4000 h.
        for life in lives.iter_mut().step_by(2) {
            (life.end_fh, life.ending) = (4000.0, ending);
            life.observations.retain(|seen| seen.t_fh < 4000.0);
        }
        let both = Both::new();
        let similarity = both.similarity(&lives.iter().collect::<Vec<_>>()).expect("failures");
        let mut ends: Vec<f64> =
            forecast(&similarity, &life(Wear::Sudden, 700), 500.0).ends_fh.into_iter().flatten().collect();
        ends.sort_by(f64::total_cmp);
        ends[ends.len() / 2]
    };
    let [failed, removed] = [Ending::Failed, Ending::Removed].map(median);
    assert!(removed > 1.05 * failed, "{removed} {failed}");
    let lives: Vec<EndedLife> =
        fleet(Wear::Even, 5).into_iter().map(|life| EndedLife { ending: Ending::Removed, ..life }).collect();
    let limits = limits();
    assert_eq!(LevelLives::learn(&lives.iter().collect::<Vec<_>>(), &limits, &[0.0]), Err(NoFailure { lives: 5 }));
}

#[test]
fn what_was_learned_survives_being_written_down() {
    let lives = fleet(Wear::Even, 45);
    let lives: Vec<&EndedLife> = lives.iter().collect();
    let limits = limits();
    let similar = LevelLives::learn(&lives, &limits, &[0.0]).expect("failures");
    let text = serde_json::to_string(&similar).expect("JSON");
    assert_eq!(serde_json::from_str::<LevelLives>(&text).expect("the same"), similar);
    let learned = stacked(&fleet(Wear::Even, 45));
    assert!(learned.recalibration.is_some());
    let text = serde_json::to_string(&learned).expect("JSON");
    assert_eq!(serde_json::from_str::<Stacked>(&text).expect("the same"), learned);
}
