//! How many flight hours a day a tail flies, from a time on.
//!
//! Card. *What:* a utilisation that is constant piece by piece. *Rule:* a plan's, where it tells one; what was learned of the
//! tail, where it tells none. *Update:* hours until a date are the sum over the pieces before it; the date after some hours is
//! where that sum reaches them. Nothing is known behind a piece of which nothing is known.

use serde::{Deserialize, Serialize};

use crate::Timestamp;

/// Where a utilisation comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum UtilisationSource {
    /// The tail's last 90 days.
    Learned,
    /// The tail's plan; the last 90 days where it tells none.
    Plan,
    /// What was asked about.
    Assumed,
}

impl UtilisationSource {
    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Learned => "learned",
            Self::Plan => "plan",
            Self::Assumed => "assumed",
        }
    }
}

/// Flight hours per day from a time on.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    source: UtilisationSource,
    /// In ascending order, each until the next one begins; never empty.
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    from: Timestamp,
    fh_per_day: Option<f64>,
}

impl Schedule {
    /// From `from` on: as planned in half-open periods of ascending order, and as learned where they tell nothing.
    pub fn planned(
        from: Timestamp,
        periods: impl Iterator<Item = (Timestamp, Option<Timestamp>, f64)>,
        learned_fh_per_day: Option<f64>,
    ) -> Self {
        let mut schedule = Self::constant(from, learned_fh_per_day, UtilisationSource::Learned);
        for (begin, end, planned) in periods.filter(|(_, end, _)| end.is_none_or(|end| end > from)) {
            schedule.source = UtilisationSource::Plan;
            schedule.put(begin.max(from), Some(planned));
            if let Some(end) = end {
                schedule.put(end, learned_fh_per_day);
            }
        }
        schedule
    }

    /// As many hours a day for ever.
    pub fn constant(from: Timestamp, fh_per_day: Option<f64>, source: UtilisationSource) -> Self {
        Self { source, pieces: vec![Piece { from, fh_per_day }] }
    }

    /// Adds a piece behind all others, or in the place of one that would begin at the same time.
    fn put(&mut self, from: Timestamp, fh_per_day: Option<f64>) {
        self.pieces.retain(|piece| piece.from < from);
        self.pieces.push(Piece { from, fh_per_day });
    }

    /// Where it comes from.
    pub fn source(&self) -> UtilisationSource {
        self.source
    }

    /// Its beginning.
    pub fn begin(&self) -> Timestamp {
        self.pieces[0].from
    }

    /// Flight hours per day, on average until some are flown; `None` where nobody knows when that is.
    pub fn mean_fh_per_day(&self, hours: f64) -> Option<f64> {
        let days = days(self.begin(), self.time_after(hours)?);
        (days > 0.0).then(|| hours / days)
    }

    /// Flight hours per day at its beginning.
    pub fn fh_per_day_at_first(&self) -> Option<f64> {
        self.pieces[0].fh_per_day
    }

    /// Flight hours until a time; zero until one before the beginning, `None` where nobody knows.
    pub fn hours_until(&self, time: Timestamp) -> Option<f64> {
        let mut hours = 0.0;
        for (piece, end) in self.with_ends() {
            if piece.from >= time {
                break;
            }
            let end = end.map_or(time, |end| end.min(time));
            hours += piece.fh_per_day? * days(piece.from, end);
        }
        Some(hours)
    }

    /// The time after some flight hours; `None` where nobody knows, or where they are never flown.
    pub fn time_after(&self, hours: f64) -> Option<Timestamp> {
        let mut left = hours;
        for (piece, end) in self.with_ends() {
            let fh_per_day = piece.fh_per_day.filter(|_| left > 0.0);
            let Some(fh_per_day) = fh_per_day else { return (left <= 0.0).then_some(piece.from) };
            let flown = end.map(|end| fh_per_day * days(piece.from, end));
            match flown {
                Some(flown) if flown < left => left -= flown,
                _ => return (fh_per_day > 0.0).then(|| piece.from.plus_hours(left / fh_per_day * 24.0)),
            }
        }
        None
    }

    fn with_ends(&self) -> impl Iterator<Item = (&Piece, Option<Timestamp>)> {
        let ends = self.pieces.iter().skip(1).map(|piece| Some(piece.from)).chain([None]);
        self.pieces.iter().zip(ends)
    }
}

fn days(from: Timestamp, to: Timestamp) -> f64 {
    to.hours_since(from) / 24.0
}
