//! Characters that people cannot see, or that show others than there are: names that look the same must be the same.

use unicode_normalization::is_nfc;
use unicode_properties::{GeneralCategory, UnicodeGeneralCategory};

/// Letters and marks that show nothing, whatever their category: joiners and fillers of syllables, variation
/// selectors, a pattern without dots, tags.
const UNSEEN: [(char, char); 9] = [
    ('\u{34f}', '\u{34f}'),
    ('\u{115f}', '\u{1160}'),
    ('\u{17b4}', '\u{17b5}'),
    ('\u{180b}', '\u{180f}'),
    ('\u{2800}', '\u{2800}'),
    ('\u{3164}', '\u{3164}'),
    ('\u{fe00}', '\u{fe0f}'),
    ('\u{ffa0}', '\u{ffa0}'),
    ('\u{e0000}', '\u{e0fff}'),
];

/// What keeps a text from being a name, if anything does: a character that cannot be told from another one or from
/// none, or a spelling of which there are two.
pub fn not_of_a_name(text: &str) -> Option<String> {
    let odd =
        |c: char| unseen(c).or_else(|| (c.is_whitespace() && c != ' ').then_some("a blank, but not the usual one"));
    let odd = text.chars().find_map(|c| Some(told(c, odd(c)?)));
    odd.or_else(|| {
        (!is_nfc(text)).then(|| "its letters are put together of several characters (not in NFC)".to_owned())
    })
}

/// What keeps a text from being a note, if anything does. Ends of lines and tabulators are parts of notes, and so is
/// what joins the letters of some scripts, or chooses the form of a sign.
pub fn not_of_a_note(text: &str) -> Option<String> {
    let part = |c: &char| matches!(c, '\n' | '\r' | '\t' | '\u{200c}' | '\u{200d}' | '\u{fe00}'..='\u{fe0f}');
    text.chars().filter(|c| !part(c)).find_map(|c| Some(told(c, unseen(c)?)))
}

fn told(c: char, what: &str) -> String {
    format!("U+{:04X} is {what}", u32::from(c))
}

/// What a character is that shows nothing, or nothing that everybody sees the same.
fn unseen(c: char) -> Option<&'static str> {
    if c.is_ascii_graphic() || c == ' ' {
        return None;
    }
    if UNSEEN.iter().any(|(from, to)| (*from..=*to).contains(&c)) {
        return Some("an invisible character");
    }
    match c.general_category() {
        GeneralCategory::Control => Some("a control character"),
        GeneralCategory::Format => Some("an invisible character"),
        GeneralCategory::LineSeparator | GeneralCategory::ParagraphSeparator => Some("an invisible end of line"),
        GeneralCategory::Unassigned => Some("no assigned character"),
        GeneralCategory::PrivateUse => Some("a character of private use"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_sees_is_named_by_its_number() {
        let odd = [
            '\u{0}',
            '\u{7f}',
            '\u{ad}',
            '\u{34f}',
            '\u{61c}',
            '\u{115f}',
            '\u{200b}',
            '\u{200c}',
            '\u{200e}',
            '\u{202a}',
            '\u{202e}',
            '\u{2028}',
            '\u{2060}',
            '\u{2066}',
            '\u{2069}',
            '\u{2800}',
            '\u{3164}',
            '\u{fe0f}',
            '\u{feff}',
            '\u{fffe}',
            '\u{e000}',
            '\u{378}',
            '\u{e0041}',
            '\u{e0100}',
            '\u{10ffff}',
            '\u{a0}',
            '\u{3000}',
            '\n',
        ];
        for c in odd {
            let refused = not_of_a_name(&format!("00{c}42")).unwrap_or_default();
            assert!(refused.contains(&format!("U+{:04X} ", u32::from(c))), "{c:?}: {refused}");
        }
    }

    #[test]
    fn what_people_write_is_a_name() {
        for text in ["SN 0001/Ä", "№ 7", "Привет-7", "東京-1", "שלום", "1½", "a+b=c", "M₄·½", "Ελ-1", "ปีก"]
        {
            assert_eq!(not_of_a_name(text), None, "{text}");
        }
    }

    #[test]
    fn a_spelling_in_parts_is_refused() {
        assert_eq!(not_of_a_name("\u{c4}"), None);
        assert!(not_of_a_name("A\u{308}").unwrap().contains("NFC"));
    }

    #[test]
    fn a_note_has_lines_and_signs() {
        assert_eq!(
            not_of_a_note("seal leaked\r\n\tA\u{308} replaced \u{2764}\u{fe0f}, \u{645}\u{6cc}\u{200c}\u{62e}"),
            None
        );
        for (note, told) in
            [("a\u{202e}b", "U+202E"), ("\u{7}", "U+0007"), ("\u{feff}x", "U+FEFF"), ("\u{e0041}", "U+E0041")]
        {
            assert!(not_of_a_note(note).unwrap().contains(told), "{note:?}");
        }
    }
}
