//! Helpers of the integration tests and benches.

// Each test file is a crate of its own and uses only a part of this module.
#![allow(dead_code)]

pub mod measure;
pub mod procedural;

/// These options with a change.
pub fn changed(mut options: skep::Options, change: impl FnOnce(&mut skep::Options)) -> skep::Options {
    change(&mut options);
    options
}
