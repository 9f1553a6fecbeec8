//! Standard output and error, and the log level. A failed write stops no run; one of results, other than to a
//! closed pipe, makes the exit status that of a failure.

use clap::ValueEnum;
use std::io::{IsTerminal, Write};
use std::sync::OnceLock;

/// What is printed on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum LogLevel {
    /// Errors only
    Error,
    /// Also warnings
    Warning,
    /// Also the progress and the results
    Info,
    /// Also the options, and the photographs with their source views and depth ranges
    Debug,
}

/// The level of the process; `Info` until it is set.
static LEVEL: OnceLock<LogLevel> = OnceLock::new();

/// Sets the level of the process, once.
pub fn set_level(level: LogLevel) {
    let _ = LEVEL.set(level);
}

/// Whether messages of this level are printed.
pub fn is_shown(level: LogLevel) -> bool {
    level <= *LEVEL.get().unwrap_or(&LogLevel::Info)
}

/// Whether progress and results are left out, as asked for by `--quiet` or the level.
pub fn is_quiet(quiet: bool) -> bool {
    quiet || !is_shown(LogLevel::Info)
}

/// Whether standard error is a terminal that erases lines when it is told to. On Windows not all are.
pub fn is_screen() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|name| name == "dumb");
    std::io::stderr().is_terminal() && !is_dumb
}

/// Why results could not be written on standard output, if they could not.
static LOST: OnceLock<String> = OnceLock::new();

/// Prints a line of the result on standard output.
pub fn result(line: &str) {
    write_result(&format!("{line}\n"));
}

/// Writes results on standard output.
pub fn write_result(text: &str) {
    let written = std::io::stdout().write_all(text.as_bytes()).and_then(|()| std::io::stdout().flush());
    if let Err(error) = written
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        let _ = LOST.set(error.to_string());
    }
}

/// Why results could not be written, if they could not.
pub fn lost_results() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// Prints a line about the run on standard error: progress, warnings, errors.
pub fn notice(line: &str) {
    // The line may hold a bar, behind which the cursor is not.
    let erase = if is_screen() { "\x1b[J" } else { "" };
    let _ = writeln!(std::io::stderr(), "{erase}{line}");
}

/// Prints a warning; also with `--quiet`.
pub fn warning(text: &str) {
    if is_shown(LogLevel::Warning) {
        notice(&format!("warning: {text}"));
    }
}
