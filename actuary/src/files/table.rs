//! CSV tables that users bring. Whatever is wrong with one is said in one line that names the file, the
//! row (the line of the file, from 1) and the column, and ends the command with exit code 2.
//!
//! One rule for all: fields are separated by commas, numbers have a decimal point, lines end as they like. Blank rows and blank
//! columns at the right, as spreadsheets leave them, are passed over; a missing value is an empty field or one of the usual
//! words for it.

mod layout;

use std::{fmt, fs, path::Path};

use csv::{ErrorKind, ReaderBuilder, StringRecord, Trim};

use domain::range::Range;

use crate::exit::Failure;

/// What stands for a missing value besides an empty field, in any case of letters: as numpy and C, pandas, R, SQL and JSON, Python,
/// Excel and old C libraries write it.
const MISSING: [&str; 12] =
    ["nan", "-nan", "+nan", "na", "<na>", "n/a", "#n/a", "null", "none", "nan(ind)", "-nan(ind)", "1.#qnan"];

/// A CSV file in memory: rows of equal length, at least one, below a header or without one.
#[derive(Debug)]
pub struct Table {
    /// The file as the user named it.
    name: String,
    /// Names of the columns; empty without a header.
    header: Vec<String>,
    rows: Vec<StringRecord>,
    /// Line of the file that each row begins at, from 1.
    lines: Vec<usize>,
}

impl Table {
    /// Reads a table whose first line names its columns, each once.
    pub fn open(file: &Path) -> Result<Self, Failure> {
        let mut table = Self::read(file, true)?;
        table.pass_over_nameless_columns()?;
        table.must_have_names()?;
        let length = table.header.len();
        table.fit(length, &format!("the header has {length}"))?;
        table.must_have_rows()
    }

    /// Reads a table of rows alone, of so many columns because of `reason`; an empty field is a missing value, also where a whole
    /// row of them is followed by others.
    pub fn open_headerless(file: &Path, columns: usize, reason: &str) -> Result<Self, Failure> {
        let mut table = Self::read(file, false)?.must_have_rows()?;
        table.must_be_values_alone(columns)?;
        table.drop_blanks_beyond(columns);
        let found = table.columns();
        if found != columns && table.rows.iter().all(|row| row.len() == found) {
            return Err(table.refuse(format!("{found} columns, but {reason}{}", table.hint(0, columns))));
        }
        table.fit(columns, reason)?;
        Ok(table)
    }

    fn read(file: &Path, has_header: bool) -> Result<Self, Failure> {
        let mut table =
            Self { name: file.display().to_string(), header: Vec::new(), rows: Vec::new(), lines: Vec::new() };
        let content = fs::read(file).map_err(|error| table.refuse(error))?;
        let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&content);
        layout::check(content, has_header).map_err(|reason| table.refuse(reason))?;
        let mut reader = ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(content);
        let rows = reader.records().collect::<Result<Vec<_>, _>>().map_err(|error| table.unreadable(&error))?;
        let lines = layout::lines(&rows, content);
        let is_filled = |row: &StringRecord| !layout::is_blank(row, content);
        let end = rows.iter().rposition(is_filled).map_or(0, |last| last + 1);
        let numbered = rows.into_iter().zip(lines).take(end);
        // Without names a row of commas between others is one of missing values.
        let mut kept = numbered.filter(|(row, _)| is_filled(row) || (!has_header && row.len() > 1));
        if has_header {
            let header = kept.next().map(|(row, _)| row).unwrap_or_default();
            table.header = header.iter().map(str::to_owned).collect();
        }
        (table.rows, table.lines) = kept.unzip();
        if has_header && table.header.iter().all(String::is_empty) { Err(table.refuse("is empty")) } else { Ok(table) }
    }

    fn must_have_rows(self) -> Result<Self, Failure> {
        if self.rows.is_empty() { Err(self.refuse("has no rows")) } else { Ok(self) }
    }

    /// Drops columns without a name and without a field.
    fn pass_over_nameless_columns(&mut self) -> Result<(), Failure> {
        let nameless: Vec<usize> = (0..self.header.len()).filter(|&index| self.header[index].is_empty()).collect();
        if nameless.is_empty() {
            return Ok(());
        }
        for &index in &nameless {
            let filled = |row: &StringRecord| row.get(index).is_some_and(|field| !field.is_empty());
            if let Some(row) = self.rows.iter().position(filled) {
                let hint = if index == 0 { "; an index is left out by pandas with index=False" } else { "" };
                let reason = format!("\"{}\" in a column without a name{hint}", &self.rows[row][index]);
                return Err(Column { table: self, index }.refuse(row, reason));
            }
        }
        let keep = |(index, _): &(usize, &str)| !nameless.contains(index);
        for row in &mut self.rows {
            *row = without(row, keep);
        }
        self.header.retain(|name| !name.is_empty());
        Ok(())
    }

    fn must_have_names(&self) -> Result<(), Failure> {
        let twice = self.header.iter().enumerate().find(|(i, name)| self.header[..*i].contains(name));
        if let Some((_, column)) = twice {
            return Err(self.refuse(format!("column {column} is there twice")));
        }
        match self.header.iter().all(|name| name.parse::<f64>().is_ok()) {
            true => Err(self.refuse("the first row has numbers, where the names of the columns should be")),
            false => Ok(()),
        }
    }

    /// Refuses a header, and an index, where values alone should be: read as values they shift all others.
    fn must_be_values_alone(&self, columns: usize) -> Result<(), Failure> {
        let first: Vec<&str> = self.rows[0].iter().collect();
        let number = |text: &&str| text.parse::<f64>().ok();
        let counts = |texts: &[&str]| {
            let numbers: Vec<f64> = texts.iter().filter_map(number).collect();
            let from = numbers.first().copied().filter(|first| [0.0, 1.0].contains(first));
            texts.len() > 1
                && numbers.len() == texts.len()
                && from.is_some_and(|from| numbers.iter().enumerate().all(|(i, number)| *number == from + i as f64))
        };
        // The name of an index is empty.
        let names = if first[0].is_empty() { &first[1..] } else { &first };
        if counts(names) {
            let reason = "numbers the columns, but no header is expected; pandas leaves it out with header=False";
            return Err(self.refuse_row(0, reason));
        }
        if first.iter().any(|text| !is_missing(text)) && first.iter().all(|text| number(text).is_none()) {
            return Err(self.refuse_row(0, format!("begins with \"{}\", but no header is expected", first[0])));
        }
        let leading: Vec<&str> = self.rows.iter().map(|row| &row[0]).collect();
        if first.len() == columns + 1 && counts(&leading) {
            let reason = "column 1 numbers the rows, but no index is expected; pandas leaves it out with index=False";
            return Err(self.refuse(reason));
        }
        Ok(())
    }

    fn drop_blanks_beyond(&mut self, length: usize) {
        for row in &mut self.rows {
            if row.iter().skip(length).all(str::is_empty) {
                row.truncate(length);
            }
        }
    }

    /// Refuses rows of another length; blank fields beyond it are dropped.
    fn fit(&mut self, length: usize, reason: &str) -> Result<(), Failure> {
        self.drop_blanks_beyond(length);
        match self.rows.iter().position(|row| row.len() != length) {
            None => Ok(()),
            Some(row) => {
                let (found, hint) = (self.rows[row].len(), self.hint(row, length));
                Err(self.refuse_row(row, format!("{found} fields, but {reason}{hint}")))
            }
        }
    }

    /// What may have made a row longer than it should be.
    fn hint(&self, row: usize, length: usize) -> &'static str {
        let row = &self.rows[row];
        let whole = row.iter().filter(|text| text.parse::<u64>().is_ok()).count();
        if row.len() > length && 2 * whole > row.len() { "; are there decimal commas?" } else { "" }
    }

    /// Number of rows, the header not counted; at least one.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.rows[0].len()
    }

    /// Names of the columns in their order; empty without a header.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The column of a name.
    pub fn column(&self, name: &str) -> Result<Column<'_>, Failure> {
        self.optional_column(name).ok_or_else(|| self.refuse(format!("column {name} is missing")))
    }

    /// The column of a name, if the table has it.
    pub fn optional_column(&self, name: &str) -> Option<Column<'_>> {
        let index = self.header.iter().position(|column| column == name)?;
        Some(Column { table: self, index })
    }

    /// The columns of several names.
    pub fn columns_of<N: AsRef<str>>(&self, names: &[N]) -> Result<Vec<Column<'_>>, Failure> {
        names.iter().map(|name| self.column(name.as_ref())).collect()
    }

    /// The column at a place, from 0.
    pub fn column_at(&self, index: usize) -> Column<'_> {
        assert!(index < self.columns(), "column {index} of {}", self.columns());
        Column { table: self, index }
    }

    /// Every field of a row (from 0), each a finite number.
    pub fn numbers_of_row(&self, row: usize) -> Result<Vec<f64>, Failure> {
        (0..self.columns()).map(|index| self.column_at(index).number(row)).collect()
    }

    /// The line of the file, from 1, at which a row (from 0) begins.
    pub fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    /// What is wrong with the file as a whole.
    pub fn refuse(&self, reason: impl fmt::Display) -> Failure {
        Failure::BadInput(format!("{}: {reason}", self.name))
    }

    /// What is wrong with a row (from 0).
    pub fn refuse_row(&self, row: usize, reason: impl fmt::Display) -> Failure {
        Failure::BadInput(format!("{}, row {}: {reason}", self.name, self.lines[row]))
    }

    fn unreadable(&self, error: &csv::Error) -> Failure {
        match error.kind() {
            ErrorKind::Io(error) => self.refuse(error),
            ErrorKind::Utf8 { pos, err } => {
                let line = pos.as_ref().map_or(1, csv::Position::line);
                Failure::BadInput(format!("{}, row {line}, column {}: not UTF-8 text", self.name, err.field() + 1))
            }
            _ => self.refuse(error),
        }
    }
}

/// The fields of a row that are kept, by their place.
fn without(row: &StringRecord, keep: impl Fn(&(usize, &str)) -> bool) -> StringRecord {
    let mut kept: StringRecord = row.iter().enumerate().filter(keep).map(|(_, field)| field).collect();
    kept.set_position(row.position().cloned());
    kept
}

fn is_missing(text: &str) -> bool {
    text.is_empty() || MISSING.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// One column of a table.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    table: &'a Table,
    index: usize,
}

impl<'a> Column<'a> {
    /// The field of a row (from 0), without white space around it.
    pub fn text(&self, row: usize) -> &'a str {
        &self.table.rows[row][self.index]
    }

    /// The text in a row (from 0); `None` where the value is missing.
    pub fn optional_text(&self, row: usize) -> Option<&'a str> {
        Some(self.text(row)).filter(|text| !is_missing(text))
    }

    /// The name in a row (from 0).
    pub fn name(&self, row: usize) -> Result<&'a str, Failure> {
        self.optional_text(row).ok_or_else(|| self.missing(row))
    }

    /// The finite number in a row (from 0).
    pub fn number(&self, row: usize) -> Result<f64, Failure> {
        self.optional_number(row)?.ok_or_else(|| self.missing(row))
    }

    /// The finite number in a row (from 0); `None` where the value is missing.
    pub fn optional_number(&self, row: usize) -> Result<Option<f64>, Failure> {
        let Some(text) = self.optional_text(row) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            Ok(number) => Err(self.refuse(row, format!("{number} is not finite"))),
            Err(_) if text.contains(',') && text.replace(',', ".").parse::<f64>().is_ok() => {
                Err(self.refuse(row, format!("\"{text}\" has a decimal comma: write a decimal point")))
            }
            Err(_) => Err(self.refuse(row, format!("\"{text}\" is not a number"))),
        }
    }

    /// The number in a row (from 0), if there is one, as an upload would have to give it.
    pub fn optional_within(&self, row: usize, range: Range) -> Result<Option<f64>, Failure> {
        let number = self.optional_number(row)?;
        match number.and_then(|number| range.refusal(number)) {
            Some(refusal) => Err(self.refuse(row, refusal)),
            None => Ok(number),
        }
    }

    /// The finite numbers of all rows.
    pub fn numbers(&self) -> Result<Vec<f64>, Failure> {
        (0..self.table.rows()).map(|row| self.number(row)).collect()
    }

    fn missing(&self, row: usize) -> Failure {
        match self.text(row) {
            "" => self.refuse(row, "empty"),
            word => self.refuse(row, format!("\"{word}\": a value is missing")),
        }
    }

    /// What is wrong with the field of a row (from 0).
    pub fn refuse(&self, row: usize, reason: impl fmt::Display) -> Failure {
        let column = match self.table.header.get(self.index).filter(|name| !name.is_empty()) {
            Some(name) => name.clone(),
            None => (self.index + 1).to_string(),
        };
        let Table { name, .. } = self.table;
        Failure::BadInput(format!("{name}, row {}, column {column}: {reason}", self.table.lines[row]))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// What is said about a file `t.csv` of these bytes.
    fn said<T: fmt::Debug>(content: &[u8], look: impl Fn(&Path) -> Result<T, Failure>) -> String {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("t.csv");
        fs::write(&file, content).unwrap();
        let line = look(&file).unwrap_err().to_string();
        line.split_once("t.csv").unwrap().1.to_owned()
    }

    /// A table of two columns without a header.
    fn two(file: &Path) -> Result<Table, Failure> {
        Table::open_headerless(file, 2, "theta.csv has 2")
    }

    /// The numbers of a table; `None` where one is missing.
    fn numbers(content: &str, open: impl Fn(&Path) -> Result<Table, Failure>) -> Vec<Vec<Option<f64>>> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("t.csv");
        fs::write(&file, content).unwrap();
        let table = open(&file).unwrap();
        let of_row = |row| (0..table.columns()).map(|i| table.column_at(i).optional_number(row).unwrap()).collect();
        (0..table.rows()).map(of_row).collect()
    }

    #[test]
    fn a_number_outside_what_an_upload_may_give_is_told_with_its_place() {
        let within = |file: &Path| {
            let table = Table::open(file)?;
            table.column("q")?.optional_within(1, domain::range::DYNAMIC_PRESSURE)
        };
        assert_eq!(said(b"q\n8.8\n-3\n", within), ", row 3, column q: -3 is outside 0 to 1000000 Pa");
    }

    #[test]
    fn what_a_spreadsheet_leaves_blank_is_passed_over() {
        let expected = [[Some(1.0), Some(2.0)], [Some(3.0), None]];
        for content in
            ["a,b\n1,2\n3,\n", "a,b,,\n1,2,,\n3,,,\n", "\n,,\na,b,\n , \n1,2\n,,,,\n3,,\n,,\n\n", "a,,b\n1,,2\n3,,\n"]
        {
            assert_eq!(numbers(content, Table::open), expected, "{content:?}");
        }
        for content in ["5,2\n3,\n", "5,2,,\n3,,,\n", "\n5,2\n3,\n,\n,,,\n"] {
            assert_eq!(numbers(content, two), [[Some(5.0), Some(2.0)], [Some(3.0), None]], "{content:?}");
        }
        // Without names a row between others is one of missing values.
        assert_eq!(numbers("5,2\n,\n3,\n", two), [[Some(5.0), Some(2.0)], [None, None], [Some(3.0), None]]);
        // pandas writes a missing value of the only column so, that no line is blank.
        assert_eq!(numbers("r\n1\n\"\"\n\n2\n", Table::open), [[Some(1.0)], [None], [Some(2.0)]]);
        let named = |content: &str| said(content.as_bytes(), Table::open);
        assert_eq!(named("a,,b\n1,,2\n3,x,4\n"), ", row 3, column 2: \"x\" in a column without a name");
        assert!(named(",a,b\n0,1,2\n").starts_with(", row 2, column 1: \"0\" in a column without a name; an index"));
    }

    #[test]
    fn a_missing_value_has_many_spellings_and_one_meaning() {
        for word in ["", "nan", "NaN", "NA", "N/A", "#N/A", "null", "NULL", "None", "<NA>", "-nan", "-nan(ind)"] {
            assert_eq!(numbers(&format!("a,b\n1,{word}\n"), Table::open), [[Some(1.0), None]], "{word}");
            assert_eq!(numbers(&format!("{word},5\n"), two), [[None, Some(5.0)]], "{word}");
        }
        for word in ["-", "x", "inf", "nano"] {
            said(format!("a\n{word}\n").as_bytes(), |file| Table::open(file)?.column("a")?.optional_number(0));
        }
    }

    #[test]
    fn another_layout_is_named() {
        let table = |content: &str| said(content.as_bytes(), Table::open);
        let rows = |content: &str| said(content.as_bytes(), two);
        assert!(table("a;b\n1;2\n").starts_with(": fields are separated by semicolons"));
        assert!(table("a\tb\n1\t2\n").starts_with(": fields are separated by tabs"));
        assert!(rows("1 2\n3 4\n").starts_with(": fields are separated by spaces"));
        assert!(rows("0,5;0,6\n").starts_with(": fields are separated by semicolons"));
        assert_eq!(rows("0,5,0,6\n"), ": 4 columns, but theta.csv has 2; are there decimal commas?");
        assert_eq!(table("a,b\n0,5,0,6\n"), ", row 2: 4 fields, but the header has 2; are there decimal commas?");
        let comma = |content: &str| said(content.as_bytes(), |file| Table::open(file)?.column("a")?.numbers());
        assert_eq!(comma("a,b\n\"0,5\",1\n"), ", row 2, column a: \"0,5\" has a decimal comma: write a decimal point");
        assert!(said(b"\xff\xfea\0,\0b\0\n\0", Table::open).contains("UTF-16"));
        assert!(said(b"SQLite format 3\0\x10\0", Table::open).contains("is no text"));
    }

    #[test]
    fn a_header_or_an_index_is_never_taken_for_values() {
        let rows = |content: &str| said(content.as_bytes(), two);
        assert!(rows("0,1\n5,6\n").starts_with(", row 1: numbers the columns, but no header is expected"));
        assert!(rows("1,2\n5,6\n").starts_with(", row 1: numbers the columns"));
        assert!(rows(",0,1\n0,5,6\n").starts_with(", row 1: numbers the columns"));
        assert!(rows("y1,y2\n5,6\n").starts_with(", row 1: begins with \"y1\", but no header is expected"));
        assert!(rows("0,5,6\n1,7,8\n").starts_with(": column 1 numbers the rows, but no index is expected"));
        assert!(said(b"0.1,0.2\n5,6\n", Table::open).starts_with(": the first row has numbers, where the names"));
    }

    #[test]
    fn rows_are_counted_whatever_ends_a_line() {
        for end in ["\n", "\r\n", "\r"] {
            let content = ["k1,k2", "1,2", "", "\"1\n\",2", "3,abc", ""].join(end);
            let line = said(content.as_bytes(), |file| Table::open(file)?.column("k2")?.numbers());
            assert_eq!(line, ", row 6, column k2: \"abc\" is not a number", "{end:?}");
        }
    }

    #[test]
    fn fields_are_found_by_name_and_row() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("t.csv");
        fs::write(&file, "\u{feff}id, k1 ,k2\na,1,\n\"b,c\",-2.5e-3,0\r\n").unwrap();
        let table = Table::open(&file).unwrap();
        assert_eq!((table.rows(), table.header()), (2, ["id", "k1", "k2"].map(str::to_owned).as_slice()));
        assert_eq!(table.column("id").unwrap().text(1), "b,c");
        assert_eq!(table.column("k1").unwrap().numbers().unwrap(), [1.0, -2.5e-3]);
        let k2 = table.optional_column("k2").unwrap();
        assert_eq!((k2.optional_number(0).unwrap(), k2.optional_number(1).unwrap()), (None, Some(0.0)));
        assert!(table.optional_column("k3").is_none());
    }

    #[test]
    fn a_wrong_field_is_named_by_row_and_column() {
        let k2 = |content: &str| said(content.as_bytes(), |file| Table::open(file)?.column("k2")?.numbers());
        assert_eq!(k2("k1,k2\n1,2\n\n3,abc\n"), ", row 4, column k2: \"abc\" is not a number");
        assert_eq!(k2("k1,k2\r\n1,2\r\n\r\n\r\n3,abc\r\n"), ", row 5, column k2: \"abc\" is not a number");
        assert_eq!(k2("k1,k2\n\"1\n\",2\n3,abc\n"), ", row 4, column k2: \"abc\" is not a number");
        assert_eq!(k2("k1,k2\n1,NaN\n"), ", row 2, column k2: \"NaN\": a value is missing");
        assert_eq!(k2("k1,k2\n1,1e999\n"), ", row 2, column k2: inf is not finite");
        assert_eq!(k2("k1,k2\n1,\n"), ", row 2, column k2: empty");
        assert_eq!(k2("k1,k3\n1,2\n"), ": column k2 is missing");
        let row = |content: &str| said(content.as_bytes(), |file| two(file)?.numbers_of_row(1));
        assert_eq!(row("5,2\n3,x\n"), ", row 2, column 2: \"x\" is not a number");
    }

    #[test]
    fn a_wrong_shape_is_refused() {
        let open = |content: &[u8]| said(content, Table::open);
        assert_eq!(open(b""), ": is empty");
        assert_eq!(open(b"k1,k2\n"), ": has no rows");
        assert_eq!(open(b"k1,k1\n1,2\n"), ": column k1 is there twice");
        assert_eq!(open(b"k1,k2\n1,2\n1\n"), ", row 3: 1 fields, but the header has 2");
        assert_eq!(open(b"k1,k2\n1,2\n1,\xff\n"), ", row 3, column 2: not UTF-8 text");
        assert_eq!(said(b"5,2\n1.5,2.5,3.5\n", two), ", row 2: 3 fields, but theta.csv has 2");
        assert_eq!(said(b"5\n7\n", two), ": 1 columns, but theta.csv has 2");
        assert_eq!(said(b"", two), ": has no rows");
        let absent = Table::open(Path::new("no-such.csv")).unwrap_err().to_string();
        assert!(absent.starts_with("no-such.csv: No such file"), "{absent}");
    }
}
