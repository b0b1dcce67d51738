//! Numbers and times as people read them.

use domain::Timestamp;

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
