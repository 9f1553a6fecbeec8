//! What is generated from the source and committed: `include/skep.h`, and the lists of options in the C++
//! header and in the Python package. `SKEP_UPDATE_HEADER=1 cargo test --all-features --test header` writes
//! all of it.

mod manual;
mod options;

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn config() -> cbindgen::Config {
    cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml is in order")
}

/// Compares a committed file with its generated text, after writing it if `SKEP_UPDATE_HEADER` is set.
fn check(path: &str, generated: &str) {
    let path: PathBuf = root().join(path);
    if std::env::var_os("SKEP_UPDATE_HEADER").is_some() {
        std::fs::write(&path, generated).expect("the working tree can be written");
    }
    let committed = std::fs::read_to_string(&path).expect("it is committed");
    let differs = committed.lines().zip(generated.lines()).position(|(left, right)| left != right);
    assert!(
        committed == generated,
        "{} differs from the source, first in line {:?}; SKEP_UPDATE_HEADER=1 writes it anew",
        path.display(),
        differs.map(|line| line + 1)
    );
}

#[test]
fn the_committed_header_is_up_to_date() {
    check("include/skep.h", &manual::header());
}

#[test]
fn the_options_of_the_cpp_header_are_those_of_the_source() {
    check("include/skep/options.hpp", &options::in_cpp(root()));
}

#[test]
fn the_options_of_the_python_package_are_those_of_the_source() {
    check("src/python/skep/_options.py", &options::in_python(root()));
}

#[test]
fn every_function_describes_each_of_its_parameters_in_order() {
    let items = manual::items();
    let functions: Vec<_> = items.iter().filter(|item| item.is_function()).collect();
    assert!(functions.len() > 80);
    for function in functions {
        assert_eq!(function.described(), function.parameters(), "of {}", function.name());
    }
}

/// maturin makes the declarations of the Python package with a cbindgen of its own, from the whole crate;
/// cffi then reads no directive but numbers.
#[test]
fn the_whole_crate_declares_the_same_for_python() {
    let mut config = config();
    config.sys_includes = Vec::new();
    config.include_guard = None;
    config.cpp_compat = false;
    let builder = cbindgen::Builder::new().with_config(config).with_crate(root());
    let generated = manual::text_of(builder);
    for directive in generated.lines().filter(|line| line.starts_with('#')) {
        let definition = directive.strip_prefix("#define ").and_then(|rest| rest.split_once(' '));
        assert!(
            definition.is_some_and(|(_, value)| value.parse::<i64>().is_ok()),
            "cffi cannot read '{directive}': name it under [export] exclude in cbindgen.toml"
        );
    }
    let interface = std::fs::read_to_string(root().join("include/skep.h")).expect("include/skep.h is there");
    let is_declared = |line: &str| generated.lines().any(|other| other == line);
    let missing = interface.lines().find(|line| line.starts_with("skep_") && !is_declared(line));
    assert_eq!(missing, None, "the crate as a whole does not declare it");
}
