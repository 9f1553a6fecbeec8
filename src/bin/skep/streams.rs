//! Standard output and error. Failed writes are ignored: a closed pipe must not stop a run.

use std::io::{IsTerminal, Write};

/// Whether standard error is a terminal that erases lines when it is told to. On Windows not all are.
pub fn is_screen() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|name| name == "dumb");
    std::io::stderr().is_terminal() && !is_dumb
}

/// Prints a line of the result on standard output.
pub fn result(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Prints a line about the run on standard error: progress, warnings, errors.
pub fn notice(line: &str) {
    // The line may hold a bar, behind which the cursor is not.
    let erase = if is_screen() { "\x1b[J" } else { "" };
    let _ = writeln!(std::io::stderr(), "{erase}{line}");
}

/// Prints a warning; also with `--quiet`.
pub fn warning(text: &str) {
    notice(&format!("warning: {text}"));
}
