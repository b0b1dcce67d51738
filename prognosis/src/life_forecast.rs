//! The forecast of one life by all that its prior holds.
//!
//! - What: draws of the end of life from growth by each law, and from what stands beside growth.
//! - Update rule: the law that weighs most is drawn until it is precise; there are as many draws in all, pooled by
//!   weight, and every figure of the remaining life is of those. What drives the end, how likely life is over already,
//!   and where the boundary was never learned is told by growth.
//! - Requirements: one law without companions gives the draws of its [`forecast`](crate::forecast()).

use numerics::{Stream, apportion};

use crate::{
    boundary::Boundary,
    companions::Companions,
    estimator::PredictionSettings,
    forecast::{Draws, Forecast, ForecastSettings, forecast},
    itinerary::MissionToCome,
    life::Known,
    life_prior::LifePrior,
    pool::Pool,
};

/// Substreams of what is no draw of the law that weighs most.
const OTHERS: u64 = 1 << 32;
/// The substream of missions to come.
const MISSIONS: u64 = OTHERS - 2;

/// The present of a life.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Now {
    /// Hours since the time that what is known belongs to.
    pub lag_fh: f64,
    /// Hours since the life began.
    pub age_fh: f64,
}

impl LifePrior {
    /// Draws the end of a life from what is known of it; the horizon is the prior's.
    pub fn forecast(
        &self,
        known: &Known,
        now: Now,
        boundary: &dyn Boundary,
        missions: Option<&MissionToCome>,
        draws: Draws,
        stream: &Stream,
    ) -> Forecast {
        let until_fh = self.clock().horizon_fh;
        let horizon_fh = missions.map_or(until_fh, |missions| missions.greatest_h(until_fh));
        let settings = ForecastSettings { draws, horizon_fh, ..ForecastSettings::default() };
        let growth = self.growth_forecast(known, now.lag_fh, boundary, &settings, stream);
        let forecast = match &self.companions {
            None => growth,
            Some(companions) => pooled(companions, growth, known, now, &settings, stream),
        };
        match missions {
            None => forecast,
            Some(missions) => missions.flown(forecast, until_fh, &stream.substream(MISSIONS)),
        }
    }

    fn growth_forecast(
        &self,
        known: &Known,
        lag_fh: f64,
        boundary: &dyn Boundary,
        settings: &ForecastSettings,
        stream: &Stream,
    ) -> Forecast {
        let weights: Vec<f64> = known.growth.iter().map(|(weight, _)| *weight).collect();
        let most = (0..weights.len()).fold(0, |best, law| if weights[law] > weights[best] { law } else { best });
        let of_law = |law: usize, draws: Draws, stream: &Stream| {
            let (prior, settings) = (&self.growth.laws[law].prior, ForecastSettings { draws, ..*settings });
            forecast(&known.growth[law].1, lag_fh, boundary, prior.failure_time_error, &settings, stream)
        };
        let mut leading = of_law(most, settings.draws, stream);
        if weights.len() == 1 {
            return leading;
        }
        let counts = apportion(&weights, leading.ends_fh.len());
        leading.truncate(counts[most]);
        let others = counts.iter().enumerate().filter(|(law, count)| *law != most && **count > 0);
        for (law, count) in others {
            leading.append(of_law(law, Draws::fixed(*count), &stream.substream(OTHERS + law as u64)));
        }
        let mut ends_fh = leading.ends_fh.clone();
        // Any run of them is to be like the whole.
        Stream::new(0, &["laws"]).shuffle(&mut ends_fh);
        leading.with_ends(ends_fh, settings.horizon_fh)
    }
}

/// As many draws as growth has, of all members.
fn pooled(
    companions: &Companions,
    growth: Forecast,
    known: &Known,
    now: Now,
    settings: &ForecastSettings,
    stream: &Stream,
) -> Forecast {
    let Companions { similar, climatology, stacked } = companions;
    let pool = Pool { weights: &stacked.weights, recalibration: stacked.recalibration.as_ref() };
    let ends_fh = pool.sample(growth.ends_fh.len(), settings.horizon_fh, |member, draws| {
        let asked = PredictionSettings { draws, horizon_fh: settings.horizon_fh };
        match member {
            0 => growth.ends_fh[..draws].to_vec(),
            1 => {
                let mut stream = stream.substream(OTHERS - 1);
                similar.ends_fh(known.level, now.age_fh, &asked, &mut stream)
            }
            _ => climatology.ends_fh(now.age_fh, &asked),
        }
    });
    growth.with_ends(ends_fh, settings.horizon_fh)
}
