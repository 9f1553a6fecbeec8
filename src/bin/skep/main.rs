//! The command line.

mod arguments;
mod fuse;
mod info;
mod interrupt;
mod progress;
mod reconstruct;
mod report;
mod stopwatch;
mod streams;

use arguments::{Arguments, Command};
use clap::Parser;
use skep::Error;
use std::process::ExitCode;

/// Failed for a reason that was printed.
const FAILED: u8 = 1;
/// The arguments make no sense; also clap's own status.
const USAGE: u8 = 2;
/// Stopped by the user, as shells report it: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Reconstruct(arguments) => reconstruct::run(&arguments),
        Command::Fuse(arguments) => fuse::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(error)) => fail(&error, USAGE),
        Err(Failure::Run(Error::Cancelled)) => ExitCode::from(INTERRUPTED),
        Err(Failure::Run(error)) => fail(&error, FAILED),
    }
}

fn fail(error: &Error, status: u8) -> ExitCode {
    streams::notice(&format!("error: {error}"));
    ExitCode::from(status)
}

/// Why a command did not do what it was asked.
enum Failure {
    /// An argument makes no sense.
    Usage(Error),
    /// The run went wrong or was interrupted.
    Run(Error),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        Failure::Run(error)
    }
}
