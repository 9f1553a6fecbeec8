//! The kernels: bilaterally weighted NCC over plane-induced homographies, generic over the instruction set.

mod homography;
mod ncc;
mod warp;
mod window;

pub use homography::{PatchHomography, RelativePose, SlantedPlane};
pub use ncc::{MAX_COST, ReferencePatch, patch_cost, patch_costs};
pub use window::Window;
