//! Figures of a table that have a range: faults and times.

use super::table::Column;
use crate::exit::Failure;

/// No life is longer, flight hours.
const LONGEST_FH: f64 = 1e6;

/// A fault of one row: a number in [0, 1].
pub fn fault(column: &Column, row: usize) -> Result<f64, Failure> {
    match column.number(row)? {
        k if (0.0..=1.0).contains(&k) => Ok(k),
        k => Err(column.refuse(row, format!("{k} is outside 0 to 1"))),
    }
}

/// Flight hours since the start of a life.
pub fn time(column: &Column, row: usize) -> Result<f64, Failure> {
    match column.number(row)? {
        t_fh if (0.0..=LONGEST_FH).contains(&t_fh) => Ok(t_fh),
        t_fh => {
            let unit = if t_fh > LONGEST_FH { ": are these seconds?" } else { "" };
            Err(column.refuse(row, format!("{t_fh} is outside 0 to {LONGEST_FH} flight hours{unit}")))
        }
    }
}
