//! Lines on the terminal.

use std::io::{self, Write};
use std::sync::OnceLock;

/// What first kept a line from being printed, other than that nobody reads any more.
static LOST_LINE: OnceLock<io::Error> = OnceLock::new();

/// What kept a line from being printed, if anything did.
pub(crate) fn lost_line() -> Option<&'static io::Error> {
    LOST_LINE.get()
}

/// Prints a line. If the output is closed, the work goes on without it.
pub(crate) fn print_line(text: &str) {
    if let Err(fault) = writeln!(io::stdout(), "{text}")
        && fault.kind() != io::ErrorKind::BrokenPipe
    {
        let _ = LOST_LINE.set(fault);
    }
}

pub(crate) fn print_error_line(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
