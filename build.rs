//! Sets the SONAME of the shared library, writes the file with the version that `cargo cinstall` installs,
//! and takes a fingerprint of the source, by which runs in a folder know the program that began them.

use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};

const CMAKE_VERSION_TEMPLATE: &str = "include/cmake/skep-config-version.cmake.in";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={CMAKE_VERSION_TEMPLATE}");
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let (major, minor) = (variable("CARGO_PKG_VERSION_MAJOR"), variable("CARGO_PKG_VERSION_MINOR"));
    // Until 1.0 every minor version may change the interface.
    let suffix = if major == "0" { format!("0.{minor}") } else { major };
    match variable("CARGO_CFG_TARGET_OS").as_str() {
        "linux" | "android" | "freebsd" | "netbsd" | "openbsd" => {
            println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libskep.so.{suffix}");
        }
        "macos" => {
            println!("cargo:rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libskep.{suffix}.dylib");
        }
        _ => (),
    }

    // Not the Python package and the viewer of reports, whose changes would compile the crate anew.
    for entry in std::fs::read_dir("src").into_iter().flatten().flatten() {
        if entry.file_name() != "python" && entry.file_name() != "bin" {
            println!("cargo:rerun-if-changed={}", entry.path().display());
        }
    }
    for file in source_files(Path::new("src/bin")) {
        println!("cargo:rerun-if-changed={}", file.display());
    }
    println!("cargo:rustc-env=SKEP_SOURCE_FINGERPRINT={:08x}", source_fingerprint() as u32);

    let template =
        std::fs::read_to_string(CMAKE_VERSION_TEMPLATE).expect("the template is part of the package");
    let folder = Path::new(&variable("OUT_DIR")).join("cmake");
    std::fs::create_dir_all(&folder).expect("cargo's folder for build results can be written");
    std::fs::write(
        folder.join("skep-config-version.cmake"),
        template.replace("@SKEP_VERSION@", &variable("CARGO_PKG_VERSION")),
    )
    .expect("cargo's folder for build results can be written");
}

/// A hash of all files of the source.
fn source_fingerprint() -> u64 {
    let mut hasher = DefaultHasher::new();
    for path in source_files(Path::new("src")) {
        hasher.write(&std::fs::read(path).unwrap_or_default());
    }
    hasher.finish()
}

/// The files with Rust below a folder, in a fixed order.
fn source_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    files.sort();
    files
}
