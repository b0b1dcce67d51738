//! Checks of tails in the terminal.

use std::fmt::Write;

use proto::answer::{CheckItem, CheckTerms, ChecksAnswer, ChecksChange, ChecksImport};

/// One line per check.
pub fn checks(tails: &[ChecksAnswer]) -> String {
    let mut table = String::new();
    let all = tails.iter().flat_map(|of| of.checks.iter().map(move |check| (&of.tail, check)));
    let mut all = all.peekable();
    if all.peek().is_none() {
        return "No checks are set.\n".to_owned();
    }
    line(&mut table, ["tail", "check", "comes on", "given as"].map(str::to_owned));
    for (tail, check) in all {
        let terms = given(check.date.as_deref(), check.remaining_fh, check.as_of.as_deref());
        line(&mut table, [tail.clone(), check.name.clone(), comes_on(check), terms]);
    }
    table
}

fn comes_on(check: &CheckItem) -> String {
    let on = check.expected_date.clone().unwrap_or_else(|| "unknown".to_owned());
    if check.past { format!("{on} (over)") } else { on }
}

fn line(table: &mut String, [tail, name, on, given]: [String; 4]) {
    writeln!(table, "{tail:<10}  {name:<32}  {on:<17}  {given}").expect("writing to a string");
}

fn given(date: Option<&str>, remaining_fh: Option<f64>, as_of: Option<&str>) -> String {
    match (date, remaining_fh, as_of) {
        (_, Some(hours), Some(as_of)) => format!("{hours} fh from {as_of} on"),
        (date, ..) => date.unwrap_or_default().to_owned(),
    }
}

/// What an import changes, one line per change.
pub fn import(import: &ChecksImport) -> String {
    let mut text = String::new();
    for change in &import.tails {
        tell(&mut text, change);
    }
    let changed = import.tails.iter().filter(|tail| !is_same(tail)).count();
    let same = import.tails.len() - changed;
    let done = if import.applied { "changed" } else { "would change; nothing was done" };
    writeln!(text, "{changed} of {} tails {done}; {same} stay as they are.", import.tails.len())
        .expect("writing to a string");
    text
}

fn is_same(tail: &ChecksChange) -> bool {
    tail.added.is_empty() && tail.removed.is_empty() && tail.changed.is_empty()
}

fn tell(text: &mut String, change: &ChecksChange) {
    let due = |terms: &CheckTerms| given(terms.date.as_deref(), terms.remaining_fh, terms.as_of.as_deref());
    let mut tell = |sign: char, name: &str, what: String| {
        writeln!(text, "{:<10}  {sign} {name}: {what}", change.tail).expect("writing to a string");
    };
    change.added.iter().for_each(|terms| tell('+', &terms.name, due(terms)));
    change.removed.iter().for_each(|terms| tell('-', &terms.name, due(terms)));
    for moved in &change.changed {
        tell('~', &moved.after.name, format!("{} -> {}", due(&moved.before), due(&moved.after)));
    }
}
