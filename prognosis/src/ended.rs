//! Lives that are over, as a fleet learns from them.

use serde::{Deserialize, Serialize};

use crate::{
    block::Observation,
    pace::PaceLaw,
    wear_clock::{Flight, WearClock},
};

/// How a life ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// A limit was passed, or maintenance found the unit failed.
    Failed,
    /// The unit was taken out before it failed: it would have lived longer (right-censored).
    Removed,
}

/// A life that is over.
#[derive(Debug, Clone, PartialEq)]
pub struct EndedLife {
    /// Its observations, in order.
    pub observations: Vec<Observation>,
    /// What is known of its flights, in order.
    pub flights: Vec<Flight>,
    /// When it ended, hours since its start.
    pub end_fh: f64,
    /// How.
    pub ending: Ending,
}

impl EndedLife {
    /// A life that ended with the last of its observations, in failure, and whose flights those are.
    ///
    /// # Panics
    /// Without observations.
    pub fn failed_at_last(observations: Vec<Observation>) -> Self {
        Self {
            flights: observations.iter().map(Flight::of).collect(),
            end_fh: observations.last().expect("an observation of failure").t_fh,
            ending: Ending::Failed,
            observations,
        }
    }

    /// Whether any of its flights tells of load or temperature.
    pub(crate) fn tells_of_pace(&self) -> bool {
        self.flights.iter().any(|flight| flight.load.is_some() || flight.temperature.is_some())
    }

    /// Its damage-equivalent hours.
    pub(crate) fn clock(&self, law: &PaceLaw) -> WearClock {
        WearClock::new(law, 0.0, &self.flights)
    }

    /// The same in damage-equivalent hours.
    pub fn aged(&self, law: &PaceLaw) -> Self {
        let clock = self.clock(law);
        let worn = |seen: &Observation| Observation { t_fh: clock.worn_h(seen.t_fh), ..seen.clone() };
        Self {
            observations: self.observations.iter().map(worn).collect(),
            end_fh: clock.worn_h(self.end_fh),
            ..self.clone()
        }
    }
}
