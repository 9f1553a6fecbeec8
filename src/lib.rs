//! skep turns calibrated photographs into depth, normal and source-view maps and a fused point cloud, on the CPU.
//!
//! [`how_it_works`] tells the steps of the method and what each is worth.

#![warn(missing_docs)]
#![deny(unsafe_code)]

mod ambc;
mod averaging;
pub mod camera;
#[cfg(feature = "capi")]
mod capi;
mod closing;
mod consistency;
mod edges;
mod error;
mod filling;
pub mod fusion;
pub mod image;
#[cfg(feature = "io")]
pub mod io;
pub mod kernels;
mod maps;
mod options;
mod outcome;
mod padded;
mod pool;
mod progress;
mod propagation;
mod scene;
pub mod simd;
mod smoothing;
mod solve;
mod state;
#[cfg(test)]
mod testing;
pub mod views;

pub use error::{Error, Result};
pub use maps::{Counts, CycleRecord, Maps, Outcome, PointCloud, PointViews, Reconstruction, ViewResult};
pub use options::{Aggregation, FusionOptions, Options, Scale};
pub use progress::{Hook, Phase, Progress, ignore_progress};
pub use scene::{DepthRange, Scene, SparsePoint, View};
pub use solve::{Offers, OwnMaps, State, Step, Steps, Verdicts, reconstruct};

#[doc = include_str!("how_it_works.md")]
pub mod how_it_works {}

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
