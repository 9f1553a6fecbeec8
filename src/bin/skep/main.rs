//! The command line.

mod arguments;
mod convert;
mod details;
mod documents;
mod dump;
mod evaluate;
mod few_points;
mod fuse;
mod info;
mod interrupt;
mod options_file;
mod output_arguments;
mod plan_files;
mod progress;
mod reconstruct;
mod report;
mod run_arguments;
mod server;
mod stopwatch;
mod streams;
mod tasks;
mod time_left;
mod view;

use arguments::{Arguments, Command};
use clap::Parser;
use interrupt::Interrupt;
use skep::Error;
use std::path::Path;
use std::process::ExitCode;

/// Exit status: failed for a reason that was printed, as what the arguments name holds or cannot be written.
const FAILED: u8 = 1;
/// Exit status: wrong arguments, also a file that they name and that does not exist; the same as clap's.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let Arguments { command, log_level } = Arguments::parse();
    streams::set_level(log_level);
    let is_missing = |path: &&Path| matches!(path.try_exists(), Ok(false));
    if let Some(path) = command.inputs().into_iter().find(is_missing) {
        return fail(&Error::file(path, "no such file or folder"), USAGE);
    }
    let interrupt = Interrupt::watch();
    let result = match command {
        Command::Reconstruct(arguments) => reconstruct::run(&arguments, &interrupt),
        Command::Plan(arguments) => tasks::plan(&arguments, &interrupt),
        Command::Search(arguments) => tasks::search(&arguments, &interrupt),
        Command::Check(arguments) => tasks::check(&arguments, &interrupt),
        Command::Next(arguments) => tasks::next(&arguments, &interrupt),
        Command::Finish(arguments) => tasks::finish(&arguments, &interrupt),
        Command::Fuse(arguments) => fuse::run(&arguments, &interrupt),
        Command::View(arguments) => view::run(&arguments, &interrupt),
        Command::Convert(arguments) => convert::run(&arguments, &interrupt),
        Command::Evaluate(arguments) => evaluate::run(&arguments, &interrupt),
        Command::Info(arguments) => info::run(&arguments),
        Command::Completions(arguments) => documents::completions(&arguments),
        Command::Man(arguments) => documents::manual(&arguments),
    };
    match result {
        Ok(()) => match streams::lost_results() {
            None => ExitCode::SUCCESS,
            Some(error) => {
                streams::notice(&format!("error: results cannot be written on standard output: {error}"));
                ExitCode::from(FAILED)
            }
        },
        Err(Failure::Usage(error)) => fail(&error, USAGE),
        Err(Failure::Run(Error::Cancelled)) => ExitCode::from(interrupt.status()),
        Err(Failure::Run(error)) => fail(&error, FAILED),
    }
}

fn fail(error: &Error, status: u8) -> ExitCode {
    streams::notice(&format!("error: {error}"));
    ExitCode::from(status)
}

/// Why a command failed.
enum Failure {
    /// An argument is wrong.
    Usage(Error),
    /// The run failed or was interrupted.
    Run(Error),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        Failure::Run(error)
    }
}
