//! skep turns calibrated photographs into depth, normal and source-view maps and a fused point cloud, on the CPU.

#![warn(missing_docs)]
#![deny(unsafe_code)]

pub mod camera;
mod error;
pub mod fusion;
pub mod image;
#[cfg(feature = "io")]
pub mod io;
mod maps;
mod options;
mod progress;
mod scene;
pub mod simd;
mod solve;
pub mod views;

pub use error::{Error, Result};
pub use maps::{Counts, CycleRecord, Maps, Outcome, PointCloud, PointViews, Reconstruction, ViewResult};
pub use options::{Aggregation, FusionOptions, Options, Scale};
pub use progress::{Hook, Phase, Progress, ignore_progress};
pub use scene::{DepthRange, Scene, SparsePoint, View};
pub use solve::reconstruct;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
