//! Units of a fleet in the terminal: one line each, with what to do about it, by when and how sure that is.

use domain::{AsOf, Day, Status, Urgency, Zone};
use serde::Deserialize;

use super::{
    columns::{Cell, Column, Style, WHOLE, fitted},
    words,
};

/// The columns. A narrow terminal loses, in this order: part, before, fh, why, days, data, serial, P.
const COLUMNS: [Column; 12] = [
    Column { heading: "   urgency", least: 11, leaves: None },
    Column { heading: "tail", least: 7, leaves: None },
    Column { heading: "position", least: 5, leaves: None },
    Column { heading: "part", least: 9, leaves: Some(1) },
    Column { heading: "serial", least: 9, leaves: Some(7) },
    Column { heading: "replace by", least: WHOLE, leaves: None },
    Column { heading: "days", least: WHOLE, leaves: Some(5) },
    Column { heading: "fh", least: WHOLE, leaves: Some(3) },
    Column { heading: "P", least: WHOLE, leaves: Some(8) },
    Column { heading: "before", least: 12, leaves: Some(2) },
    Column { heading: "why", least: 9, leaves: Some(4) },
    Column { heading: "data", least: 12, leaves: Some(6) },
];

/// What is told of a unit, in a remaining life as on the due list; a line is made of these fields alone.
#[derive(Debug, Clone, Deserialize)]
pub struct Unit {
    urgency: Option<Urgency>,
    tail: Option<String>,
    position: Option<String>,
    #[serde(default)]
    displaced: bool,
    part_number: String,
    serial_number: String,
    status: Status,
    before: Option<Before>,
    /// The day by which it was due by numbers that are not to be relied on any longer.
    was_due_by: Option<Day>,
    data_age_days: Option<i64>,
    as_of: Option<AsOf>,
    dominant_fault: Option<String>,
    rul_fh: Option<Quantiles>,
    end_of_life: Option<Dates>,
    latest_safe: Option<LatestSafe>,
    reason: Option<String>,
}

/// What a unit has to last for, and how probably it does not.
#[derive(Debug, Clone, Deserialize)]
pub struct Before {
    check: Option<String>,
    date: Option<Day>,
    within_fh: Option<f64>,
    p: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct Quantiles {
    p10: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct Dates {
    date_p10: Option<Day>,
}

#[derive(Debug, Clone, Deserialize)]
struct LatestSafe {
    remaining_fh: f64,
    date: Option<Day>,
}

/// The table of units, headings first.
pub fn lines(units: &[Unit], today: Day, width: usize, is_coloured: bool) -> Vec<String> {
    let today = today.max(newest_day(units).unwrap_or(today));
    let rows: Vec<_> = units.iter().map(|unit| unit.row(today)).collect();
    fitted(&COLUMNS, &rows, width, is_coloured)
}

/// The day of the newest data, which a fleet that is simulated may have ahead of the machine's clock.
fn newest_day(units: &[Unit]) -> Option<Day> {
    let newest = units.iter().filter_map(|unit| unit.as_of.as_ref()).map(|as_of| as_of.recorded_at).max()?;
    Some(Zone::default().day_of(newest))
}

/// How many units there are on each rung, in a sentence.
pub fn counts(units: &[Unit]) -> String {
    let of = |urgency: Urgency| units.iter().filter(|unit| unit.urgency() == urgency).count();
    let told: Vec<_> = Urgency::ALL.iter().map(|&urgency| format!("{} {}", of(urgency), rung(urgency).1)).collect();
    let noun = if units.len() == 1 { "unit" } else { "units" };
    format!("{} {noun}: {}.", units.len(), told.join(", "))
}

/// The most urgent first; within a rung, in the order in which they were told.
pub fn sort(units: &mut [Unit]) {
    units.sort_by_key(Unit::urgency);
}

impl Unit {
    /// What to do about it; a service that does not say so leaves it unknown.
    pub fn urgency(&self) -> Urgency {
        let failed = (self.status == Status::Failed).then_some(Urgency::Failed);
        self.urgency.or(failed).unwrap_or(Urgency::Unknown)
    }

    /// The day, and the flight hours from the newest data, until which it has to be replaced.
    fn until(&self) -> (Option<Day>, Option<f64>) {
        let safe = self.latest_safe.as_ref();
        let day = safe.map_or_else(|| self.end_of_life.as_ref().and_then(|end| end.date_p10), |safe| safe.date);
        let hours = safe.map_or_else(|| self.rul_fh.as_ref().and_then(|rul| rul.p10), |safe| Some(safe.remaining_fh));
        (self.was_due_by.or(day), hours)
    }

    /// Its place, such as `EC-A001 AIL-L`; none where nobody knows it.
    pub fn place(&self) -> Option<(&str, &str)> {
        self.tail.as_deref().zip(self.position.as_deref()).filter(|_| !self.displaced)
    }

    /// Its serial number.
    pub fn serial_number(&self) -> &str {
        &self.serial_number
    }

    /// By when it has to be replaced, in words.
    pub fn deadline(&self) -> Option<String> {
        let (day, hours) = self.until();
        let hours = hours.map(|hours| format!(" ({hours:.0} fh from the newest data)")).unwrap_or_default();
        match (self.urgency(), self.was_due_by, day) {
            (Urgency::Failed, ..) => Some("replace it now".to_owned()),
            (_, Some(day), _) => Some(match self.data_age_days {
                Some(age) => format!("was due by {day}, data {age} days old"),
                None => format!("was due by {day}"),
            }),
            (_, None, Some(day)) => Some(format!("replace it by {day}{hours}")),
            (_, None, None) => None,
        }
    }

    /// How probably it fails before what it has to last for, in words.
    pub fn risk(&self) -> Option<String> {
        let asked = self.before.as_ref()?;
        Some(format!("{} that it fails before {}", percent(asked.p?), before(asked)))
    }

    /// Why nothing is known of it, where that is told.
    pub fn reason(&self) -> Option<&str> {
        self.reason.as_deref()
    }

    fn row(&self, today: Day) -> Vec<Cell> {
        let none = || "-".to_owned();
        let (tail, position) = self.place().unwrap_or(("unknown", "unknown"));
        let (day, hours) = self.until();
        let (sign, word, style) = rung(self.urgency());
        let relied = |text: String| match self.data_age_days {
            Some(_) => Cell::new(text).styled(Style::Faint),
            None => Cell::new(text),
        };
        vec![
            Cell::new(format!("{sign:<2} {word}")).styled(style),
            Cell::new(tail),
            Cell::new(position),
            Cell::new(self.part_number.clone()),
            Cell::new(self.serial_number.clone()),
            relied(self.replace_by()),
            relied(day.map_or_else(none, |day| day.days_since(today).to_string())),
            relied(hours.map_or_else(none, |hours| format!("{hours:.0}"))),
            relied(self.before.as_ref().and_then(|before| before.p).map_or_else(none, percent)),
            Cell::new(self.before.as_ref().map_or_else(none, before)),
            Cell::new(self.dominant_fault.clone().unwrap_or_else(none)),
            Cell::new(self.data()),
        ]
    }

    fn replace_by(&self) -> String {
        match self.until().0 {
            _ if self.urgency() == Urgency::Failed => "now".to_owned(),
            Some(day) => day.to_string(),
            None => "-".to_owned(),
        }
    }

    /// How its data stand, where they are not current.
    fn data(&self) -> String {
        let status = match self.status {
            Status::Current => return String::new(),
            other => words(other).trim_start_matches("unknown: "),
        };
        self.data_age_days.map_or_else(|| status.to_owned(), |days| format!("{status}, {days} d old"))
    }
}

/// The sign of a rung, its word and its style: any one of them is enough.
pub fn rung(urgency: Urgency) -> (&'static str, &'static str, Style) {
    match urgency {
        Urgency::Failed => ("\u{2716}", "failed", Style::Alarm),
        Urgency::ActNow => ("\u{25b2}\u{25b2}", "act now", Style::Hot),
        Urgency::BeforeCheck => ("\u{25b2}", "before check", Style::Warm),
        Urgency::Unknown => ("?", "unknown", Style::Odd),
        Urgency::MayWait => ("\u{2713}", "may wait", Style::Calm),
    }
}

/// What a unit has to last for.
pub fn before(before: &Before) -> String {
    match (&before.check, before.date, before.within_fh) {
        (Some(check), Some(date), _) => format!("{check} {date}"),
        (Some(check), None, _) => check.clone(),
        (None, Some(date), _) => date.to_string(),
        (None, None, Some(hours)) => format!("{hours:.0} fh"),
        (None, None, None) => "-".to_owned(),
    }
}

/// A probability as people read it: no more sure than its draws are.
pub fn percent(p: f64) -> String {
    match p {
        p if p > 0.99 => "> 99 %".to_owned(),
        p if p < 0.01 => "< 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::terminal::cells;

    fn unit(urgency: Urgency, status: Status, data_age_days: Option<i64>) -> Unit {
        let told = json!({
            "urgency": urgency, "status": status, "data_age_days": data_age_days, "tail": "EC-A001", "position": "AIL-L",
            "part_number": "EMA-48V", "serial_number": "0123456789ABCDEF0123456789ABCDEF", "as_of": null,
            "rul_fh": {"p10": 84.2}, "end_of_life": {"date_p10": "2026-03-11"}, "dominant_fault": "k1",
            "before": {"check": "C-check", "date": "2026-06-01", "within_fh": 300.0, "risk": 0.1, "p": 0.998},
        });
        serde_json::from_value(told).unwrap()
    }

    fn told(width: usize, is_coloured: bool) -> Vec<String> {
        let units = [unit(Urgency::ActNow, Status::Current, None), unit(Urgency::Unknown, Status::Stale, Some(23))];
        lines(&units, "2026-03-01".parse().unwrap(), width, is_coloured)
    }

    #[test]
    fn a_wide_terminal_is_told_everything_and_a_narrow_one_what_to_do_by_when() {
        let wide = told(200, false);
        for part in
            ["act now", "EC-A001", "AIL-L", "EMA-48V", "2026-03-11", "10", "84", "> 99 %", "C-check 2026-06-01", "k1"]
        {
            assert!(wide[1].contains(part), "{part}: {}", wide[1]);
        }
        assert!(wide[2].contains("stale, 23 d old"), "{}", wide[2]);
        for width in [40, 60, 80, 100] {
            let lines = told(width, false);
            assert!(lines.iter().all(|line| cells(line) <= width), "{width}: {lines:?}");
            assert!(lines[1].contains("act now") && lines[1].contains("EC-A001") && lines[1].contains("2026-03-11"));
        }
        assert!(told(80, false)[1].contains('\u{2026}'), "a long serial is cut in the middle");
    }

    #[test]
    fn old_numbers_are_faint_where_there_are_colours_and_no_colour_carries_a_meaning_alone() {
        assert!(told(200, true)[2].contains("\u{1b}[2m> 99 %"));
        assert!(told(200, false).iter().all(|line| !line.contains('\u{1b}')));
        let signs: std::collections::BTreeSet<_> = Urgency::ALL.iter().map(|&urgency| rung(urgency).0).collect();
        assert_eq!(signs.len(), Urgency::ALL.len());
    }

    #[test]
    fn probabilities_are_no_more_sure_than_their_draws() {
        assert_eq!([0.0, 0.004, 0.094, 0.5, 0.991].map(percent), ["< 1 %", "< 1 %", "9 %", "50 %", "> 99 %"]);
        assert_eq!(
            counts(&[unit(Urgency::MayWait, Status::Current, None)]),
            "1 unit: 0 failed, 0 act now, 0 before check, 0 unknown, 1 may wait."
        );
    }
}
