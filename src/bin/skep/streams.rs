//! Standard output and error. A reader that has gone away is no reason to stop, so what fails to be written is dropped.

use std::io::Write;

/// A line of what was asked for.
pub fn result(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A line about the run: progress, warnings and errors.
pub fn notice(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A line about something the user should know; printed even when quiet is asked for.
pub fn warning(text: &str) {
    notice(&format!("warning: {text}"));
}
