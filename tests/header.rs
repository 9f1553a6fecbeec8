//! The committed `include/skep.h` is what the library's source gives. `SKEP_UPDATE_HEADER=1 cargo test --test header`
//! writes it anew.

use std::path::Path;

/// The files of the interface in the order of the manual.
const SECTIONS: [&str; 13] = [
    "status", "options", "camera", "image", "scene", "progress", "result", "cloud", "fusion", "steps",
    "state", "kernels", "files",
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
