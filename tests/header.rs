//! The committed `include/skep.h` is what the library's source gives. `SKEP_UPDATE_HEADER=1 cargo test --test header`
//! writes it anew.

use std::path::Path;

/// The files of the interface in the order of the manual.
const SECTIONS: [&str; 14] = [
    "status", "options", "camera", "image", "scene", "progress", "result", "borrow", "cloud", "fusion",
    "stepper", "estimate", "kernels", "files",
];

#[test]
fn the_committed_header_is_the_one_the_source_gives() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml is in order");
    let sections = SECTIONS.iter().map(|section| root.join(format!("src/capi/{section}.rs")));
    let builder = sections.fold(cbindgen::Builder::new().with_config(config), cbindgen::Builder::with_src);
    let bindings = builder.generate().expect("the source can be understood");
    let mut generated = Vec::new();
    bindings.write(&mut generated);
    let generated = String::from_utf8(generated).expect("a header is text");
    let path = root.join("include/skep.h");
    if std::env::var_os("SKEP_UPDATE_HEADER").is_some() {
        std::fs::create_dir_all(root.join("include")).unwrap();
        std::fs::write(&path, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(&path).expect("include/skep.h is there");
    let differs =
        committed.lines().zip(generated.lines()).position(|(committed, generated)| committed != generated);
    assert!(
        committed == generated,
        "include/skep.h differs from the source, first in line {:?}; SKEP_UPDATE_HEADER=1 writes it anew",
        differs.map(|line| line + 1)
    );
}

/// maturin makes the declarations of the Python package with a cbindgen of its own, from the whole crate; cffi then knows
/// no directive but numbers.
#[test]
fn the_whole_crate_declares_the_same_for_python() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config =
        cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml is in order");
    config.sys_includes = Vec::new();
    config.include_guard = None;
    config.cpp_compat = false;
    let builder = cbindgen::Builder::new().with_config(config).with_crate(root);
    let mut generated = Vec::new();
    builder.generate().expect("the source can be understood").write(&mut generated);
    let generated = String::from_utf8(generated).expect("a header is text");
    for directive in generated.lines().filter(|line| line.starts_with('#')) {
        let definition = directive.strip_prefix("#define ").and_then(|rest| rest.split_once(' '));
        assert!(
            definition.is_some_and(|(_, value)| value.parse::<i64>().is_ok()),
            "cffi cannot read '{directive}': name it under [export] exclude in cbindgen.toml"
        );
    }
    let interface = std::fs::read_to_string(root.join("include/skep.h")).expect("include/skep.h is there");
    let is_declared = |line: &str| generated.lines().any(|other| other == line);
    let missing = interface.lines().find(|line| line.starts_with("skep_") && !is_declared(line));
    assert_eq!(missing, None, "the crate as a whole does not declare it");
}
