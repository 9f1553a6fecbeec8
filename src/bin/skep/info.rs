//! `skep info`: version, SIMD level, the options with their values in the presets, and what each option does.

use crate::arguments::Info;
use crate::{Failure, streams};
use skep::simd::SimdLevel;
use skep::{Error, OptionInfo, Options};

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
        streams::result(&format!("{text}\n"));
    }
    let width = found.iter().map(|info| info.name.len()).max().unwrap_or(0);
    for info in found {
        let sentence = info.explanation.split_inclusive(". ").next().unwrap_or_default().trim_end();
        streams::result(&format!("{:<width$}  {sentence}", info.name));
    }
    Ok(())
}

/// What one option does, and its values in the presets.
fn explain(info: &OptionInfo) -> Result<(), Failure> {
    streams::result(&format!("{}: {}", info.name, info.explanation));
    streams::result(&format!("  unit    {}\n  values  {}", info.unit, info.kind));
    for preset in Options::PRESETS {
        let value = Options::preset(preset)?.get(info.name)?;
        streams::result(&format!("  {preset:<7} {value}"));
    }
    Ok(())
}

/// A row for each option, a column for each preset; each scale of a schedule is on a line of its own.
fn preset_table() -> Vec<String> {
    let presets =
        Options::PRESETS.map(|name| Options::preset(name).expect("presets are found by their names"));
    let mut lines = row("option", &Options::PRESETS.map(str::to_owned));
    for info in Options::infos() {
        let value = |options: &Options| options.get(info.name).expect("it is listed").to_string();
        lines.extend(row(info.name, &presets.each_ref().map(value)));
    }
    lines
}

fn row(name: &str, values: &[String]) -> Vec<String> {
    let parts: Vec<Vec<&str>> = values.iter().map(|value| value.split("; ").collect()).collect();
    let count = parts.iter().map(Vec::len).max().unwrap_or(0);
    let line = |index: usize| {
        let mut line = format!("{:<42}", if index == 0 { name } else { "" });
        for parts in &parts {
            line += &format!("{:<48}", parts.get(index).unwrap_or(&""));
        }
        line.trim_end().to_owned()
    };
    (0..count).map(line).collect()
}
