//! A component in the terminal: where it is, its life, and what was last reported of it.

use std::fmt::Write as _;

use proto::json::ComponentBody;

use super::day;
use crate::terminal::wrapped;

/// So many events are shown, the newest.
const EVENTS: usize = 5;
/// So wide are the names of what is told.
const LABEL: usize = 16;

/// A line for its place, its life, and each of its last events.
pub fn component(component: &ComponentBody, width: usize) -> String {
    let ComponentBody { part_number, serial_number, .. } = component;
    let mut text = wrapped("", &format!("Part {part_number}, serial {serial_number}"), width) + "\n";
    let mut line = |what: &str, told: &str| {
        writeln!(text, "{}", wrapped(&format!("{what:<LABEL$}"), told, width)).expect("writing to a string");
    };
    line("where", &place(component));
    line("life", &life(component));
    let standing = component.events.iter().filter(|event| event.voided_at.is_none()).rev().take(EVENTS);
    for event in standing {
        let outcome = event.outcome.map(|it| format!(" ({})", word(it))).unwrap_or_default();
        let note = event.note.as_ref().map(|note| format!(": {note}")).unwrap_or_default();
        let told = format!(
            "{}{outcome} at {:.0} fh, {} {}{note}",
            word(event.kind),
            event.flight_hours,
            event.tail,
            event.position
        );
        line(day(&event.occurred_at), &told);
    }
    text
}

fn place(component: &ComponentBody) -> String {
    match component.installations.last() {
        None => "installed nowhere yet".to_owned(),
        Some(last) => match &last.to {
            None => format!("{} {} since {}", last.tail, last.position, day(&last.from)),
            Some(to) => format!("on no tail since {}, last {} {}", day(to), last.tail, last.position),
        },
    }
}

fn life(component: &ComponentBody) -> String {
    let Some(life) = component.lives.last() else { return "nothing reported yet".to_owned() };
    let hours =
        |it: &domain::AsOf| format!("newest data of {} at {:.0} fh", super::minute(it.recorded_at), it.flight_hours);
    let newest = life.last.as_ref().map_or_else(|| "no data yet".to_owned(), hours);
    let began = life.began.as_ref();
    let began = began.map(|it| format!(", overhauled {} at {:.0} fh", day(&it.occurred_at), it.flight_hours));
    let failed = life.found_failed_fh.map(|hours| format!(", found failed at {hours:.0} fh"));
    format!(
        "{} of {}{}, {newest}{}",
        life.life + 1,
        component.lives.len(),
        began.unwrap_or_default(),
        failed.unwrap_or_default()
    )
}

/// A word of the interface, as JSON has it.
fn word(named: impl serde::Serialize) -> String {
    serde_json::to_value(named).ok().and_then(|word| word.as_str().map(str::to_owned)).unwrap_or_default()
}
