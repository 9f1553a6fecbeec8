//! `docs/options.md`, the list of all options, is generated from the library's table and committed.
//! `SKEP_UPDATE_OPTIONS=1 cargo test --all-features --test option_list` writes it.

use skep::{Kind, OptionInfo, Options};
use std::path::Path;

const WIDTH: usize = 110;
const PAGE: &str = "docs/options.md";
const INTRODUCTION: &str = "\
# Options

<!-- Generated from the table of options; CONTRIBUTING.md says how. -->

Every number that the method depends on, with its value in each preset. `skep info` prints the same list, and
`skep info NAME` explains one option.

Options are set

- on the command line by `--set NAME=VALUE`, some also by arguments of their own (`skep help reconstruct`);
- in C by `skep_options_set`, `skep_options_set_text`; in C++ by `Options::set`;
- in Python as items or attributes: `options[\"check.depth_tolerance\"]`, `options.check_depth_tolerance`;
- in Rust as fields, `options.check.depth_tolerance`, or by name with `Options::set`.

The group may be left out where no other group has an option of that name. Values are checked when they are
set: one that is out of its range is refused, with the range. The command line writes all of them into
`report.json`.

Fractions are fractions and angles degrees. What each part of the method is worth is in
[experiments.md](experiments.md); what the terms mean is in [concepts.md](concepts.md) and, with the formulas,
in [how_it_works.md](../src/how_it_works.md).
";

/// Breaks a paragraph into lines that fit.
fn wrap(text: &str) -> String {
    let mut out = String::new();
    let mut length = 0;
    for word in text.split_whitespace() {
        match length {
            0 => {}
            _ if length + 1 + word.len() > WIDTH => {
                out.push('\n');
                length = 0;
            }
            _ => {
                out.push(' ');
                length += 1;
            }
        }
        out.push_str(word);
        length += word.len();
    }
    out + "\n"
}

/// The value of an option in a preset, as it is set.
fn value(preset: &str, info: &OptionInfo) -> String {
    let options = Options::preset(preset).expect("it is a preset");
    let value = options.get(info.name).expect("it is an option").to_string();
    if value.is_empty() { "empty".to_string() } else { format!("`{value}`") }
}

/// A section of the page for an option: what it does, what it takes, and its values in the presets.
fn section(info: &OptionInfo) -> String {
    let takes = match info.kind {
        Kind::Switch => "`true` or `false`".to_string(),
        // The explanation says more.
        Kind::Text => format!("{} ({})", info.kind, info.unit),
        Kind::Count { .. } | Kind::Number { .. } => format!("{}; unit: {}", info.kind, info.unit),
    };
    let mut lines = vec![format!("- Values: {takes}.\n")];
    let values = Options::PRESETS.map(|preset| value(preset, info));
    if values.iter().all(|other| *other == values[0]) {
        lines.push(format!("- In all presets: {}.\n", values[0]));
    } else {
        let each = Options::PRESETS.iter().zip(&values);
        lines.extend(each.map(|(preset, value)| format!("- `{preset}`: {value}\n")));
    }
    format!("### {}\n\n{}\n{}", info.name, wrap(info.explanation), lines.concat())
}

fn page() -> String {
    let mut out = INTRODUCTION.to_string();
    for (name, explanation) in std::iter::once(("", "Of the whole run.")).chain(Options::groups()) {
        let title = if name.is_empty() { "Without a group" } else { name };
        out += &format!("\n## {title}\n\n{}", wrap(explanation));
        let in_group = |info: &OptionInfo| info.name.split_once('.').map_or("", |(group, _)| group) == name;
        for info in Options::infos().filter(in_group) {
            out += &format!("\n{}", section(&info));
        }
    }
    out
}

#[test]
fn the_committed_list_of_options_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let generated = page();
    if std::env::var_os("SKEP_UPDATE_OPTIONS").is_some() {
        std::fs::write(&path, &generated).expect("the working tree can be written");
    }
    let committed = std::fs::read_to_string(&path).expect("it is committed");
    let differs = committed.lines().zip(generated.lines()).position(|(left, right)| left != right);
    assert!(
        committed == generated,
        "{PAGE} differs from the source, first in line {:?}; SKEP_UPDATE_OPTIONS=1 writes it anew",
        differs.map(|line| line + 1)
    );
}
