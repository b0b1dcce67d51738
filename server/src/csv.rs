//! Tables as RFC 4180 wants them, in which nothing is a formula.

mod reader;

pub use reader::{Record, records};

/// Characters with which spreadsheets begin a formula.
const FORMULA: [char; 11] = ['=', '+', '-', '@', '\t', '\r', '\n', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}'];

/// One record with its end of line.
pub fn line(fields: impl IntoIterator<Item = String>) -> String {
    let fields: Vec<String> = fields.into_iter().map(plain).map(quoted).collect();
    fields.join(",") + "\r\n"
}

/// A field that no spreadsheet takes for a formula: an apostrophe stands before a text that begins like one.
fn plain(field: String) -> String {
    if field.starts_with(FORMULA) && field.parse::<f64>().is_err() { format!("'{field}") } else { field }
}

/// A field, in quotes where it holds what would end it.
fn quoted(field: String) -> String {
    if field.contains(['"', ',', '\r', '\n']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_a_formula() {
        let formulas = ["=1+1", "+A1", "-2+3", "@SUM(A1)", "\t=1", "=HYPERLINK(\"x\",\"y\")", "\u{ff1d}1", "-"];
        for formula in formulas {
            let written = line([formula.to_owned()]);
            assert!(written.trim_start_matches('"').starts_with('\''), "{written}");
        }
        let numbers = ["-3.25", "+1", "-1e-7", "0", "A=1", "EC-MXA", ""].map(str::to_owned);
        assert_eq!(line(numbers), "-3.25,+1,-1e-7,0,A=1,EC-MXA,\r\n");
    }

    #[test]
    fn what_would_end_a_field_is_quoted() {
        let fields = ["plain", "a,b", "say \"x\"", "", "two\nlines"].map(str::to_owned);
        assert_eq!(line(fields), "plain,\"a,b\",\"say \"\"x\"\"\",,\"two\nlines\"\r\n");
    }
}
