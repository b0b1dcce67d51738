//! The remaining life of one unit in the terminal: first what to do by when, then what that rests on.

use std::fmt::Write as _;

use proto::answer::RulAnswer;

use super::{
    units::{Unit, rung},
    words,
};
use crate::terminal::wrapped;

/// So wide are the names of what is told.
const LABEL: usize = 16;

/// A sentence, then a line for each figure.
pub fn rul(unit: &Unit, rul: &RulAnswer, width: usize) -> String {
    let place =
        unit.place().map_or_else(|| "place unknown".to_owned(), |(tail, position)| format!("{tail} {position}"));
    let heading = format!("{place}, part {}, serial {}", rul.part_number, rul.serial_number);
    let mut text = wrapped("", &heading, width) + "\n";
    text += &wrapped("", &sentence(unit), width);
    text += "\n\n";
    for (what, told) in figures(unit, rul) {
        writeln!(text, "{}", wrapped(&format!("{what:<LABEL$}"), &told, width)).expect("writing to a string");
    }
    writeln!(text, "\n{}", wrapped("", &rul.advisory, width)).expect("writing to a string");
    text
}

/// What to do, by when, and how sure that is.
fn sentence(unit: &Unit) -> String {
    let (sign, word, _) = rung(unit.urgency());
    let told = [unit.deadline(), unit.risk()].into_iter().flatten().collect::<Vec<_>>();
    let told = if told.is_empty() { String::new() } else { format!(": {}", told.join("; ")) };
    format!("{sign} {word}{told}.")
}

fn figures(unit: &Unit, rul: &RulAnswer) -> Vec<(&'static str, String)> {
    let dates = rul.end_of_life.as_ref();
    let quantile = |hours: Option<f64>, date: Option<&String>| match (hours, rul.rul_fh.as_ref(), rul.horizon_fh) {
        (Some(hours), ..) => format!("{hours:.0} fh{}", date.map(|date| format!(", {date}")).unwrap_or_default()),
        (None, Some(_), Some(horizon)) => format!("> {horizon:.0} fh"),
        _ => "-".to_owned(),
    };
    let hours = rul.rul_fh.as_ref();
    let as_of = rul.as_of.as_ref();
    let mut told = vec![
        ("10 % end by", quantile(hours.and_then(|it| it.p10), dates.and_then(|it| it.date_p10.as_ref()))),
        ("half end by", quantile(hours.and_then(|it| it.p50), dates.and_then(|it| it.date_p50.as_ref()))),
        ("90 % end by", quantile(hours.and_then(|it| it.p90), dates.and_then(|it| it.date_p90.as_ref()))),
        ("driven by", driver(rul)),
        (
            "data",
            as_of.map_or_else(
                || "none yet".to_owned(),
                |as_of| {
                    format!(
                        "{}, of {} at {:.0} fh",
                        words(rul.status),
                        super::minute(as_of.recorded_at),
                        as_of.flight_hours
                    )
                },
            ),
        ),
    ];
    told.extend(dates.map(|end| {
        ("flies", format!("{:.1} fh a day ({})", end.utilisation_fh_per_day, end.utilisation_source.as_str()))
    }));
    told.extend(rul.missing.clone().or_else(|| unit.reason().map(str::to_owned)).map(|missing| ("missing", missing)));
    told.extend(rul.doubts.iter().flatten().map(|doubt| ("doubt", doubt.detail.clone())));
    told
}

fn driver(rul: &RulAnswer) -> String {
    let Some(name) = &rul.dominant_fault else { return "-".to_owned() };
    let fault = rul.fault_vector.as_ref().and_then(|faults| faults.get(name));
    fault.map_or_else(
        || name.clone(),
        |it| format!("{name}, {:.3} \u{b1} {:.3}, grows {:.3} per 1,000 fh", it.value, it.sigma, it.trend_per_1000_fh),
    )
}
