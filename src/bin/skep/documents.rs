//! `skep completions` and `skep man`: what the arguments' own descriptions are made into.

use crate::Failure;
use crate::arguments::{Arguments, Completions, Man};
use clap::CommandFactory;
use skep::Error;
use std::io::Write;

/// Prints a script that completes commands and arguments.
pub fn completions(arguments: &Completions) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "skep", &mut script);
    // A closed pipe is no failure.
    let _ = std::io::stdout().write_all(&script);
    Ok(())
}

/// Writes a manual page for each command.
pub fn manual(arguments: &Man) -> Result<(), Failure> {
    let folder = &arguments.folder;
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Arguments::command().disable_help_subcommand(true), folder));
    Ok(written.map_err(|error| Error::file(folder, format!("manual pages cannot be written: {error}")))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_fits_eighty_columns() {
        let mut command = Arguments::command();
        command.build();
        let mut all = vec![command.clone()];
        all.extend(command.get_subcommands().cloned());
        for mut command in all {
            for text in [command.render_help(), command.render_long_help()] {
                for line in text.to_string().lines() {
                    assert!(line.chars().count() <= 80, "{}: {line}", command.get_name());
                }
            }
        }
    }

    #[test]
    fn arguments_do_not_contradict_each_other() {
        Arguments::command().debug_assert();
    }
}
