//! The terminal while a board is watched; it is given back as it was.

use std::io::{self, Write};

use crossterm::{
    cursor, execute, queue,
    style::Print,
    terminal::{self as term, Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen},
};

use crate::{
    clock,
    table::board::Board,
    terminal::{self, beginning},
};

/// Lines around the list: counts, a gap, headings, a gap and what is known of the service.
const AROUND: usize = 5;

/// A terminal that shows a board.
pub struct Screen {
    board: Board,
    /// The first unit that is shown.
    first: usize,
    /// When something changed last.
    changed: String,
    /// Why there is no answer.
    silent: Option<String>,
}

impl Screen {
    /// Takes the terminal and draws the board.
    pub fn take(board: Board) -> io::Result<Self> {
        term::enable_raw_mode()?;
        let screen = Self { board, first: 0, changed: now(), silent: None };
        execute!(io::stdout(), EnterAlternateScreen, cursor::Hide)?;
        screen.draw()?;
        Ok(screen)
    }

    /// Another board.
    pub fn changed(&mut self, board: Board) -> io::Result<()> {
        (self.board, self.changed, self.silent) = (board, now(), None);
        self.moved(0)
    }

    /// The same board, of which the service still tells.
    pub fn answered(&mut self) -> io::Result<()> {
        if self.silent.take().is_some() { self.draw() } else { Ok(()) }
    }

    /// The same board, and no word of whether it still holds.
    pub fn unanswered(&mut self, reason: String) -> io::Result<()> {
        let is_known = self.silent.as_ref() == Some(&reason);
        self.silent = Some(reason);
        if is_known { Ok(()) } else { self.draw() }
    }

    /// The board, so many lines further.
    pub fn moved(&mut self, lines: isize) -> io::Result<()> {
        let last = self.board.units.len().saturating_sub(shown()?);
        self.first = self.first.saturating_add_signed(lines).min(last);
        self.draw()
    }

    /// Draws the board.
    pub fn draw(&self) -> io::Result<()> {
        let (columns, _) = term::size()?;
        let mut out = io::stdout();
        queue!(out, cursor::MoveTo(0, 0), Clear(ClearType::All))?;
        for (row, line) in (0..).zip(self.lines(usize::from(columns), shown()?)) {
            queue!(out, cursor::MoveTo(0, row), Print(line))?;
        }
        out.flush()
    }

    fn lines(&self, width: usize, shown: usize) -> Vec<String> {
        let table = self.board.lines(width, terminal::is_coloured());
        let counts = beginning(&self.board.counts(usize::MAX), width);
        let headings = table.first().cloned().unwrap_or_default();
        let units = table.into_iter().skip(1 + self.first).take(shown);
        let foot = [String::new(), beginning(&self.foot(shown), width)];
        [counts, String::new(), headings].into_iter().chain(units).chain(foot).collect()
    }

    fn foot(&self, shown: usize) -> String {
        let further = self.board.units.len().saturating_sub(self.first + shown);
        let further = if further > 0 { format!("{further} more below; ") } else { String::new() };
        match &self.silent {
            Some(reason) => format!("NO ANSWER, this is of {}: {reason}", self.changed),
            None => format!("{further}last change seen {}; q ends", self.changed),
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = execute!(io::stdout(), cursor::Show, LeaveAlternateScreen);
        let _ = term::disable_raw_mode();
    }
}

/// So many units fit.
fn shown() -> io::Result<usize> {
    Ok(usize::from(term::size()?.1).saturating_sub(AROUND).max(1))
}

/// The time of day, UTC.
fn now() -> String {
    let time = clock::system()().to_string();
    let time = time.split('T').nth(1).and_then(|time| time.get(..8)).unwrap_or_default();
    format!("{time} UTC")
}
