//! `skep info`: version, SIMD level, the options with their values in the presets, and what each option does.

use crate::arguments::Info;
use crate::{Failure, streams};
use skep::simd::SimdLevel;
use skep::{Error, OptionInfo, Options};

/// Columns of the output, as of the help.
const WIDTH: usize = 80;
/// Columns of an option's name in the table of the presets, and of its value in each.
const NAME_WIDTH: usize = 42;
const VALUE_WIDTH: usize = 12;
/// Columns before the descriptions in a list of options, and before the values of one option.
const DESCRIPTION_INDENT: usize = 4;
const VALUE_INDENT: usize = 10;

/// Runs the command.
pub fn run(arguments: &Info) -> Result<(), Failure> {
    match &arguments.option {
        Some(name) => match Options::info(name) {
            Ok(info) => explain(&info),
            Err(error) => list_matching(name, error),
        },
        None => {
            list();
            Ok(())
        }
    }
}

/// The number of threads of `--threads 0`.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Version, machine and all options.
fn list() {
    let version = env!("CARGO_PKG_VERSION");
    let level = SimdLevel::detect().name();
    streams::result(&format!("skep {version}\nSIMD level: {level}\nthreads: {}\n", cores()));
    preset_table().iter().for_each(|line| streams::result(line));
    streams::result("\nskep info NAME explains an option; skep reconstruct --set NAME=VALUE sets it.");
}

/// The options of a group, or with a part of a name.
fn list_matching(word: &str, error: Error) -> Result<(), Failure> {
    let group = Options::groups().find(|(name, _)| *name == word);
    let is_match = |info: &OptionInfo| match group {
        Some((name, _)) => info.name.split_once('.').is_some_and(|(own, _)| own == name),
        None => info.name.contains(word),
    };
    let found: Vec<OptionInfo> = Options::infos().filter(is_match).collect();
    if found.is_empty() {
        return Err(Failure::Usage(error));
    }
    if let Some((_, text)) = group {
        streams::result(&format!("{}\n", wrapped(text, 0)));
    }
    for info in found {
        let sentence = info.explanation.split_inclusive(". ").next().unwrap_or_default().trim_end();
        let indent = " ".repeat(DESCRIPTION_INDENT);
        streams::result(&format!("{}\n{indent}{}", info.name, wrapped(sentence, DESCRIPTION_INDENT)));
    }
    Ok(())
}

/// What one option does, and its values in the presets.
fn explain(info: &OptionInfo) -> Result<(), Failure> {
    streams::result(&wrapped(&format!("{}: {}", info.name, info.explanation), 0));
    streams::result(&labeled("unit", info.unit));
    streams::result(&labeled("values", &info.kind.to_string()));
    for preset in Options::PRESETS {
        streams::result(&labeled(preset, &Options::preset(preset)?.get(info.name)?.to_string()));
    }
    Ok(())
}

/// A label and what it stands for; the scales of a schedule are on lines of their own.
fn labeled(label: &str, text: &str) -> String {
    let width = VALUE_INDENT - 3;
    let parts: Vec<String> = text.split_inclusive("; ").map(|part| wrapped(part, VALUE_INDENT)).collect();
    let lines = parts.join(&format!("\n{}", " ".repeat(VALUE_INDENT)));
    format!("  {label:<width$} {lines}").trim_end().to_owned()
}

/// A text in lines of [`WIDTH`] columns, of which all but the first are indented; the first one begins there,
/// too. Words that are longer are not broken.
fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut column = indent;
    for (place, word) in text.split_whitespace().enumerate() {
        let length = word.chars().count();
        if place > 0 && column + 1 + length > WIDTH {
            lines += "\n";
            lines += &" ".repeat(indent);
            column = indent;
        } else if place > 0 {
            lines += " ";
            column += 1;
        }
        lines += word;
        column += length;
    }
    lines
}

/// A row for each option, a column for each preset; values that are too long for a column are on lines of
/// their own below the name.
fn preset_table() -> Vec<String> {
    let presets =
        Options::PRESETS.map(|name| Options::preset(name).expect("presets are found by their names"));
    let mut lines = vec![row("option", &Options::PRESETS.map(str::to_owned))];
    for info in Options::infos() {
        let value = |options: &Options| options.get(info.name).expect("it is listed").to_string();
        let values = presets.each_ref().map(value);
        if values.iter().all(|value| value.len() < VALUE_WIDTH) {
            lines.push(row(info.name, &values));
        } else {
            lines.push(info.name.to_owned());
            lines.extend(Options::PRESETS.iter().zip(&values).map(|(preset, value)| labeled(preset, value)));
        }
    }
    lines
}

fn row(name: &str, values: &[String]) -> String {
    let columns: String = values.iter().map(|value| format!("{value:<VALUE_WIDTH$}")).collect();
    format!("{name:<NAME_WIDTH$}{columns}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_broken_between_words_and_long_words_are_kept() {
        let long = "x".repeat(WIDTH);
        assert_eq!(wrapped(&format!("a {long} b  c"), 2), format!("a\n  {long}\n  b c"));
        let text = "a word ".repeat(40);
        let lines = wrapped(&text, 4);
        assert!(lines.lines().skip(1).all(|line| line.starts_with("    ") && line.len() <= WIDTH), "{lines}");
        assert_eq!(lines.split_whitespace().count(), 80);
        assert_eq!((wrapped("", 4), labeled("paper", "")), (String::new(), "  paper".to_owned()));
    }
}
