//! `skep completions` and `skep man`: what the arguments' own descriptions are made into.

use crate::arguments::{Arguments, Completions, Man};
use crate::{Failure, streams};
use clap::CommandFactory;
use skep::Error;
use std::path::Path;

/// Prints a script that completes commands and arguments.
pub fn completions(arguments: &Completions) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "skep", &mut script);
    streams::write_result(&String::from_utf8_lossy(&script));
    Ok(())
}

/// Writes a manual page for each command.
pub fn manual(arguments: &Man) -> Result<(), Failure> {
    let folder = &arguments.folder;
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let written = std::fs::create_dir_all(folder).and_then(|()| {
        let written = command.get_subcommands().try_for_each(|command| page(command.clone(), folder));
        written.and_then(|()| page(command.clone(), folder))
    });
    Ok(written.map_err(|error| Error::file(folder, format!("manual pages cannot be written: {error}")))?)
}

/// Writes the manual page of a command. What its help has after the arguments is laid out by hand, so it is
/// kept as it is.
fn page(command: clap::Command, folder: &Path) -> std::io::Result<()> {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    let more = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let mut text = Vec::new();
    clap_mangen::Man::new(command.after_help("").display_name(&name)).render(&mut text)?;
    if !more.is_empty() {
        text.extend_from_slice(b".SH DETAILS\n.nf\n");
        for line in more.lines() {
            // A line that begins with a point or an apostrophe would be a command of the formatter.
            let line = line.replace('\\', "\\e").replace('-', "\\-");
            text.extend_from_slice(format!("\\&{line}\n").as_bytes());
        }
        text.extend_from_slice(b".fi\n");
    }
    std::fs::write(folder.join(format!("{name}.1")), text)
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
