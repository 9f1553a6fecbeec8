//! The C ABI: one file for each section of `include/skep.h`, which is generated from these files and is the
//! manual.
//!
//! Names are C's, so that what a C program calls is found by searching for it. Every entry runs under
//! [`status::guard`]: a failure becomes a status and a text, a panic does not leave the library, and outputs
//! are written only after everything that can fail has been done.

#![allow(unsafe_code, non_camel_case_types)]
// cbindgen writes what is `pub` into the header.
#![allow(unreachable_pub)]
// What callers must uphold is said once, at the head of the header, in C's words.
#![allow(clippy::missing_safety_doc)]

mod borrow;
mod camera;
mod cloud;
mod estimate;
mod files;
mod fusion;
mod image;
mod job;
mod kernels;
#[cfg(test)]
mod layout;
mod maps;
mod options;
mod pointers;
mod progress;
mod result;
mod result_maps;
mod scene;
mod scene_queries;
mod scene_state;
mod status;
mod stepper;
mod stepper_stages;
mod text;
