//! Made-up lives of faults of an own diagnosis: one on its way to the limits, and one beyond them.

use domain::{
    Diagnosis, Estimate, FaultMeasure, FaultVector, NUMERICS_VERSION, Outcome, Timestamp, prognosis::Forecast,
};
use numerics::Stream;

use super::{RehearsalError, words};
use crate::Model;

/// Uploads of a life.
const UPLOADS: u32 = 60;
/// Share of the way to the limits, and of a characteristic life, of the unit that goes on and of the one that is over.
const ON_ITS_WAY: f64 = 0.5;
const OVER: f64 = 1.6;

impl Model {
    /// Forecasts of lives that go straight to their limits.
    pub(super) fn look_ahead_of_own(&self, measure: &FaultMeasure) -> Result<(), RehearsalError> {
        let refuse = |life, found: String| Err(RehearsalError::Forecast { life, found });
        let on_its_way = self.on_the_way(measure, ON_ITS_WAY)?;
        let median = on_its_way.rul.quantile_fh(0.5);
        if on_its_way.probability_failed > 0.4 || median.is_none_or(|fh| fh.is_nan() || fh <= 0.0) {
            return refuse("halfway to its limits", words(&on_its_way));
        }
        let over = self.on_the_way(measure, OVER)?;
        if over.probability_failed < 0.6 {
            return refuse("beyond its limits", words(&over));
        }
        Ok(())
    }

    /// The forecast of a life that has gone so much of its way in as many characteristic lives.
    fn on_the_way(&self, measure: &FaultMeasure, share: f64) -> Result<Forecast, RehearsalError> {
        let mut stream = Stream::new(1, &["rehearsal", "own faults"]);
        let history: Vec<Estimate> = (1..=UPLOADS)
            .map(|number| {
                let share = share * f64::from(number) / f64::from(UPLOADS);
                self.own_estimate(measure, number, share, &mut stream)
            })
            .collect();
        self.forecast_of(&history)
    }

    fn own_estimate(&self, measure: &FaultMeasure, number: u32, share: f64, stream: &mut Stream) -> Estimate {
        let ways = self.bundle.faults.nominal.iter().zip(&measure.limits).zip(&measure.sigma);
        let seen = |((nominal, limit), sigma): ((&f64, &f64), &f64)| {
            nominal + share * (limit - nominal) + sigma * stream.normal()
        };
        let fault_vector = FaultVector(ways.map(seen).collect());
        let flight_hours = share * measure.characteristic_life_fh;
        Estimate {
            upload_id: format!("rehearsal-{number:04}").parse().expect("a name"),
            flight_hours,
            recorded_at: Timestamp::from_micros(0).plus_hours(3.0 * flight_hours),
            mask_id: None,
            model: self.hash,
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome: Outcome::Diagnosed(Diagnosis { fault_vector, sigma: measure.sigma.clone(), fit: None }),
            load: None,
            temperature: None,
            load_ratio: None,
            on_ground: false,
        }
    }
}
