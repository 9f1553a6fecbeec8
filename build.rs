//! Gives the shared library the name that programs linked with it ask for at run time.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let version = |part| std::env::var(part).unwrap_or_default();
    let (major, minor) = (version("CARGO_PKG_VERSION_MAJOR"), version("CARGO_PKG_VERSION_MINOR"));
    // Until 1.0 every minor version may change the interface.
    let suffix = if major == "0" { format!("0.{minor}") } else { major };
    match version("CARGO_CFG_TARGET_OS").as_str() {
        "linux" | "android" | "freebsd" | "netbsd" | "openbsd" => {
            println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libskep.so.{suffix}");
        }
        "macos" => {
            println!("cargo:rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libskep.{suffix}.dylib");
        }
        _ => (),
    }
}
