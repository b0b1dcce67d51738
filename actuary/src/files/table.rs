//! CSV tables that users bring. Whatever is wrong with one is said in one line that names the file, the
//! row (the line of the file, from 1) and the column, and ends the command with exit code 2.

use std::{fmt, fs, path::Path};

use csv::{ErrorKind, ReaderBuilder, StringRecord, Trim};

use crate::exit::Failure;

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
        let table = Self::read(file, true)?;
        let twice = table.header.iter().enumerate().find(|(i, name)| table.header[..*i].contains(name));
        if let Some((_, column)) = twice {
            return Err(table.refuse(format!("column {column} is there twice")));
        }
        table.check_lengths(table.header.len(), "the header has")?;
        Ok(table)
    }

    /// Reads a table of rows alone.
    pub fn open_headerless(file: &Path) -> Result<Self, Failure> {
        let table = Self::read(file, false)?;
        table.check_lengths(table.rows[0].len(), "the first has")?;
        Ok(table)
    }

    fn read(file: &Path, has_header: bool) -> Result<Self, Failure> {
        let mut table =
            Self { name: file.display().to_string(), header: Vec::new(), rows: Vec::new(), lines: Vec::new() };
        let content = fs::read(file).map_err(|error| table.refuse(error))?;
        let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&content);
        let mut reader =
            ReaderBuilder::new().has_headers(has_header).flexible(true).trim(Trim::All).from_reader(content);
        if has_header {
            let header = reader.headers().map_err(|error| table.unreadable(&error))?;
            table.header = header.iter().map(str::to_owned).collect();
        }
        table.rows = reader.into_records().collect::<Result<_, _>>().map_err(|error| table.unreadable(&error))?;
        table.lines = lines(&table.rows, content);
        match (has_header && table.header.is_empty(), table.rows.is_empty()) {
            (true, _) => Err(table.refuse("is empty")),
            (false, true) => Err(table.refuse("has no rows")),
            (false, false) => Ok(table),
        }
    }

    fn check_lengths(&self, length: usize, standard: &str) -> Result<(), Failure> {
        match self.rows.iter().position(|row| row.len() != length) {
            None => Ok(()),
            Some(row) => {
                let found = self.rows[row].len();
                Err(self.refuse_row(row, format!("{found} fields, but {standard} {length}")))
            }
        }
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

/// Lines at which rows begin. A record's own position is that of the line breaks before it, which may
/// stand for blank lines or for the second half of a Windows line break.
fn lines(rows: &[StringRecord], content: &[u8]) -> Vec<usize> {
    let (mut line, mut seen) = (1, 0);
    let begin = |row: &StringRecord| {
        let offset = row.position().map_or(0, |position| position.byte() as usize);
        let breaks = content[offset..].iter().take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
        line += content[seen..offset + breaks].iter().filter(|byte| **byte == b'\n').count();
        seen = offset + breaks;
        line
    };
    rows.iter().map(begin).collect()
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

    /// The finite number in a row (from 0).
    pub fn number(&self, row: usize) -> Result<f64, Failure> {
        let text = self.text(row);
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(number) => Err(self.refuse(row, format!("{number} is not finite"))),
            Err(_) if text.is_empty() => Err(self.refuse(row, "empty")),
            Err(_) => Err(self.refuse(row, format!("\"{text}\" is not a number"))),
        }
    }

    /// The finite number in a row (from 0); `None` where the field is empty.
    pub fn optional_number(&self, row: usize) -> Result<Option<f64>, Failure> {
        if self.text(row).is_empty() { Ok(None) } else { self.number(row).map(Some) }
    }

    /// The finite numbers of all rows.
    pub fn numbers(&self) -> Result<Vec<f64>, Failure> {
        (0..self.table.rows()).map(|row| self.number(row)).collect()
    }

    /// What is wrong with the field of a row (from 0).
    pub fn refuse(&self, row: usize, reason: impl fmt::Display) -> Failure {
        let column = match self.table.header.get(self.index) {
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
        assert_eq!(k2("k1,k2\n1,NaN\n"), ", row 2, column k2: NaN is not finite");
        assert_eq!(k2("k1,k2\n1,1e999\n"), ", row 2, column k2: inf is not finite");
        assert_eq!(k2("k1,k2\n1,\n"), ", row 2, column k2: empty");
        assert_eq!(k2("k1,k3\n1,2\n"), ": column k2 is missing");
        let row = |content: &str| said(content.as_bytes(), |file| Table::open_headerless(file)?.numbers_of_row(1));
        assert_eq!(row("1,2\n3,x\n"), ", row 2, column 2: \"x\" is not a number");
    }

    #[test]
    fn a_wrong_shape_is_refused() {
        let open = |content: &[u8]| said(content, Table::open);
        assert_eq!(open(b""), ": is empty");
        assert_eq!(open(b"k1,k2\n"), ": has no rows");
        assert_eq!(open(b"k1,k1\n1,2\n"), ": column k1 is there twice");
        assert_eq!(open(b"k1,k2\n1,2\n1\n"), ", row 3: 1 fields, but the header has 2");
        assert_eq!(open(b"k1,k2\n1,2\n1,\xff\n"), ", row 3, column 2: not UTF-8 text");
        assert_eq!(said(b"1,2\n1,2,3\n", Table::open_headerless), ", row 2: 3 fields, but the first has 2");
        assert_eq!(said(b"", Table::open_headerless), ": has no rows");
        let absent = Table::open(Path::new("no-such.csv")).unwrap_err().to_string();
        assert!(absent.starts_with("no-such.csv: No such file"), "{absent}");
    }
}
