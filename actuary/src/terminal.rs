//! What is known of the terminal that reads what a command says: how wide it is, and whether it shows colours.

use std::{
    env,
    io::{self, IsTerminal},
};

use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// So wide is what nobody knows the width of.
const UNKNOWN: usize = 80;
/// Nothing is made narrower.
const LEAST: usize = 20;
/// Nothing is made wider: a number that is no width is none of a terminal.
const MOST: usize = 10_000;

/// Cells in a line: what `COLUMNS` says, or the terminal; 80 where neither does.
pub fn width() -> usize {
    let told = || env::var("COLUMNS").ok()?.parse().ok();
    let seen = || {
        let is_shown = io::stdout().is_terminal();
        is_shown.then(crossterm::terminal::size)?.ok().map(|(columns, _)| usize::from(columns))
    };
    let wide = |columns: &usize| *columns > 0;
    told().filter(wide).or_else(|| seen().filter(wide)).unwrap_or(UNKNOWN).clamp(LEAST, MOST)
}

/// Whether standard output shows colours, and whoever reads it wants them.
pub fn is_coloured() -> bool {
    let set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !set("NO_COLOR") && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Cells that a text takes.
pub fn cells(text: &str) -> usize {
    text.width()
}

/// A text in at most so many cells, with an ellipsis in its middle where it was longer.
pub fn shortened(text: &str, most: usize) -> String {
    if cells(text) <= most {
        return text.to_owned();
    }
    let kept = most.saturating_sub(1);
    let tail: String = taken(text.chars().rev(), kept / 2).chars().rev().collect();
    format!("{}\u{2026}{tail}", taken(text.chars(), kept - cells(&tail)))
}

/// The beginning of a text, in at most so many cells.
pub fn beginning(text: &str, most: usize) -> String {
    taken(text.chars(), most)
}

fn taken(characters: impl Iterator<Item = char>, most: usize) -> String {
    let mut used = 0;
    characters
        .take_while(|character| {
            used += character.width().unwrap_or(0);
            used <= most
        })
        .collect()
}

/// Sentences behind a label, in lines of at most `width` cells, broken between words; lines behind the first begin with as many
/// spaces as the label takes.
pub fn wrapped(label: &str, text: &str, width: usize) -> String {
    let indent = cells(label);
    let (mut lines, mut line) = (Vec::new(), label.to_owned());
    for word in text.split_whitespace() {
        let is_first = cells(&line) <= indent;
        if !is_first && cells(&line) + 1 + cells(word) > width {
            lines.push(std::mem::replace(&mut line, " ".repeat(indent)));
        } else if !is_first {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push(line);
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_cut_in_the_middle_and_count_in_cells() {
        assert_eq!(shortened("S1-0001", 7), "S1-0001");
        assert_eq!(shortened("ABCDEFGHIJKLMNOPQRSTUVWXYZ012345", 9), "ABCD\u{2026}2345");
        assert_eq!(shortened("ABCDEFGH", 4), "AB\u{2026}H");
        assert_eq!(cells("\u{4e2d}\u{6587}"), 4);
        for most in 1..12 {
            assert!(cells(&shortened("\u{4e2d}\u{6587}ABC\u{4e2d}\u{6587}", most)) <= most, "{most}");
        }
    }

    #[test]
    fn sentences_break_between_words() {
        assert_eq!(wrapped("", "one two three four", 9), "one two\nthree\nfour");
        assert_eq!(wrapped("a  ", "one two three", 10), "a  one two\n   three");
        assert_eq!(wrapped("", "indivisible", 4), "indivisible");
        assert_eq!(wrapped("", "", 4), "");
    }
}
