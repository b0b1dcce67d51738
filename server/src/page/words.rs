//! Statuses and numbers as people read them.

use domain::{Doubt, DoubtKind, Status, Timestamp};
use proto::answer::RulAnswer;

/// Below this 10 % quantile of remaining life a forecast asks for attention, flight hours.
pub const ATTENTION_FH: f64 = 500.0;

/// A status in words, with an icon and a class of the style sheet. Unknown is never green.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Badge {
    /// Place in a list that begins with what needs attention most.
    pub rank: u8,
    /// The class.
    pub class: &'static str,
    /// The icon.
    pub icon: &'static str,
    /// The words.
    pub words: &'static str,
}

impl Badge {
    /// The badge of a prognosis.
    pub fn of(body: &RulAnswer) -> Self {
        let doubts = body.doubts.iter().flatten().map(|doubt| doubt.kind);
        Self::of_quantile(body.status, body.rul_fh.as_ref().and_then(|rul| rul.p10), doubts)
    }

    /// The badge of a prognosis of which the 10 % quantile is known.
    pub fn of_quantile(status: Status, p10_fh: Option<f64>, doubts: impl Iterator<Item = DoubtKind>) -> Self {
        let near = p10_fh.is_some_and(|p10| p10 < ATTENTION_FH);
        Self::new(status, doubts, near, "end of life near")
    }

    /// The badge of a component on the due list: what is known of it asks for attention.
    pub fn due(status: Status, doubts: Option<&[Doubt]>) -> Self {
        Self::new(status, doubts.into_iter().flatten().map(|doubt| doubt.kind), true, "due")
    }

    fn new(status: Status, doubts: impl Iterator<Item = DoubtKind>, near: bool, near_words: &'static str) -> Self {
        let doubts: Vec<DoubtKind> = doubts.collect();
        let has = |kind: DoubtKind| doubts.contains(&kind);
        let (rank, class, icon, words) = match status {
            Status::Failed => (0, "failed", "✖", "failed"),
            Status::Current | Status::BeyondHorizon if near => (1, "soon", "▲", near_words),
            Status::InsufficientHistory => (2, "unknown", "?", "unknown: not enough history"),
            Status::Stale => (2, "unknown", "?", "unknown: data is stale"),
            Status::Inconsistent if has(DoubtKind::Hours) => (2, "unknown", "?", "unknown: hours contradict"),
            Status::Inconsistent if has(DoubtKind::Inconsistent) => {
                (2, "unknown", "?", "unknown: data contradicts the model")
            }
            Status::Inconsistent => (2, "unknown", "?", "unknown: little data since a gap"),
            Status::Current => (3, "good", "✔", "current"),
            Status::BeyondHorizon => (3, "good", "✔", "beyond the horizon"),
        };
        Self { rank, class, icon, words }
    }
}

/// Flight hours, or what a missing quantile means.
pub fn hours(horizon_fh: Option<f64>, quantile: Option<f64>) -> String {
    match (quantile, horizon_fh) {
        (Some(hours), _) => format!("{} fh", grouped(hours)),
        (None, Some(horizon)) => format!("> {} fh", grouped(horizon)),
        (None, None) => "unknown".to_owned(),
    }
}

/// A probability in percent, with a decimal where it is small.
pub fn percent(probability: f64) -> String {
    let percent = 100.0 * probability;
    if percent < 9.95 && percent.fract() != 0.0 { format!("{percent:.1} %") } else { format!("{percent:.0} %") }
}

/// The day of a time, in UTC.
pub fn day(time: Timestamp) -> String {
    let text = time.to_string();
    text.split('T').next().unwrap_or_default().to_owned()
}

/// The minute of a time, in UTC.
pub fn minute(time: Timestamp) -> String {
    let text = time.to_string();
    text.get(..16).map_or_else(|| text.clone(), |minute| minute.replace('T', " "))
}

/// A whole number in groups of three digits, parted by thin no-break spaces.
pub fn grouped(number: f64) -> String {
    let digits = format!("{:.0}", number.abs());
    let mut text = String::new();
    if number <= -0.5 {
        text.push('\u{2212}');
    }
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_cut_at_the_minute() {
        let time: Timestamp = "2026-03-01T13:30:59.25+01:00".parse().unwrap();
        assert_eq!((day(time), minute(time)), ("2026-03-01".to_owned(), "2026-03-01 12:30".to_owned()));
    }

    #[test]
    fn digits_come_in_threes() {
        assert_eq!(grouped(0.4), "0");
        assert_eq!(grouped(999.6), "1\u{202f}000");
        assert_eq!(grouped(1_234_567.0), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped(-1234.0), "\u{2212}1\u{202f}234");
    }
}
