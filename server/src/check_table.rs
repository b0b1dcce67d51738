//! The checks of many tails in one table, written and read.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Checks, Day, Invalid, TailNumber};
use proto::{
    answer::{CheckItem, ChecksAnswer},
    json::CheckBody,
};

use crate::csv::{self, Record};

/// Most rows of a table that is read.
pub const MAX_ROWS: usize = 10_000;
const COLUMNS: [&str; 5] = ["tail", "name", "date", "remaining_fh", "as_of"];

/// The head of a table.
pub fn head() -> String {
    csv::line(COLUMNS.map(str::to_owned))
}

/// The rows of a tail; those of checks that are over are left out, since nobody can set them any longer.
pub fn rows(of: &ChecksAnswer) -> String {
    let row = |check: &CheckItem| {
        let remaining_fh = check.remaining_fh.map(|hours| hours.to_string());
        let optional = [check.date.clone(), remaining_fh, check.as_of.clone()].map(Option::unwrap_or_default);
        csv::line([of.tail.clone(), check.name.clone()].into_iter().chain(optional))
    };
    of.checks.iter().filter(|check| !check.past).map(row).collect()
}

/// The checks that a table tells `today` of tails, or everything that is wrong with it, by pointers of row and column such as
/// `#/3/date`; the head is row 1.
pub fn read(bytes: &[u8], tails: &BTreeSet<TailNumber>, today: Day) -> Result<BTreeMap<TailNumber, Checks>, Invalid> {
    let records = csv::records(bytes).map_err(|no_table| {
        Invalid::one(format!("#/{}", no_table.line), format!("row {}: {}", no_table.line, no_table.detail))
    })?;
    let Some((head, records)) = records.split_first() else { return Err(Invalid::one("#", "the table is empty")) };
    let columns = columns(head)?;
    match records.len() {
        0 => return Err(Invalid::one("#", "the table has no rows below its head")),
        1..=MAX_ROWS => {}
        many => return Err(Invalid::one("#", format!("{many} rows; a table has at most {MAX_ROWS}"))),
    }
    let mut faults = Faults::default();
    let mut named: BTreeMap<TailNumber, Vec<Row>> = BTreeMap::new();
    for record in records {
        if let Some((tail, row)) = Row::read(record, &columns, tails, &mut faults) {
            named.entry(tail).or_default().push(row);
        }
    }
    let checks = named.into_iter().filter_map(|(tail, rows)| Some((tail, checked(&rows, today, &mut faults)?)));
    let checks = checks.collect();
    faults.into_result(checks)
}

/// Where each column stands.
fn columns(head: &Record) -> Result<[Option<usize>; 5], Invalid> {
    let refuse = |detail: String| Err(Invalid::one(format!("#/{}", head.line), format!("row {}: {detail}", head.line)));
    let told = COLUMNS.join(",");
    if let [only] = &head.fields[..]
        && only.contains([';', '\t'])
    {
        return refuse("columns are separated by commas".to_owned());
    }
    for (i, name) in head.fields.iter().enumerate() {
        if !COLUMNS.contains(&name.as_str()) {
            return refuse(format!("there is no column {name:?}: the first row has to be {told}"));
        }
        if head.fields[..i].contains(name) {
            return refuse(format!("column {name} is there twice"));
        }
    }
    let columns = COLUMNS.map(|wanted| head.fields.iter().position(|name| name == wanted));
    match columns[..2].iter().position(Option::is_none) {
        Some(missing) => refuse(format!("column {} is missing: the first row has to be {told}", COLUMNS[missing])),
        None => Ok(columns),
    }
}

/// What is wrong, by row and column.
#[derive(Default)]
struct Faults(Vec<(usize, &'static str, String)>);

impl Faults {
    fn push(&mut self, line: usize, column: &'static str, detail: impl Into<String>) {
        self.0.push((line, column, detail.into()));
    }

    fn into_result<T>(mut self, value: T) -> Result<T, Invalid> {
        self.0.sort_by_key(|(line, ..)| *line);
        let mut invalid = Invalid::default();
        for (line, column, detail) in self.0 {
            invalid.push(format!("#/{line}/{column}"), format!("row {line}, column {column}: {detail}"));
        }
        invalid.into_result(Some(value))
    }
}

/// A row of a table.
struct Row {
    line: usize,
    check: CheckBody,
}

impl Row {
    fn read(
        record: &Record,
        columns: &[Option<usize>; 5],
        tails: &BTreeSet<TailNumber>,
        faults: &mut Faults,
    ) -> Option<(TailNumber, Self)> {
        let line = record.line;
        let width = columns.iter().flatten().count();
        if let Some(beyond) = record.fields.get(width) {
            faults.push(line, COLUMNS[4], format!("behind it stands {beyond:?}, in a column without a name"));
            return None;
        }
        let field = |column: usize| {
            let text = columns[column].and_then(|at| record.fields.get(at)).map(String::as_str).unwrap_or_default();
            (!text.is_empty()).then(|| text.to_owned())
        };
        let remaining_fh = field(3).map(|text| text.parse::<f64>().map_err(|_| text));
        if let Some(Err(text)) = &remaining_fh {
            faults.push(line, COLUMNS[3], format!("{text:?} is no number such as 412.5"));
        }
        let tail = match field(0).unwrap_or_default().parse::<TailNumber>() {
            Ok(tail) if tails.contains(&tail) => Some(tail),
            Ok(tail) => {
                faults.push(line, COLUMNS[0], format!("tail {tail} is not known"));
                None
            }
            Err(error) => {
                faults.push(line, COLUMNS[0], error.to_string());
                None
            }
        };
        let remaining_fh = remaining_fh.transpose().ok()?;
        let check = CheckBody { name: field(1).unwrap_or_default(), date: field(2), remaining_fh, as_of: field(4) };
        Some((tail?, Self { line, check }))
    }
}

/// The checks of one tail.
fn checked(rows: &[Row], today: Day, faults: &mut Faults) -> Option<Checks> {
    let (mut once, mut bodies): (Vec<&Row>, Vec<CheckBody>) = Default::default();
    for row in rows {
        let name = &row.check.name;
        match once.iter().find(|before| before.check.name == *name && !name.is_empty()) {
            Some(before) => faults.push(row.line, COLUMNS[1], format!("{name:?} is in row {} already", before.line)),
            None => {
                once.push(row);
                bodies.push(row.check.clone());
            }
        }
    }
    let refused = match CheckBody::checked(&bodies, today) {
        Ok(checks) => return Some(checks),
        Err(refused) => refused,
    };
    for violation in refused.violations {
        let mut steps = violation.pointer.trim_start_matches("#/").split('/');
        let row = steps.next().and_then(|step| step.parse::<usize>().ok()).and_then(|i| once.get(i));
        let column = steps.next().and_then(|step| COLUMNS.iter().find(|column| **column == step));
        let line = row.or(once.first()).map_or(1, |row| row.line);
        faults.push(line, column.unwrap_or(&COLUMNS[0]), violation.detail);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const TODAY: &str = "2026-03-01";

    fn table(text: &str) -> Result<BTreeMap<TailNumber, Checks>, Invalid> {
        let tails = ["EC-MXA", "EC-MXB"].map(|tail| tail.parse().unwrap()).into();
        read(text.as_bytes(), &tails, TODAY.parse().unwrap())
    }

    #[test]
    fn the_checks_of_each_tail_are_read() {
        let text = "\u{feff}name,tail,date,remaining_fh,as_of,,\r\nC,EC-MXA,2026-10-01,,,,\r\n,,,,,,\r\n\
                    A,EC-MXB,,412.5,2026-02-20\r\nA,EC-MXA,,100,2026-03-01\r\n";
        let read = table(text).unwrap();
        let of = |tail: &str| {
            let checks = &read[&tail.parse::<TailNumber>().unwrap()];
            checks.iter().map(|check| format!("{} {:?}", check.name, check.due)).collect::<Vec<_>>().join("; ")
        };
        assert_eq!(read.len(), 2);
        assert!(of("EC-MXA").starts_with("C Date") && of("EC-MXA").contains("; A Hours { remaining_fh: 100.0"));
        assert!(of("EC-MXB").starts_with("A Hours { remaining_fh: 412.5"));
        assert_eq!(table("tail,name,date\nEC-MXA,C,2026-10-01\n").unwrap().len(), 1, "hours need no columns");
    }

    #[test]
    fn everything_that_is_wrong_is_named_by_row_and_column() {
        let text = "tail,name,date,remaining_fh,as_of\n\
                    EC-MXZ,C,2026-10-01,,\n\
                    EC-MXA,C,2026-02-30,,\n\
                    EC-MXA,A,,many,2026-02-20\n\
                    ,A,2026-10-01,,\n\
                    \n\
                    EC-MXB,C,2026-10-01,,\n\
                    EC-MXB,C,2026-11-01,,\n\
                    EC-MXB,D,2026-10-01,10,2026-02-20\n\
                    EC-MXB,E,2026-10-01,,,more\n";
        let refused = table(text).unwrap_err();
        let told: Vec<_> = refused.violations.iter().map(|one| one.pointer.as_str()).collect();
        let expected = ["#/2/tail", "#/3/date", "#/4/remaining_fh", "#/5/tail", "#/8/name", "#/9/date", "#/10/as_of"];
        assert_eq!(told, expected, "{refused}");
        assert!(refused.violations[0].detail.contains("row 2, column tail: tail EC-MXZ is not known"), "{refused}");
        assert!(refused.violations[4].detail.contains("row 7 already"), "{refused}");
    }

    #[test]
    fn a_head_that_is_none_is_told_what_it_has_to_be() {
        for (text, words) in [
            ("", "is empty"),
            ("tail,name,date\n", "no rows"),
            ("EC-MXA,C,2026-10-01\n", "there is no column \"EC-MXA\""),
            ("tail;name;date\nEC-MXA;C;2026-10-01\n", "separated by commas"),
            ("tail,date\nEC-MXA,2026-10-01\n", "column name is missing"),
            ("tail,name,tail\nEC-MXA,C,\n", "column tail is there twice"),
            ("tail,name,date\nEC-MXA,\"C,2026-10-01\n", "not closed"),
        ] {
            let refused = table(text).unwrap_err().to_string();
            assert!(refused.contains(words), "{text:?}: {refused}");
        }
        let rows = "EC-MXA,C,2026-10-01\n".repeat(MAX_ROWS + 1);
        assert!(table(&format!("tail,name,date\n{rows}")).unwrap_err().to_string().contains("at most 10000"));
    }
}
