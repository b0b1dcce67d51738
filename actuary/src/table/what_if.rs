//! The remaining life of an actuator as it is and as assumed, side by side in the terminal.

use std::fmt::Write as _;

use proto::answer::{FailureProbability, RulAnswer, RulQuantiles, WhatIfAnswer};

use super::{day, words};

/// One line for each figure.
pub fn what_if(answer: &WhatIfAnswer) -> String {
    let WhatIfAnswer { now, assumed, .. } = answer;
    let as_of = now.as_of.as_ref().map_or_else(|| "-".to_owned(), |as_of| format!("{:.0} fh", as_of.flight_hours));
    let mut table =
        format!("{} {}, {}: {}, as of {as_of}\n\n", now.tail, now.position, now.serial_number, words(now.status));
    line(&mut table, "", ["now".to_owned(), "assumed".to_owned()]);
    let both = |told: fn(&RulAnswer) -> String| [told(now), told(assumed)];
    line(&mut table, "remaining life, 10 %", both(|rul| hours(rul, |rul| rul.p10)));
    line(&mut table, "remaining life, median", both(|rul| hours(rul, |rul| rul.p50)));
    line(&mut table, "remaining life, 90 %", both(|rul| hours(rul, |rul| rul.p90)));
    line(
        &mut table,
        "end of life, 10 %",
        both(|rul| date(rul.end_of_life.as_ref().and_then(|end| end.date_p10.clone()))),
    );
    line(
        &mut table,
        "end of life, median",
        both(|rul| date(rul.end_of_life.as_ref().and_then(|end| end.date_p50.clone()))),
    );
    line(&mut table, "flight hours a day", both(flown));
    line(&mut table, "pace", both(|rul| rul.pace.as_ref().map_or_else(none, |pace| format!("{:.2}", pace.now))));
    if let Some(asked) = &answer.probability {
        let what = asked
            .by
            .as_ref()
            .map_or_else(|| "P(fails within the hours)".to_owned(), |by| format!("P(fails by {})", day(by)));
        line(&mut table, &what, [probability(asked.now.as_ref()), probability(asked.assumed.as_ref())]);
    }
    if let Some(reason) = &answer.extrapolation_reason {
        writeln!(table, "\nExtrapolation: {reason}.").expect("writing to a string");
    }
    writeln!(table, "\n{}", now.advisory).expect("writing to a string");
    table
}

fn line(table: &mut String, what: &str, [now, assumed]: [String; 2]) {
    writeln!(table, "{what:<26} {now:>22} {assumed:>22}").expect("writing to a string");
}

fn none() -> String {
    "-".to_owned()
}

fn hours(rul: &RulAnswer, quantile: fn(&RulQuantiles) -> Option<f64>) -> String {
    match (&rul.rul_fh, rul.horizon_fh) {
        (Some(quantiles), horizon) => quantile(quantiles).map_or_else(
            || horizon.map_or_else(none, |horizon| format!("> {horizon:.0} fh")),
            |hours| format!("{hours:.0} fh"),
        ),
        (None, _) => none(),
    }
}

fn date(date: Option<String>) -> String {
    date.unwrap_or_else(none)
}

fn flown(rul: &RulAnswer) -> String {
    let told = |end: &proto::answer::EndOfLife| {
        format!("{:.1} ({})", end.utilisation_fh_per_day, end.utilisation_source.as_str())
    };
    rul.end_of_life.as_ref().map_or_else(none, told)
}

fn probability(asked: Option<&FailureProbability>) -> String {
    let told = asked.and_then(|asked| Some((asked.within_fh, asked.p?, asked.standard_error?)));
    told.map_or_else(none, |(hours, p, error)| {
        format!("{:.1} \u{b1} {:.1} % ({hours:.0} fh)", 100.0 * p, 100.0 * error)
    })
}
