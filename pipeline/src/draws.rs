//! Draws of the end of a life from what is known of it.

use domain::{Estimate, Life};
use numerics::Stream;
use prognosis::{
    Known, Now,
    forecast::{Draws, Forecast},
};

use crate::{LifeContext, Model};

/// Seed of every draw; the natural key tells lives and uploads apart.
pub(crate) const SEED: u64 = 1;

/// Draws of a state's quantiles and of its shift: they make the history chart, nobody acts on them.
pub(crate) const FEW: Draws = Draws::fixed(200);

impl Model {
    /// Ends of life beyond are censored, flight hours from the newest data.
    pub(crate) fn horizon_fh(&self, context: &LifeContext) -> f64 {
        self.units.flight_hours(context.prior.body.clock().horizon_fh)
    }

    /// Draws of the end of life, counted from `newest`; random numbers are those of the upload of `key`.
    pub(crate) fn draw(
        &self,
        context: &LifeContext,
        known: &Known,
        newest: &Estimate,
        key: &Estimate,
        draws: Draws,
    ) -> Forecast {
        let Life { component, overhaul_index } = context.life;
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
        let now = Now { lag_fh: newest_fh - known.t_fh(), age_fh: newest_fh - began_fh };
        self.units.forecast(context.prior.body.forecast(known, now, self.boundary(), draws, &stream))
    }
}
