//! Columns that fit a width: where they do not, long cells are cut in the middle, then columns leave in a stated order. No line is
//! ever wrapped.

use crate::terminal::{beginning, cells, shortened};

/// Cells between two columns.
const GAP: usize = 2;

/// So wide may the cells of a column that stays be before another one leaves.
const EASE: usize = 16;

/// One column.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Its heading.
    pub heading: &'static str,
    /// Its cells are cut to no less than this.
    pub least: usize,
    /// The lower, the sooner it leaves; `None` for one that stays.
    pub leaves: Option<u8>,
}

/// A column whose cells are never cut.
pub const WHOLE: usize = usize::MAX;

/// One cell: its text, and how a terminal with colours shows it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    text: String,
    style: Option<Style>,
}

/// How a terminal with colours shows a cell. No meaning is in a colour alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// What has failed.
    Alarm,
    /// What cannot wait.
    Hot,
    /// What can wait for a while.
    Warm,
    /// What nobody knows.
    Odd,
    /// What is well.
    Calm,
    /// What is not to be relied on.
    Faint,
}

impl Style {
    fn code(self) -> &'static str {
        match self {
            Self::Alarm => "1;31",
            Self::Hot => "31",
            Self::Warm => "33",
            Self::Odd => "36",
            Self::Calm => "32",
            Self::Faint => "2",
        }
    }
}

impl Cell {
    /// A cell in the colour of the terminal.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), style: None }
    }

    /// The same in a style.
    pub fn styled(self, style: Style) -> Self {
        Self { style: Some(style), ..self }
    }

    fn fitted(&self, width: usize, is_coloured: bool) -> String {
        let text = shortened(&self.text, width);
        let padding = " ".repeat(width - cells(&text));
        match self.style.filter(|_| is_coloured) {
            Some(style) => format!("\u{1b}[{}m{text}\u{1b}[0m{padding}", style.code()),
            None => text + &padding,
        }
    }
}

/// The lines of a table: its headings, then its rows.
pub fn fitted(columns: &[Column], rows: &[Vec<Cell>], width: usize, is_coloured: bool) -> Vec<String> {
    let widths = widths(columns, rows, width);
    let headings = columns.iter().map(|column| Cell::new(column.heading)).collect();
    let line = |row: &Vec<Cell>| {
        let kept = row.iter().zip(&widths).filter_map(|(cell, width)| width.map(|width| (cell, width)));
        let line: Vec<_> = kept.map(|(cell, width)| cell.fitted(width, is_coloured)).collect();
        let line = line.join(&" ".repeat(GAP)).trim_end().to_owned();
        // Codes of colours take no cells.
        if is_coloured { line } else { beginning(&line, width) }
    };
    std::iter::once(&headings).chain(rows).map(line).collect()
}

/// How wide each column is; `None` where it left.
fn widths(columns: &[Column], rows: &[Vec<Cell>], width: usize) -> Vec<Option<usize>> {
    let natural: Vec<usize> = columns
        .iter()
        .enumerate()
        .map(|(index, column)| {
            rows.iter().map(|row| cells(&row[index].text)).chain([cells(column.heading)]).max().unwrap_or(0)
        })
        .collect();
    let least: Vec<usize> = columns.iter().zip(&natural).map(|(column, &natural)| column.least.min(natural)).collect();
    // A column that says nothing takes no place.
    let is_said = |index: &usize| rows.is_empty() || rows.iter().any(|row| !row[*index].text.is_empty());
    let mut kept: Vec<usize> = (0..columns.len()).filter(is_said).collect();
    let taken = |kept: &[usize], widths: &[usize]| {
        kept.iter().map(|&index| widths[index]).sum::<usize>() + GAP * kept.len().saturating_sub(1)
    };
    // What stays is cut only when nothing is left that leaves.
    let stays = |index: usize| columns[index].leaves.is_none();
    let eased: Vec<usize> =
        (0..columns.len()).map(|index| if stays(index) { natural[index].min(EASE) } else { least[index] }).collect();
    while taken(&kept, &eased) > width {
        let leaving = kept.iter().copied().filter(|&index| !stays(index));
        let Some(first) = leaving.min_by_key(|&index| columns[index].leaves) else { break };
        kept.retain(|&index| index != first);
    }
    let least = if kept.iter().all(|&index| stays(index)) { least } else { eased };
    let mut widths = natural;
    while taken(&kept, &widths) > width {
        let cut = kept.iter().copied().filter(|&index| widths[index] > least[index]);
        let Some(widest) = cut.max_by_key(|&index| widths[index]) else { break };
        widths[widest] -= 1;
    }
    (0..columns.len()).map(|index| kept.contains(&index).then_some(widths[index])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [Column; 3] = [
        Column { heading: "name", least: 6, leaves: None },
        Column { heading: "note", least: 8, leaves: Some(1) },
        Column { heading: "day", least: WHOLE, leaves: None },
    ];

    fn lines(width: usize, is_coloured: bool) -> Vec<String> {
        let row = ["ABCDEFGHIJKLMNOP", "a long remark", "2026-03-01"].map(Cell::new);
        let [name, note, day] = row;
        fitted(&COLUMNS, &[vec![name, note.styled(Style::Faint), day]], width, is_coloured)
    }

    #[test]
    fn what_does_not_fit_is_cut_and_then_leaves() {
        assert_eq!(lines(80, false)[1], "ABCDEFGHIJKLMNOP  a long remark  2026-03-01");
        assert_eq!(lines(38, false)[1], "ABCDEFGHIJKLMNOP  a lo\u{2026}ark  2026-03-01");
        assert_eq!(lines(24, false), ["name          day", "ABCDEF\u{2026}LMNOP  2026-03-01"]);
        for width in 12..60 {
            assert!(lines(width, false).iter().all(|line| cells(line) <= width), "{width}");
        }
    }

    #[test]
    fn colours_take_no_cells() {
        assert!(lines(80, true)[1].contains("  \u{1b}[2ma long remark\u{1b}[0m  2026"));
        assert!(!lines(80, false)[1].contains('\u{1b}'));
    }
}
