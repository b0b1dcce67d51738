//! Rungs of the ladder, dates and probabilities as people read them. What a rung is called, its icon and its class say the
//! same, so that nobody needs colours; unknown is never green.

use domain::{Day, Status, Urgency};
use proto::answer::Before;

/// A rung in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rung {
    /// The class of the style sheet.
    pub class: &'static str,
    /// The icon.
    pub icon: &'static str,
    /// The words.
    pub words: String,
}

impl Rung {
    /// A rung, with the name of what units have to last for.
    pub fn new(urgency: Urgency, until: &str) -> Self {
        let (icon, words) = match urgency {
            Urgency::Failed => ("✖", "failed".to_owned()),
            Urgency::ActNow => ("▲▲", "now".to_owned()),
            Urgency::BeforeCheck => ("▲", format!("before {until}")),
            Urgency::Unknown => ("?", "unknown".to_owned()),
            Urgency::MayWait => ("✓", "may wait".to_owned()),
        };
        Self { class: urgency.as_str(), icon, words }
    }
}

/// What a unit has to last for, in a few words.
pub fn until(before: &Before, today: Day) -> String {
    match (&before.check, before.date, before.within_fh) {
        (Some(check), ..) => check.clone(),
        (None, Some(date), _) => short(date, today),
        (None, None, Some(hours)) => format!("{hours:.0} fh"),
        (None, None, None) => "then".to_owned(),
    }
}

/// Why the data of a unit are not to be relied on; `None` where they are.
pub fn data(status: Status, age_days: Option<i64>) -> Option<String> {
    match (status, age_days) {
        (Status::Stale, Some(1)) => Some("data 1 day old".to_owned()),
        (Status::Stale, Some(days)) => Some(format!("data {days} days old")),
        (Status::Stale, None) => Some("data old".to_owned()),
        (Status::Inconsistent, _) => Some("data contradict".to_owned()),
        (Status::InsufficientHistory, _) => Some("not enough history".to_owned()),
        (Status::Failed | Status::Current | Status::BeyondHorizon, _) => None,
    }
}

const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

/// A day as short as it is clear: the year is told where it is not that of today and the day is not within the next 300.
pub fn short(day: Day, today: Day) -> String {
    let (year, month, of_month, _) = day.parts();
    let month = MONTHS[usize::from(month) - 1];
    match (0..300).contains(&day.days_since(today)) || year == today.parts().0 {
        true => format!("{of_month:02} {month}"),
        false => format!("{of_month:02} {month} {year}"),
    }
}

/// A probability for people: draws tell no more than that it is above 99 % or below 1 %.
pub fn percent(p: f64) -> String {
    match 100.0 * p {
        percent if percent > 99.0 => "> 99 %".to_owned(),
        percent if percent < 1.0 => "< 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_probabilities_are_short_and_clear() {
        let day = |text: &str| text.parse::<Day>().unwrap();
        let today = day("2026-11-30");
        assert_eq!(short(day("2026-12-10"), today), "10 Dec");
        assert_eq!(short(day("2027-03-01"), today), "01 Mar");
        assert_eq!(short(day("2027-11-30"), today), "30 Nov 2027");
        assert_eq!(short(day("2025-11-30"), today), "30 Nov 2025");
        assert_eq!([1.0, 0.94, 0.005, 0.0].map(percent), ["> 99 %", "94 %", "< 1 %", "< 1 %"]);
    }
}
