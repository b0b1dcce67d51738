//! What is due in the terminal: one line per component, worst first.

use std::fmt::Write as _;

use domain::{AsOf, Status, check::NEXT};
use proto::answer::{DueAnswer, DueItem};

use super::words;

/// What is due, with a heading, and behind it what is unknown.
pub fn due(list: &DueAnswer) -> String {
    let totals = list.totals;
    // Without the digits that the multiplication adds.
    let percent = (1e11 * list.risk).round() / 1e9;
    let mut table = format!(
        "{} of {} actuators have failed, or fail {} with more than {percent} %; unknown: {}.\n",
        totals.due,
        totals.components,
        period(list),
        totals.unknown,
    );
    if !list.items.is_empty() {
        let heading =
            ["tail", "position", "serial", "status", "P(fails)", "safe for", "until", "about", "driven by", "as of"];
        table += "\n";
        due_line(&mut table, heading.map(str::to_owned));
        list.items.iter().for_each(|item| due_line(&mut table, due_row(item)));
    }
    if !list.unknown.is_empty() {
        table += "\nUnknown, which is not healthy:\n";
        list.unknown.iter().for_each(|item| unknown_line(&mut table, item));
    }
    writeln!(table, "\n{}", list.advisory).expect("writing to a string");
    table
}

/// What units have to last for, in words.
fn period(list: &DueAnswer) -> String {
    match (list.by, list.check.as_deref(), list.within_fh) {
        (Some(day), ..) => format!("before {day}"),
        (_, Some(NEXT), _) => "before the next check of their tail".to_owned(),
        (_, Some(name), _) => format!("before the check {name} of their tail"),
        (.., Some(hours)) => format!("within {hours} fh of their newest data"),
        _ => String::new(),
    }
}

fn due_row(item: &DueItem) -> [String; 10] {
    let none = || "-".to_owned();
    let safe = item.latest_safe.as_ref();
    let p = item.p.zip(item.standard_error);
    [
        place(item.tail.as_ref()),
        place(item.position.as_ref()),
        item.serial_number.clone(),
        due_words(item.status).to_owned(),
        p.map_or_else(none, |(p, error)| format!("{:.1} \u{b1} {:.1} %", 100.0 * p, 100.0 * error)),
        safe.map_or_else(none, |safe| format!("{:.0} fh", safe.remaining_fh)),
        safe.map_or_else(none, |safe| format!("{:.0} fh", safe.flight_hours)),
        safe.and_then(|safe| safe.date.clone()).unwrap_or_else(none),
        item.dominant_fault.clone().unwrap_or_else(none),
        as_of(item.as_of.as_ref()),
    ]
}

/// A tail or a position; of a component that lost its place to another one, neither is known.
fn place(name: Option<&String>) -> String {
    name.cloned().unwrap_or_else(|| "unknown".to_owned())
}

/// A forecast to act on is due when it is on the list.
fn due_words(status: Status) -> &'static str {
    match status {
        Status::Current | Status::BeyondHorizon => "due",
        other => words(other),
    }
}

fn due_line(table: &mut String, cells: [String; 10]) {
    let [tail, position, serial, status, p, safe_for, until, about, fault, as_of] = cells;
    writeln!(
        table,
        "{tail:<8} {position:<9} {serial:<12}  {status:<21} {p:>13} {safe_for:>9} {until:>9}  {about:<10}  {fault:<9}  \
         {as_of}"
    )
    .expect("writing to a string");
}

fn unknown_line(table: &mut String, item: &DueItem) {
    let reason = item.reason.as_deref().unwrap_or_else(|| words(item.status));
    let (tail, position, serial) = (place(item.tail.as_ref()), place(item.position.as_ref()), &item.serial_number);
    writeln!(table, "{tail:<8} {position:<9} {serial:<12}  {reason} (as of {})", as_of(item.as_of.as_ref()))
        .expect("writing to a string");
}

fn as_of(as_of: Option<&AsOf>) -> String {
    as_of.map_or_else(
        || "nothing yet".to_owned(),
        |as_of| {
            let time = as_of.recorded_at.to_string();
            format!("{:.0} fh, {}", as_of.flight_hours, time.split('T').next().unwrap_or_default())
        },
    )
}
