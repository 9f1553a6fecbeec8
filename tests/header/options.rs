//! The list of options of each interface, from the library's table.

use skep::{Kind, OptionInfo, Options};
use std::fmt::Write;
use std::path::Path;

const WIDTH: usize = 110;
/// The lines between which a file's list of options is generated.
const BEGIN: &str = "BEGIN OPTIONS";
const END: &str = "END OPTIONS";

/// Breaks a text into lines that fit, behind a prefix of their own for the first and for the others.
fn wrap(text: &str, first: &str, others: &str) -> String {
    let mut out = String::new();
    let mut line = first.to_string();
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.len() + 1 + word.len() > WIDTH {
            writeln!(out, "{line}").unwrap();
            line = others.to_string();
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line.push_str(word);
        is_empty = false;
    }
    out + &line + "\n"
}

/// The values that an option accepts, with their unit.
fn values(info: &OptionInfo) -> String {
    let unit = info.unit;
    match info.kind {
        Kind::Count { min, max } if max == u64::from(u32::MAX) => {
            format!("whole number, at least {min}, {unit}")
        }
        Kind::Count { min, max } => format!("whole number, {min} to {max}, {unit}"),
        Kind::Number { min, max } => format!("number, {min} to {max}, {unit}"),
        Kind::Switch => "switch, true or false".to_string(),
        Kind::Text => unit.to_string(),
    }
}

/// The values of the presets; the default's alone where the others have the same.
fn presets(info: &OptionInfo) -> Vec<String> {
    let value = |preset: &str| {
        let options = Options::preset(preset).expect("it is a preset");
        options.get(info.name).expect("it is an option").to_string()
    };
    let all = Options::PRESETS.map(|preset| (preset, value(preset)));
    let others: Vec<_> = all[1..].iter().filter(|(_, value)| *value != all[0].1).collect();
    let listed = all[..1].iter().chain(others.iter().copied());
    listed.map(|(preset, value)| format!("{preset}: {value}")).collect()
}

/// The group of an option, empty where it has none.
fn group(info: &OptionInfo) -> &'static str {
    info.name.split_once('.').map_or("", |(group, _)| group)
}

/// The list as a comment; `mark` starts each line.
fn list(mark: &str) -> String {
    let mut out = String::new();
    for (name, explanation) in std::iter::once(("", "Of the whole run:")).chain(Options::groups()) {
        out += &format!("{mark}\n{}", wrap(explanation, &format!("{mark} "), &format!("{mark} ")));
        for info in Options::infos().filter(|info| group(info) == name) {
            let indented = format!("{mark}       ");
            writeln!(out, "{mark}   {}", info.name).unwrap();
            out += &wrap(info.explanation, &indented, &indented);
            // The texts of schedules have lines of their own, to be copied from there.
            match info.kind {
                Kind::Text => presets(&info).iter().for_each(|line| out += &wrap(line, &indented, &indented)),
                _ => {
                    let line = format!("{}; {}", values(&info), presets(&info).join(", "));
                    out += &wrap(&line, &indented, &indented);
                }
            }
        }
    }
    out
}

pub fn in_c() -> String {
    let introduction = "Options have a name with a group, which may be left out where no other group has an \
                        option of that name. Below each name: what it does; the accepted values with their \
                        unit; the value of the default preset, and those of other presets where they \
                        differ.";
    format!("/*\n{}{} */\n\n", wrap(introduction, " * ", " * "), list(" *"))
}

pub fn in_cpp(root: &Path) -> String {
    replaced(&root.join("include/skep/options.hpp"), "// ", &list("//"))
}

/// Typed attributes, which editors complete and type checkers know.
pub fn in_python(root: &Path) -> String {
    let mut out = String::new();
    for info in Options::infos() {
        let kind = match info.kind {
            Kind::Count { .. } => "int",
            Kind::Number { .. } => "float",
            Kind::Switch => "bool",
            Kind::Text => "str",
        };
        writeln!(out, "    {}: {kind}", info.name.replace('.', "_")).unwrap();
        let text = format!("{} ({}; {})", info.explanation, values(&info), presets(&info).join(", "));
        // The quotes belong to the last word, so that they are on its line.
        out += &wrap(&format!("{text}\"\"\""), "    \"\"\"", "    ");
    }
    replaced(&root.join("src/python/skep/_options.py"), "    # ", &out)
}

/// A file with the lines between its marks replaced.
fn replaced(path: &Path, mark: &str, list: &str) -> String {
    let text = std::fs::read_to_string(path).expect("the file is there");
    let (begin, end) = (format!("{mark}{BEGIN}\n"), format!("{mark}{END}\n"));
    let (before, rest) = text.split_once(&begin).expect("its list of options begins");
    let (_, after) = rest.split_once(&end).expect("its list of options ends");
    format!("{before}{begin}{list}{end}{after}")
}
