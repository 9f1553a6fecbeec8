//! Matching a reference view with its source views: bilaterally weighted NCC over plane-induced homographies, generic
//! over the instruction set.

mod homography;
mod ncc;
mod problem;
mod projection;
mod warp;
mod window;

pub use homography::PatchHomography;
pub use ncc::{MAX_COST, ReferencePatch, patch_cost, patch_costs};
pub use problem::{Problem, Projection, Source};
pub use projection::{Group, PREFETCH_DISTANCE, Projections, SourceProjector, Surfaces, TransferredPlanes};
pub use window::Window;
