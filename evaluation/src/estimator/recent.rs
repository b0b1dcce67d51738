//! The last observations of a life, for estimators that look no farther back.

use std::collections::VecDeque;

use prognosis::Observation;

/// How far back they look, flight hours (Berri 2021, section 2.4).
const WINDOW_FH: f64 = 200.0;

/// Observations of the last 200 h, and how many there were in all.
#[derive(Debug, Clone, Default)]
pub(super) struct Recent {
    observations: VecDeque<Observation>,
    /// Observations of the life so far.
    pub seen: usize,
}

impl Recent {
    /// Takes the next observation of the life.
    pub fn push(&mut self, observation: &Observation) {
        self.seen += 1;
        self.observations.push_back(observation.clone());
        while self.observations.front().is_some_and(|first| first.t_fh < observation.t_fh - WINDOW_FH) {
            self.observations.pop_front();
        }
    }

    /// Those of the last 200 h before `now_fh`.
    pub fn before(&self, now_fh: f64) -> impl Iterator<Item = &Observation> + Clone {
        self.observations.iter().filter(move |observation| observation.t_fh >= now_fh - WINDOW_FH)
    }
}
