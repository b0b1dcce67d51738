//! How well loads are estimated in fresh random flights: surfaces 15 % off, gusts that no vane sees,
//! 2 % gain noise, -60 to 25 K, and a failed grating in 30 % of flights.

use crate::cases::{self, quantile};
use airframe::{
    LoadEstimator, LoadReading,
    flight::{Flight, FlightSettings},
};
use domain::sensor_configuration::{Side, Surface};
use numerics::Stream;

const FLIGHTS: u64 = 4000;
/// Full-scale moment of flap and aileron, N m.
const FULL_SCALE_NM: [f64; 2] = [553.0, 293.0];

/// What a layout is to reach; errors in percent of full scale, flap and aileron.
struct Goals {
    layout: &'static str,
    median_percent: [f64; 2],
    p95_percent: [f64; 2],
}

#[derive(Default)]
struct Tally {
    errors_percent: [Vec<f64>; 2],
    within_two_sigma: [usize; 2],
    failed: usize,
    named: usize,
    falsely_accused: usize,
}

impl Tally {
    fn fly(&mut self, estimator: &LoadEstimator, flight: &Flight) {
        let reading = LoadReading { strain: Some(&flight.strain), air_data: Some(&flight.air_data), recorded_at: None };
        let found = estimator.estimate(&reading).expect("air data");
        let truth = [(Surface::Flap, flight.right.flap_nm), (Surface::Aileron, flight.right.aileron_nm)];
        for (i, (surface, truth_nm)) in truth.into_iter().enumerate() {
            let moment = estimator.hinge_moment(&found, surface, Side::Right).expect("a moment");
            let error_nm = moment.moment_nm - truth_nm;
            self.errors_percent[i].push(100.0 * error_nm / FULL_SCALE_NM[i]);
            self.within_two_sigma[i] += usize::from(error_nm.abs() <= 2.0 * moment.sigma_nm);
        }
        let failed = flight.failure.map(|(sensor, _)| sensor as u8);
        self.failed += usize::from(failed.is_some());
        self.named += usize::from(failed.is_some_and(|failed| found.excluded_sensors.contains(&failed)));
        self.falsely_accused += usize::from(found.excluded_sensors.iter().any(|sensor| Some(*sensor) != failed));
    }
}

#[test]
fn fresh_flights_are_read_as_well_as_they_should() {
    let goals = [
        Goals { layout: "A", median_percent: [1.8, 1.8], p95_percent: [8.0, 8.0] },
        Goals { layout: "D", median_percent: [0.8, 0.45], p95_percent: [3.5, 2.0] },
    ];
    for Goals { layout, median_percent, p95_percent } in goals {
        let estimator = cases::estimator(&cases::parameters(&cases::folder(), &format!("{layout}_faulty")), None);
        let mut tally = Tally::default();
        for flight in 0..FLIGHTS {
            let stream = Stream::new(flight, &["load goals"]);
            tally.fly(&estimator, &Flight::draw(estimator.configuration(), &FlightSettings::hard(), None, &stream));
        }
        for i in 0..2 {
            let [median, p95] = [0.5, 0.95].map(|share| quantile(&tally.errors_percent[i], share));
            assert!(median < median_percent[i] && p95 < p95_percent[i], "layout {layout}: {median:.2}, {p95:.2}");
            let coverage = tally.within_two_sigma[i] as f64 / FLIGHTS as f64;
            assert!((0.93..=0.99).contains(&coverage), "layout {layout}: 2-sigma coverage {coverage}");
        }
        let named = tally.named as f64 / tally.failed as f64;
        let falsely = tally.falsely_accused as f64 / FLIGHTS as f64;
        assert!(named >= 0.88 && falsely <= 0.015, "layout {layout}: named {named}, falsely {falsely}");
    }
}
