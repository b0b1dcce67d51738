//! Tables that callers send, cut into records; as spreadsheets leave them: with a byte order mark or without, any ends of
//! lines, blank rows, and blank columns at the right.

use super::FORMULA;

/// A record with the line of the text at which it begins, from 1; its fields are without blanks around them.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The line.
    pub line: usize,
    /// The fields, the last of which is not blank.
    pub fields: Vec<String>,
}

/// What keeps a text from being a table, with the line where it does.
#[derive(Debug, Clone, PartialEq)]
pub struct NoTable {
    /// The line.
    pub line: usize,
    /// What does.
    pub detail: &'static str,
}

/// The records of a text that are not blank.
pub fn records(bytes: &[u8]) -> Result<Vec<Record>, NoTable> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
        NoTable { line: before + 1, detail: "is no UTF-8: save the table as CSV UTF-8" }
    })?;
    let mut cutter = Cutter { records: Vec::new(), fields: Vec::new(), field: String::new(), line: 1, begun: 1 };
    let mut rest = text.chars().peekable();
    let mut quoted_since = None;
    while let Some(c) = rest.next() {
        match (c, quoted_since) {
            ('"', Some(_)) if rest.next_if_eq(&'"').is_some() => cutter.field.push('"'),
            ('"', Some(_)) => quoted_since = None,
            ('"', None) if cutter.field.trim().is_empty() => {
                cutter.field.clear();
                quoted_since = Some(cutter.line);
            }
            (',', None) => cutter.end_field(),
            ('\r', None) if rest.peek() == Some(&'\n') => {}
            ('\n' | '\r', None) => cutter.end_record(),
            (c, _) => cutter.put(c),
        }
    }
    if let Some(line) = quoted_since {
        return Err(NoTable { line, detail: "a quote is opened and not closed" });
    }
    cutter.end_record();
    Ok(cutter.records)
}

struct Cutter {
    records: Vec<Record>,
    fields: Vec<String>,
    field: String,
    line: usize,
    begun: usize,
}

impl Cutter {
    fn put(&mut self, c: char) {
        self.line += usize::from(c == '\n');
        self.field.push(c);
    }

    fn end_field(&mut self) {
        let field = std::mem::take(&mut self.field);
        self.fields.push(unmarked(field.trim()).to_owned());
    }

    fn end_record(&mut self) {
        self.end_field();
        let mut fields = std::mem::take(&mut self.fields);
        while fields.pop_if(|field| field.is_empty()).is_some() {}
        if !fields.is_empty() {
            self.records.push(Record { line: self.begun, fields });
        }
        self.line += 1;
        self.begun = self.line;
    }
}

/// A field without the apostrophe that keeps a spreadsheet from taking it for a formula.
fn unmarked(field: &str) -> &str {
    field.strip_prefix('\'').filter(|rest| rest.starts_with(FORMULA)).unwrap_or(field)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csv;

    fn cut(text: &str) -> Vec<(usize, Vec<String>)> {
        records(text.as_bytes()).unwrap().into_iter().map(|record| (record.line, record.fields)).collect()
    }

    fn record(line: usize, fields: &[&str]) -> (usize, Vec<String>) {
        (line, fields.iter().map(|&field| field.to_owned()).collect())
    }

    #[test]
    fn tables_are_read_as_spreadsheets_leave_them() {
        let expected = [record(1, &["tail", "name"]), record(3, &["EC-MXA", "C, big"]), record(4, &["EC-MXB", "A"])];
        for text in [
            "tail,name\n\nEC-MXA,\"C, big\"\nEC-MXB,A",
            "\u{feff}tail,name,,\r\n,,,\r\nEC-MXA,\"C, big\",,\r\nEC-MXB,A,,\r\n,,,\r\n",
            "tail , name\n \n EC-MXA , \"C, big\" \nEC-MXB,A\n\n\n",
            "tail,name\r\rEC-MXA,\"C, big\"\rEC-MXB,A\r",
        ] {
            assert_eq!(cut(text), expected, "{text:?}");
        }
        assert_eq!(cut(""), []);
    }

    #[test]
    fn a_field_of_two_lines_does_not_shift_the_count() {
        let text = "a,\"x\ny \"\"z\"\"\"\nb,c\n";
        assert_eq!(cut(text), [record(1, &["a", "x\ny \"z\""]), record(3, &["b", "c"])]);
    }

    #[test]
    fn what_was_written_is_read() {
        let fields = ["=1+1", "-A", "a,b", "say \"x\"", "", "'quoted'", "7"].map(str::to_owned);
        let text = csv::line(fields.clone());
        assert_eq!(cut(&text), [(1, fields.to_vec())], "{text}");
    }

    #[test]
    fn what_is_no_table_is_told_with_its_line() {
        let refused = |bytes: &[u8]| records(bytes).unwrap_err();
        assert_eq!(refused(b"a\nb,\"c\nd\n").line, 2);
        let other = refused(b"a\nb,\xe9\n");
        assert_eq!((other.line, other.detail.contains("UTF-8")), (2, true));
    }
}
