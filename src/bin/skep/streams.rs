//! Standard output and error. Failed writes are ignored: a closed pipe must not stop a run.

use std::io::Write;

/// Prints a line of the result on standard output.
pub fn result(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Prints a line about the run on standard error: progress, warnings, errors.
pub fn notice(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints a warning; also with `--quiet`.
pub fn warning(text: &str) {
    notice(&format!("warning: {text}"));
}
