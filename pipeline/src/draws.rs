//! Draws of the end of a life from what is known of it.

use domain::{
    Ahead, Estimate,
    ahead::{LoadAhead, Stretch, TemperatureAhead},
};
use numerics::Stream;
use prognosis::{
    Change, Known, MissionToCome, Now, Told,
    forecast::{Draws, Forecast},
};

use crate::{Course, LifeContext, Model};

/// Seed of every draw; the natural key tells lives and uploads apart.
pub(crate) const SEED: u64 = 1;

/// Draws of a state's quantiles and of its shift: they make the history chart, nobody acts on them.
pub(crate) const FEW: Draws = Draws::fixed(200);

/// A life whose end is drawn.
#[derive(Clone, Copy)]
pub(crate) struct Life<'a> {
    pub context: &'a LifeContext<'a>,
    pub course: &'a Course,
    /// What is told of its flights to come.
    pub ahead: &'a Ahead,
}

impl Model {
    /// Ends of life beyond are censored, flight hours from the newest data.
    pub(crate) fn horizon_fh(&self, context: &LifeContext) -> f64 {
        self.units.flight_hours(context.prior.body.clock().horizon_fh)
    }

    /// Draws of the end of life, counted from `newest`; random numbers are those of the upload of `key`.
    pub(crate) fn draw(
        &self,
        of: &Life<'_>,
        known: &Known,
        newest: &Estimate,
        key: &Estimate,
        draws: Draws,
    ) -> Forecast {
        let Life { context, course, ahead } = of;
        let domain::Life { component, overhaul_index } = context.life;
        let stream = Stream::new(
            SEED,
            &[
                component.operator.as_str(),
                component.part_number.as_str(),
                component.serial_number.as_str(),
                &overhaul_index.to_string(),
                key.upload_id.as_str(),
            ],
        );
        let [newest_fh, began_fh] = [newest.flight_hours, context.began_fh].map(|fh| self.units.reference_fh(fh));
        let missions = self.missions(context, course, newest_fh, ahead);
        let newest_h = course.wear_clock.as_ref().map_or(newest_fh, |clock| clock.worn_h(newest_fh));
        let now = Now { lag_fh: newest_h - known.t_fh(), age_fh: newest_h - began_fh };
        let prior = &context.prior.body;
        self.units.forecast(prior.forecast(known, now, self.boundary(), missions.as_ref(), draws, &stream))
    }

    /// The missions to come by some time, as priors count; `None` where nobody knows the pace of wear.
    pub(crate) fn missions<'a>(
        &self,
        context: &LifeContext<'a>,
        course: &Course,
        now_fh: f64,
        ahead: &Ahead,
    ) -> Option<MissionToCome<'a>> {
        let (law, clock) = (context.prior.body.pace.as_ref()?, course.wear_clock.as_ref()?);
        Some(MissionToCome::new(law, clock, now_fh, self.told(ahead)))
    }

    /// What is told of the flights ahead, as priors count.
    fn told(&self, ahead: &Ahead) -> Vec<Told> {
        let references = self.bundle.loads.as_ref().map(|loads| &loads.references);
        let told = |stretch: &Stretch| Told {
            from_fh: self.units.reference_fh(stretch.from_fh),
            load: stretch.load.map(|load| match load {
                LoadAhead::Times(factor) => Change::Relative(factor),
                LoadAhead::Ratio(ratio) => Change::To(ratio),
            }),
            temperature: stretch.temperature.zip(references).map(|(temperature, references)| match temperature {
                TemperatureAhead::Above(kelvin) => Change::Relative(kelvin / references.temperature_scale_k),
                TemperatureAhead::Celsius(celsius) => Change::To(references.temperature(celsius)),
            }),
        };
        ahead.stretches.iter().map(told).collect()
    }
}
