//! Load and temperature turned into wear, on flights and fleets that are known.

use domain::FaultModel;
use numerics::Stream;
use prognosis::{
    Change, Coefficient, Coordinate, EndedLife, Ending, FleetPrior, Flight, LifePrior, MissionToCome, Observation,
    PaceLaw, PaceLesson, Told, WearClock, learn_from_ended,
};
use proptest::prelude::*;

use crate::simulated::{self, STEP_FH, observe};

fn law(exponent: f64, temperature: f64) -> PaceLaw {
    let known = |mean| Coefficient { mean, sd: 0.0 };
    PaceLaw::told(known(exponent), known(temperature))
}

fn flight(t_fh: f64, load: f64) -> Flight {
    Flight { t_fh, load: Some(load), temperature: None, by_motor: false }
}

#[test]
fn hours_at_the_reference_are_hours() {
    let flights: Vec<Flight> = (1..500).map(|i| flight(3.7 * f64::from(i), 1.0)).collect();
    let clock = WearClock::new(&law(2.0, 0.3), 0.0, &flights);
    for t_fh in [0.0, 1.0, 500.3, 1846.3, 3000.0] {
        assert!((clock.worn_h(t_fh) - t_fh).abs() < 1e-9, "{t_fh}: {}", clock.worn_h(t_fh));
    }
}

#[test]
fn a_flight_stands_for_the_hours_since_the_one_before_and_a_gap_for_the_mean() {
    let mut flights: Vec<Flight> = (0..100).map(|i| flight(10.0 + 4.0 * f64::from(i), 2.0)).collect();
    let clock = WearClock::new(&law(2.0, 0.0), 0.0, &flights);
    // The hours before the first flight are as those of the first 200.
    assert!((clock.worn_h(10.0) - 40.0).abs() < 1e-9);
    assert!((clock.worn_h(406.0) - 4.0 * 406.0).abs() < 1e-9);
    // 300 hours without a flight have the mean pace, whatever the flight behind them; then it stands for itself.
    flights.push(flight(706.0, 1.0));
    flights.push(flight(710.0, 1.0));
    let clock = WearClock::new(&law(2.0, 0.0), 0.0, &flights);
    assert!((clock.worn_h(706.0) - 4.0 * 706.0).abs() < 1e-9);
    assert!((clock.worn_h(710.0) - clock.worn_h(706.0) - 4.0).abs() < 1e-9);
    let life = clock.life(710.0);
    assert!((life.known_share - 400.0 / 710.0).abs() < 1e-9 && life.clamped_share == 0.0, "{life:?}");
}

#[test]
fn what_is_not_known_of_a_flight_is_as_before_and_extremes_are_taken_at_the_edge() {
    let unknown = Flight { load: None, temperature: Some(1.0), ..flight(8.0, 0.0) };
    let flights = [flight(4.0, 1.5), unknown, flight(12.0, 1e9), flight(16.0, 0.0)];
    let law = law(2.0, 0.3);
    let clock = WearClock::new(&law, 0.0, &flights);
    let step = |t_fh: f64| clock.worn_h(t_fh) - clock.worn_h(t_fh - 4.0);
    assert!((step(8.0) - 4.0 * law.pace(1.5, 1.0)).abs() < 1e-9);
    assert!((step(12.0) - 80.0).abs() < 1e-9, "a pace of 20 at most: {}", step(12.0));
    assert!((step(16.0) - 4.0 * law.pace(0.2, 1.0)).abs() < 1e-9);
    assert!((clock.life(16.0).clamped_share - 0.5).abs() < 1e-9);
}

fn flights() -> impl Strategy<Value = Vec<Flight>> {
    let one = (0u8..12, prop::option::of(0.05..6.0f64), prop::option::of(-2.0..2.0f64));
    prop::collection::vec(one, 1..150).prop_map(|all| {
        let mut t_fh = 0.0;
        let next = |(gap, load, temperature): (u8, Option<f64>, Option<f64>)| {
            t_fh += match gap {
                0..3 => 0.0,
                11 => 150.0,
                gap => f64::from(gap),
            };
            Flight { t_fh, load, temperature, by_motor: false }
        };
        all.into_iter().map(next).collect()
    })
}

proptest! {
    #[test]
    fn wear_goes_on_with_the_hours_and_back(flights in flights(), began_fh in 0.0..50.0f64, at in 0.0..2.0f64) {
        let flights: Vec<Flight> =
            flights.into_iter().map(|flight| Flight { t_fh: flight.t_fh + began_fh, ..flight }).collect();
        let clock = WearClock::new(&law(2.0, 0.4), began_fh, &flights);
        let last_fh = flights[flights.len() - 1].t_fh;
        let t_fh = began_fh + at * (last_fh - began_fh + 1.0);
        let worn_h = clock.worn_h(t_fh);
        prop_assert!(worn_h.is_finite() && worn_h >= began_fh - 1e-9);
        prop_assert!(clock.worn_h(t_fh + 1.0) > worn_h);
        prop_assert!((clock.flight_hours(worn_h) - t_fh).abs() < 1e-6 * (1.0 + t_fh));
    }

    /// What comes later changes nothing before it, but for the hours before the first flight.
    #[test]
    fn what_was_is_not_changed_by_what_comes(flights in flights(), cut in 0.0..1.0f64) {
        let settled = flights.iter().find(|f| f.load.is_some() || f.temperature.is_some()).map(|f| f.t_fh + 200.0);
        let count = (cut * flights.len() as f64) as usize;
        let known = flights[..count].last().filter(|last| settled.is_some_and(|settled| last.t_fh > settled));
        if let Some(last) = known {
            let [whole, part] = [&flights[..], &flights[..count]].map(|flights| WearClock::new(&law(2.0, 0.4), 0.0, flights));
            let told = flights[..count].iter().rev().find(|f| f.load.is_some() || f.temperature.is_some());
            // Flights of equal hours share them, whether they are known yet or not.
            let shared = flights[count..].first().is_some_and(|next| next.t_fh == last.t_fh);
            let until_fh = told.map_or(0.0, |told| told.t_fh);
            if !shared {
                for t_fh in flights[..count].iter().map(|f| f.t_fh).filter(|t_fh| *t_fh <= until_fh) {
                    prop_assert_eq!(whole.worn_h(t_fh).to_bits(), part.worn_h(t_fh).to_bits());
                }
            }
        }
    }
}

/// Lives of a fleet that wears by damage-equivalent hours with this exponent, flown at loads of their own.
fn fleet(exponent: f64, seed: u64, count: u64) -> Vec<EndedLife> {
    let prior = FleetPrior { process_noise: 5e-5, ..FleetPrior::vague() };
    let life = |index: u64| {
        let mut random = Stream::new(seed, &["paced fleet"]).substream(index);
        let path = simulated::Growth::draw(&prior, &mut random).path(8000.0, &mut random);
        let failed = path.iter().position(|x| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0)?;
        let mean = libm::exp(0.3 * random.normal());
        let (mut t_fh, mut flights) = (0.0, Vec::new());
        let law = law(exponent, 0.0);
        for _ in 0..=failed {
            let load = mean * libm::exp(0.15 * random.normal());
            flights.push(flight(t_fh, load));
            t_fh += STEP_FH / law.pace(load, 0.0);
        }
        let observations = observe(&path[..=failed], 0.2, &mut random).into_iter().zip(&flights);
        let observations: Vec<Observation> =
            observations.map(|(seen, flight)| Observation { t_fh: flight.t_fh, load: flight.load, ..seen }).collect();
        let end_fh = observations[failed].t_fh;
        Some(EndedLife { observations, flights, end_fh, ending: Ending::Failed })
    };
    (0..count).filter_map(life).collect()
}

fn learned(lives: &[EndedLife]) -> PaceLesson {
    let prior = FleetPrior { process_noise: 5e-5, ..FleetPrior::vague() };
    let lesson = PaceLaw::learn(lives, &FaultModel::electrical(), (Coordinate::IDENTITY, &prior), None);
    lesson.expect("lives that tell of load")
}

#[test]
fn the_exponent_is_learned_where_load_acts_and_not_believed_where_it_does_not() {
    let PaceLesson { law, gain } = learned(&fleet(2.0, 3, 20));
    println!("load acts: {:?}, {gain:.1} nats", law.exponent);
    assert!((law.exponent.mean - 2.0).abs() < 0.35 && gain > 20.0, "{law:?}, {gain}");
    assert!(law.exponent.sd > 0.01 && law.exponent.sd < 0.4, "{law:?}");
    let lesson = learned(&fleet(0.0, 4, 20));
    println!("it does not: {:?}, {:.1} nats", lesson.law.exponent, lesson.gain);
    assert!(!lesson.is_believed() && lesson.law.exponent.mean.abs() < 0.3, "{lesson:?}");
}

#[test]
fn lives_without_load_teach_the_same_prior_as_ever() {
    let blind: Vec<EndedLife> =
        fleet(2.0, 5, 6).into_iter().map(|life| EndedLife { flights: Vec::new(), ..life }).collect();
    let parent = LifePrior::from(FleetPrior { process_noise: 5e-5, ..FleetPrior::vague() });
    let learned = learn_from_ended(&parent, &blind, &FaultModel::electrical(), &Sum, 1).unwrap();
    assert_eq!(learned.pace, None);
}

/// What was told stays until lives tell something else clearly.
#[test]
fn engineering_values_stay_until_lives_tell_others_clearly() {
    let told = |mean| PaceLaw { exponent: Coefficient { mean, sd: 0.5 }, ..law(mean, 0.0) };
    let learned = |mean: f64, lives: &[EndedLife]| {
        let fleet = FleetPrior { process_noise: 5e-5, ..FleetPrior::vague() };
        let parent = LifePrior { pace: Some(told(mean)), ..fleet.into() };
        learn_from_ended(&parent, lives, &FaultModel::electrical(), &Sum, 1).unwrap().pace.unwrap()
    };
    let lives = fleet(2.0, 3, 12);
    assert_eq!(learned(1.9, &lives).exponent, told(1.9).exponent, "these lives agree with it");
    let corrected = learned(0.5, &lives).exponent;
    println!("{corrected:?}");
    assert!((corrected.mean - 2.0).abs() < 0.5, "{corrected:?}");
}

/// Margin 1 - 8 sum |x|.
struct Sum;

impl prognosis::Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

/// Mean flight hours of a damage-equivalent time to come.
fn mean_fh(missions: &MissionToCome, worn_h: f64) -> f64 {
    let stream = Stream::new(1, &["missions"]);
    let ends = missions.flight_hours(&vec![Some(worn_h); 400], f64::INFINITY, &stream);
    ends.into_iter().flatten().sum::<f64>() / 400.0
}

#[test]
fn missions_go_on_unless_something_else_is_told() {
    let law = law(2.0, 0.3);
    let flights: Vec<Flight> = (0..500).map(|i| flight(4.0 * f64::from(i), 1.2)).collect();
    let clock = WearClock::new(&law, 0.0, &flights);
    let told = |told: &[Told]| MissionToCome::new(&law, &clock, 1996.0, told.to_vec());
    let change = |from_fh, load, temperature| Told { from_fh, load, temperature };
    let goes_on = told(&[]);
    assert!((goes_on.pace_now() - 1.44).abs() < 0.02, "{}", goes_on.pace_now());
    let usual_fh = mean_fh(&goes_on, 1440.0);
    assert!((usual_fh / 1000.0 - 1.0).abs() < 0.1, "{usual_fh}");
    let harder = told(&[change(0.0, Some(Change::Relative(1.5)), None)]);
    assert!((mean_fh(&harder, 1440.0) * 2.25 / usual_fh - 1.0).abs() < 0.05);
    let exactly = told(&[change(0.0, Some(Change::To(1.0)), Some(Change::To(0.0)))]);
    assert!((mean_fh(&exactly, 1440.0) - 1440.0).abs() < 15.0, "{}", mean_fh(&exactly, 1440.0));
    let later = told(&[change(500.0, Some(Change::To(0.6)), None)]);
    let expected_fh = 500.0 + (1440.0 - 720.0) / 0.36;
    assert!((mean_fh(&later, 1440.0) / expected_fh - 1.0).abs() < 0.1, "{}", mean_fh(&later, 1440.0));
    let warmer = told(&[change(0.0, None, Some(Change::Relative(1.0)))]);
    assert!((mean_fh(&warmer, 1440.0) * libm::exp(0.3) / usual_fh - 1.0).abs() < 0.05);
}

/// A load of nothing, flown or told, is taken at the edge: every draw has its end.
#[test]
fn a_load_of_nothing_leaves_no_draw_without_an_end() {
    let law = PaceLaw { exponent: Coefficient { mean: 2.0, sd: 0.5 }, ..law(2.0, 0.3) };
    for flown in [0.0, 1.0] {
        let flights: Vec<Flight> = (0..100).map(|i| flight(4.0 * f64::from(i), flown)).collect();
        let clock = WearClock::new(&law, 0.0, &flights);
        for to in [0.0, 0.1, 1.0, 20.0] {
            let told = vec![Told { from_fh: 0.0, load: Some(Change::To(to)), temperature: None }];
            let missions = MissionToCome::new(&law, &clock, 396.0, told);
            let ends = missions.flight_hours(&[Some(10.0); 200], f64::INFINITY, &Stream::new(3, &["nothing"]));
            assert!(ends.iter().all(|end| end.is_some_and(f64::is_finite)), "{flown} and {to}: {ends:?}");
        }
    }
}

#[test]
fn a_factor_whose_exponent_is_not_known_well_makes_forecasts_wide() {
    let flights: Vec<Flight> = (0..500).map(|i| flight(4.0 * f64::from(i), 1.0)).collect();
    let spread = |sd: f64| {
        let law = PaceLaw { exponent: Coefficient { mean: 2.0, sd }, ..law(2.0, 0.3) };
        let clock = WearClock::new(&law, 0.0, &flights);
        let harder = vec![Told { from_fh: 0.0, load: Some(Change::Relative(2.0)), temperature: None }];
        let missions = MissionToCome::new(&law, &clock, 1996.0, harder);
        let stream = Stream::new(2, &["wide"]);
        let mut ends: Vec<f64> =
            missions.flight_hours(&vec![Some(1000.0); 400], f64::INFINITY, &stream).into_iter().flatten().collect();
        ends.sort_by(f64::total_cmp);
        ends[360] / ends[40]
    };
    assert!(spread(0.5) > 1.2 * spread(0.0), "{} and {}", spread(0.5), spread(0.0));
}
