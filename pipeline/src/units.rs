//! Between what uploads count in and what a prior does.
//!
//! - What: hours and faults of a fleet's own diagnosis in reference hours and reference deviations, and back.
//! - Update rule: a straight line for each fault and for time ([`Scale`]). What maps tell is counted the same by both,
//!   to the last bit.
//! - Requirements: a limit of each fault that differs from what is nominal.

use domain::{
    FaultModel, FaultTrend, FaultVector, Propagation,
    explanation::{Growth, GrowthChange, Surprise},
};
use numerics::normal;
use prognosis::{
    Observation, REFERENCE_LIFE_FH, REFERENCE_LIMIT, Scale,
    forecast::Forecast,
    scale::{reference_deviation, reference_faults},
};

use crate::{Assessment, Bundle};

/// What uploads of a bundle count in.
#[derive(Debug)]
pub(crate) enum Units {
    /// What its prior counts in, too.
    OfPrior,
    /// Units of their own.
    Own {
        /// The measure of time.
        scale: Scale,
        /// Of each fault.
        ways: Vec<Way>,
    },
}

/// From nominal to the limit, in the fault's own unit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    nominal: f64,
    limit: f64,
}

impl Way {
    /// The whole way; negative where the limit lies below.
    fn length(self) -> f64 {
        self.limit - self.nominal
    }

    /// A difference in reference deviations as one in the fault's unit.
    fn difference(self, reference: f64) -> f64 {
        reference / REFERENCE_LIMIT * self.length()
    }

    fn value(self, deviation: f64) -> f64 {
        self.nominal + self.difference(deviation)
    }
}

impl Units {
    /// Those of a bundle, with its faults as the prior counts them.
    pub fn of(bundle: &Bundle) -> (Self, FaultModel) {
        match &bundle.assessment {
            Assessment::Maps(_) => (Self::OfPrior, bundle.faults.clone()),
            Assessment::Own(measure) => {
                let ways = bundle.faults.nominal.iter().zip(&measure.limits);
                let ways = ways.map(|(nominal, limit)| Way { nominal: *nominal, limit: *limit }).collect();
                let scale = Scale { characteristic_life: measure.characteristic_life_fh };
                (Self::Own { scale, ways }, reference_faults(bundle.faults.names.clone()))
            }
        }
    }

    /// Whether they are not those of the prior.
    pub fn are_own(&self) -> bool {
        matches!(self, Self::Own { .. })
    }

    /// Flight hours as the prior counts them.
    pub fn reference_fh(&self, flight_hours: f64) -> f64 {
        match self {
            Self::OfPrior => flight_hours,
            Self::Own { scale, .. } => scale.reference_fh(flight_hours),
        }
    }

    /// Flight hours, of such as the prior counts.
    pub fn flight_hours(&self, reference_fh: f64) -> f64 {
        match self {
            Self::OfPrior => reference_fh,
            Self::Own { scale, .. } => scale.time(reference_fh),
        }
    }

    /// An observation as the prior counts.
    pub fn observation(&self, seen: Observation) -> Observation {
        let Self::Own { scale, ways } = self else { return seen };
        let deviations = ways.iter().zip(seen.fault_vector.values());
        let deviations = deviations.map(|(way, value)| reference_deviation((value - way.nominal) / way.length()));
        let sigma = ways.iter().zip(&seen.sigma).map(|(way, sigma)| sigma / way.length().abs() * REFERENCE_LIMIT);
        Observation {
            t_fh: scale.reference_fh(seen.t_fh),
            fault_vector: FaultVector(deviations.collect()),
            sigma: sigma.collect(),
            ..seen
        }
    }

    /// Filtered faults in their own units.
    pub fn trends(&self, mut trends: Vec<FaultTrend>) -> Vec<FaultTrend> {
        let Self::Own { ways, .. } = self else { return trends };
        for (trend, way) in trends.iter_mut().zip(ways) {
            trend.value = way.value(trend.value);
            trend.sigma = way.difference(trend.sigma).abs();
            trend.trend_per_1000_fh = way.difference(trend.trend_per_1000_fh) * self.reference_hours_an_hour();
        }
        trends
    }

    /// The propagation model in the faults' own units, per flight hour.
    pub fn propagation(&self, mut propagation: Propagation) -> Propagation {
        let Self::Own { ways, .. } = self else { return propagation };
        let hours = self.reference_hours_an_hour();
        for (i, way) in ways.iter().enumerate() {
            let of_row = |rates: &mut Vec<Vec<f64>>, factor: &dyn Fn(usize) -> f64| {
                rates[i].iter_mut().enumerate().for_each(|(j, rate)| *rate *= hours * factor(j));
            };
            let between = |j: usize| way.length() / ways[j].length();
            of_row(&mut propagation.state_matrix, &between);
            of_row(&mut propagation.state_matrix_sigma, &|j| between(j).abs());
            of_row(&mut propagation.control_matrix, &|_| way.difference(1.0));
            of_row(&mut propagation.control_matrix_sigma, &|_| way.difference(1.0).abs());
        }
        propagation
    }

    /// How growth has changed, in flight hours.
    pub fn growth(&self, growth: Option<Growth>) -> Option<Growth> {
        let in_hours = |change: GrowthChange| GrowthChange {
            from_fh: self.flight_hours(change.from_fh),
            to_fh: self.flight_hours(change.to_fh),
            ..change
        };
        growth.map(|growth| Growth { latest_change: growth.latest_change.map(in_hours), ..growth })
    }

    /// Draws of the end of life in flight hours.
    pub fn forecast(&self, mut draws: Forecast) -> Forecast {
        let ends = draws.ends_fh.iter_mut().chain([&mut draws.p10_error_fh, &mut draws.median_error_fh]);
        ends.flatten().for_each(|hours| *hours = self.flight_hours(*hours));
        draws
    }

    /// The probability that a life with these faults, told in their own units, has failed by itself: some fault is
    /// beyond its limit, which is what failure is, however late past lives were seen to pass it. `None` where a
    /// surrogate tells it.
    pub fn probability_beyond(&self, faults: &[FaultTrend]) -> Option<f64> {
        let Self::Own { ways, .. } = self else { return None };
        let beyond = |(fault, way): (&FaultTrend, &Way)| {
            normal::cumulative((fault.value - way.limit) * way.length().signum() / fault.sigma)
        };
        Some(faults.iter().zip(ways).map(beyond).fold(0.0, f64::max))
    }

    /// A surprise in the unit of its fault, the `index`-th; it is positive where the value is higher than expected.
    pub fn surprise(&self, index: usize, surprise: Surprise) -> Surprise {
        let Self::Own { ways, .. } = self else { return surprise };
        let way = ways[index];
        Surprise {
            expected: way.value(surprise.expected),
            seen: way.value(surprise.seen),
            z: surprise.z * way.length().signum(),
            ..surprise
        }
    }

    fn reference_hours_an_hour(&self) -> f64 {
        match self {
            Self::OfPrior => 1.0,
            Self::Own { scale, .. } => REFERENCE_LIFE_FH / scale.characteristic_life,
        }
    }
}
