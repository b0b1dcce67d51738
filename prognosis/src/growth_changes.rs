//! Lives whose growth changes.
//!
//! - What: the law of a growth multiplier g that is common to all faults of a life, in
//!   x' = g lambda x + b + noise.
//! - Update rule: g is one for good, or starts low and is multiplied by min(1 + E, cap) at the events of
//!   a Poisson process, E exponential.
//! - Requirements: changes are upwards and sudden; what makes a fault grow by itself changes, what drives
//!   it from outside does not.
//! - Source: jump Markov systems; Doucet, Gordon, Krishnamurthy 2001.

use numerics::Stream;
use serde::{Deserialize, Deserializer, Serialize, de::Error};

/// Shortest mean time between changes that is read, flight hours: a life of more of them is followed for ever.
const SHORTEST_INTERVAL_FH: f64 = 1.0;

/// The law of growth changes of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GrowthChanges {
    /// Probability that the growth of a life changes at all.
    pub probability: f64,
    /// Growth multiplier at the start of a life whose growth changes.
    pub start: f64,
    /// Mean time between changes, flight hours; above zero, and an hour or more where it is read from a file.
    #[serde(deserialize_with = "interval_fh")]
    pub interval_fh: f64,
    /// Mean of E.
    pub mean_increase: f64,
    /// Largest factor of one change.
    pub largest_factor: f64,
    /// Hypotheses about the growth so far that a filter follows, besides that of no change.
    pub particles: usize,
}

fn interval_fh<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let interval_fh = f64::deserialize(deserializer)?;
    if interval_fh >= SHORTEST_INTERVAL_FH {
        Ok(interval_fh)
    } else {
        Err(D::Error::custom(format!("growth that changes every {interval_fh} h")))
    }
}

impl Default for GrowthChanges {
    /// Every second life changes, every 2,100 h, by a factor of 1.9 on average.
    fn default() -> Self {
        Self {
            probability: 0.5,
            start: 0.75,
            interval_fh: 2100.0,
            mean_increase: 1.0,
            largest_factor: 3.0,
            particles: 29,
        }
    }
}

impl GrowthChanges {
    /// Draws the time to the next change, flight hours.
    pub(crate) fn wait_fh(&self, stream: &mut Stream) -> f64 {
        self.interval_fh * stream.exponential()
    }

    /// Draws the factor of a change.
    pub(crate) fn factor(&self, stream: &mut Stream) -> f64 {
        f64::min(1.0 + self.mean_increase * stream.exponential(), self.largest_factor)
    }

    /// Draws the factor of all changes within `dt_h` hours.
    pub(crate) fn factor_within(&self, dt_h: f64, stream: &mut Stream) -> f64 {
        let (mut factor, mut at_h) = (1.0, self.wait_fh(stream));
        while at_h < dt_h {
            factor *= self.factor(stream);
            at_h += self.wait_fh(stream);
        }
        factor
    }
}

/// The changes to come of one life.
#[derive(Debug, Clone)]
pub struct ChangesToCome {
    law: GrowthChanges,
    stream: Stream,
    next_fh: f64,
}

impl ChangesToCome {
    /// The changes from now on, by random numbers of their own.
    pub fn new(law: GrowthChanges, stream: &Stream) -> Self {
        let mut stream = stream.substream(0);
        let next_fh = law.wait_fh(&mut stream);
        Self { law, stream, next_fh }
    }

    /// The time at which the next one comes, hours from now.
    pub fn next_fh(&self) -> f64 {
        self.next_fh
    }

    /// Makes the next one, and says by what it multiplies the growth.
    pub fn make(&mut self) -> f64 {
        let factor = self.law.factor(&mut self.stream);
        self.next_fh += self.law.wait_fh(&mut self.stream);
        factor
    }
}
