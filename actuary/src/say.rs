//! Words of a command. Their reader may leave before the end, as `head` does: then the command goes on silently, and its
//! exit code tells how it went. (A process that took SIGPIPE instead would also die of a caller that hangs up.)

use std::{
    fmt::{Arguments, Display},
    io::{self, ErrorKind, Write},
    sync::OnceLock,
};

/// Why standard output did not take what was said first.
static UNSAID: OnceLock<io::Error> = OnceLock::new();

/// Says a line on standard output.
macro_rules! say {
    ($($words:tt)*) => { $crate::say::line(format_args!($($words)*)) };
}

/// Says a line on standard error.
macro_rules! note {
    ($($words:tt)*) => { $crate::say::aside(format_args!($($words)*)) };
}

pub(crate) use {note, say};

/// A line on standard output.
pub fn line(words: Arguments<'_>) {
    text(format_args!("{words}\n"));
}

/// Text on standard output, as it is.
pub fn text(text: impl Display) {
    keep(write!(io::stdout(), "{text}"));
}

/// A line on standard error; where that is gone, nobody is left to be told.
pub fn aside(words: Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{words}");
}

/// Why something that was said is not where standard output leads, such as a full disk; a reader that left is no reason.
pub fn failure() -> Option<&'static io::Error> {
    keep(io::stdout().flush());
    UNSAID.get()
}

fn keep(said: io::Result<()>) {
    if let Err(error) = said
        && error.kind() != ErrorKind::BrokenPipe
    {
        UNSAID.get_or_init(|| error);
    }
}
