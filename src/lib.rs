//! skep turns calibrated photographs into depth, normal and source-view maps and a fused point cloud, on the CPU.
//!
//! [`how_it_works`] tells the steps of the method and what each is worth.

#![warn(missing_docs)]
#![deny(unsafe_code)]

mod ambc;
#[cfg(feature = "capi")]
mod capi;
mod cross_view;
mod error;
pub mod fusion;
pub mod geometry;
pub mod image;
#[cfg(feature = "io")]
pub mod io;
pub mod matching;
mod options;
mod parallel;
mod pipeline;
mod refine;
mod scene;
pub mod simd;
#[cfg(test)]
mod testing;
pub mod view_selection;

pub use ambc::Counts;
pub use error::{Error, Result};
pub use fusion::{PointCloud, PointViews};
pub use geometry::DepthRange;
pub use options::{
    CheckOptions, CostOptions, FusionOptions, Kind, OptionInfo, OptionValue, Options, RefineOptions, Scale,
    ScheduleOptions, SearchOptions, ViewSelectionOptions, WindowOptions,
};
pub use pipeline::{
    AnyEstimate, Candidates, Checked, Cycle, CycleRecord, EstimateRef, OwnMaps, Phase, Progress, ProgressFn,
    Reconstruction, Searched, Stepper, ViewEstimate, ViewResult, ignore_progress, reconstruct,
};
pub use scene::{Maps, PixelStatus, Scene, SparsePoint, View};

#[doc = include_str!("how_it_works.md")]
pub mod how_it_works {}

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
