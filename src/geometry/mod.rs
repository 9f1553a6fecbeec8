//! Geometry of pinhole views: cameras, planes, relative poses, depth ranges, pixel grids and view sets.
//!
//! Conventions: `x_cam = R * X_world + t` with x right, y down, z forward; pixel centers are integers, the
//! top-left pixel's center is (0, 0); depth is z in the camera frame.

mod camera;
mod components;
mod depth_range;
mod distortion;
mod grid;
mod lens;
mod padded_map;
mod plane;
mod relative_pose;
mod view_set;

pub use camera::Camera;
pub(crate) use components::for_each_component;
pub use depth_range::DepthRange;
pub(crate) use depth_range::SearchRange;
pub use distortion::Distortion;
pub(crate) use grid::{Grid, Offset, Position};
pub use lens::Lens;
pub(crate) use padded_map::{Border, PaddedMap};
pub(crate) use plane::{MIN_FACING, PlaneHypothesis};
pub use plane::{Plane, SlantedPlane};
pub use relative_pose::{RelativePose, plane_homography};
pub use view_set::ViewSets;
