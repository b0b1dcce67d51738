//! Remains of observed periods: what is left of them beside the told ones, and what contradicts them.
//!
//! An upload shows where a component is at one moment only. That it stays there is a guess, which any event about the
//! component or the place overrides; after that, only another upload renews it. So an observed period is cut at each
//! gap and goes on with the first upload behind it, and nothing outside of the stretch between two gaps ever changes
//! by what becomes known within it.

use std::collections::BTreeSet;

use super::{Moment, Period, Place};

/// The two ends of a time in which uploads do not say where a component is; a removal ends as it begins.
pub(crate) type Gap = (Moment, Option<Moment>);

/// All that is known of a component at a place.
pub(crate) struct Known<S> {
    /// Told periods of the component and of the place, and removals of the one from the other, by beginning.
    pub(crate) gaps: BTreeSet<Gap>,
    /// The component's first upload after the end of a gap inside an observed period.
    pub(crate) sighted_after: S,
}

/// A stretch of time that lies between gaps.
pub(crate) struct Stretch {
    pub(crate) from: Option<Moment>,
    pub(crate) to: Option<Moment>,
}

impl Stretch {
    /// The stretch that may look otherwise when something new is known of moments from `first` to `last`: from the end
    /// of the last gap before them to the beginning of the first one after them. `gaps` lack none between those two.
    pub(crate) fn around(gaps: &BTreeSet<Gap>, first: &Moment, last: &Moment) -> Self {
        let ended = |to: &Option<Moment>| to.clone().filter(|to| to < first).unwrap_or_else(|| first.clone());
        let before = gaps.iter().filter(|(from, _)| from < first).map(|(_, to)| ended(to));
        let after = gaps.iter().map(|(from, _)| from).filter(|from| *from > last);
        Self { from: before.max(), to: after.min().cloned() }
    }

    /// Tells whether a moment lies in it.
    pub(crate) fn contains(&self, moment: &Moment) -> bool {
        self.from.as_ref().is_none_or(|from| from <= moment) && self.to.as_ref().is_none_or(|to| moment < to)
    }

    /// Tells whether a gap says something about what begins in it.
    pub(crate) fn concerns(&self, (from, to): &Gap) -> bool {
        self.to.as_ref().is_none_or(|end| from <= end)
            && self.from.as_ref().is_none_or(|begin| to.as_ref().is_none_or(|to| to >= begin))
    }
}

impl<S: Fn(&Moment) -> Option<Moment>> Known<S> {
    /// The remains of an observed period between its gaps.
    pub(crate) fn remains(&self, observed: &Period) -> Vec<Period> {
        let mut periods = Vec::new();
        // From when the component is known to be at the place; `None` while a gap waits for its next upload. A gap that
        // ended before that moment, or that begins behind the period, says nothing here.
        let mut seen = Some(observed.from.clone());
        for (from, to) in &self.gaps {
            let Some(at) = seen.take_if(|at| to.as_ref().is_none_or(|to| to > at) && observed.lasts_beyond(from))
            else {
                continue;
            };
            if *from > at {
                periods.push(Period { from: at, to: Some(from.clone()), ..observed.clone() });
            }
            seen = to.as_ref().and_then(&self.sighted_after).filter(|next| observed.lasts_beyond(next));
        }
        periods.extend(seen.map(|from| Period { from, ..observed.clone() }));
        periods
    }
}

/// The first upload of each observed period that each told period contradicts, with that period.
/// `sighted_after`: the component's first upload after the beginning of a told period.
pub(crate) fn contradictions(
    observed: &[Period],
    told: &[Period],
    sighted_after: impl Fn(&Moment) -> Option<Moment>,
) -> Vec<(Moment, Place, Period)> {
    let mut found = Vec::new();
    for observed in observed {
        for period in told.iter().filter(|period| contradict(observed, period)) {
            let first = if period.contains(&observed.from) {
                Some(observed.from.clone())
            } else if observed.contains(&period.from) {
                sighted_after(&period.from).filter(|at| observed.lasts_beyond(at) && period.lasts_beyond(at))
            } else {
                None
            };
            found.extend(first.map(|at| (at, observed.place.clone(), period.clone())));
        }
    }
    found.sort();
    found
}

/// Tells whether they cannot both be: two components at a place, or one component at two.
fn contradict(observed: &Period, told: &Period) -> bool {
    (observed.component == told.component) != (observed.place == told.place)
}
