//! How a file is laid out, before its fields are looked at.

use csv::StringRecord;

/// Refuses what is no table of fields that commas separate: read as one, it would be one column.
pub fn check(content: &[u8], has_header: bool) -> Result<(), String> {
    if content.starts_with(b"\xff\xfe") || content.starts_with(b"\xfe\xff") {
        return Err("is UTF-16: save it as UTF-8".to_owned());
    }
    if content.contains(&0) {
        return Err("is no text".to_owned());
    }
    let first =
        content.split(|byte| matches!(byte, b'\n' | b'\r')).map(<[u8]>::trim_ascii).find(|line| !line.is_empty());
    let first = outside_quotes(first.unwrap_or_default());
    let has = |separator: u8| first.contains(&separator);
    let other = [(b';', "semicolons"), (b'\t', "tabs"), (b'|', "bars"), (b' ', "spaces")];
    // A decimal comma stands between semicolons, too; names have none.
    let found = other.iter().find(|(byte, _)| has(*byte) && (!has(b',') || (*byte == b';' && !has_header)));
    match found {
        None => Ok(()),
        Some((_, name)) => Err(format!(
            "fields are separated by {name}: separate them by commas, and write numbers with a decimal point"
        )),
    }
}

fn outside_quotes(line: &[u8]) -> Vec<u8> {
    let mut quoted = false;
    let mut is_outside = |byte: &u8| {
        quoted ^= *byte == b'"';
        !quoted
    };
    line.iter().copied().filter(|byte| is_outside(byte)).collect()
}

/// Lines at which rows begin, from 1; a line ends with LF, CR or both. A record's own position is that of the line breaks before it,
/// which may stand for blank lines or for the second half of a Windows line break.
pub fn lines(rows: &[StringRecord], content: &[u8]) -> Vec<usize> {
    let (mut line, mut seen) = (1, 0);
    let begin = |row: &StringRecord| {
        let begin = begin_of(row, content);
        let ends = (seen..begin).filter(|&at| match content[at] {
            b'\n' => true,
            b'\r' => content.get(at + 1) != Some(&b'\n'),
            _ => false,
        });
        line += ends.count();
        seen = begin;
        line
    };
    rows.iter().map(begin).collect()
}

/// Where the first field of a row is.
fn begin_of(row: &StringRecord, content: &[u8]) -> usize {
    let offset = row.position().map_or(0, |position| position.byte() as usize);
    offset + content[offset..].iter().take_while(|byte| matches!(byte, b'\r' | b'\n')).count()
}

/// Whether there is nothing in a row, not even an empty text in quotes.
pub fn is_blank(row: &StringRecord, content: &[u8]) -> bool {
    let begin = begin_of(row, content);
    let line = content[begin..].split(|byte| matches!(byte, b'\r' | b'\n')).next().unwrap_or_default();
    row.iter().all(str::is_empty) && !line.contains(&b'"')
}
