//! The matching kernels: bilaterally weighted NCC of a reference patch with its images in the source views
//! under plane-induced homographies, generic over the instruction set.
//!
//! `ncc.rs` computes the cost of a patch and opens with the algorithm; `window.rs` holds the sample offsets
//! and weights, `warp.rs` maps offsets to sample positions, `homography.rs` makes the homography of a plane.
//! `problem.rs` is a reference view with its source views, and `projection.rs` projects a hypothesis into
//! eight of them at once.

mod homography;
mod ncc;
mod problem;
mod projection;
#[cfg(test)]
mod tests;
mod warp;
mod window;

pub use homography::PatchHomography;
pub use ncc::{MAX_COST, ReferencePatch, patch_cost, patch_costs};
pub(crate) use problem::{Problem, Source};
pub(crate) use projection::{Group, PREFETCH_DISTANCE, Projections, SourceProjector, Surfaces};
pub use window::Window;
