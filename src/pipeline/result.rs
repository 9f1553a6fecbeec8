//! The result of a run.

use super::cycle::CycleRecord;
use crate::ambc::Counts;
use crate::fusion::PointCloud;
use crate::geometry::ViewSets;
use crate::scene::{Maps, PixelStatus};

/// The result of one view.
#[derive(Debug, Clone)]
pub struct ViewResult {
    /// Width of all maps in pixels.
    pub width: u32,
    /// Depth and normal of every pixel that is not masked, validated or not.
    pub raw: Maps,
    /// Mean `1 - NCC` of the raw plane over the pixel's view set, 0 to 2; lower is more certain.
    pub cost: Vec<f32>,
    /// Probability that the raw depth is within 1 % of the true one, 0 to 1; 0 where there is none.
    pub confidence: Vec<f32>,
    /// The status of each pixel: validated, or the reason why it is not.
    pub status: Vec<PixelStatus>,
    /// The view's source views, as indices into the scene; `view_sets` indexes this list.
    pub sources: Vec<u32>,
    /// The view set of each pixel: the source views that see its raw plane.
    pub view_sets: ViewSets,
    /// Work done for the view.
    pub counts: Counts,
    /// The cycles in order.
    pub cycles: Vec<CycleRecord>,
}

impl ViewResult {
    /// Width and height of all maps.
    pub fn size(&self) -> (u32, u32) {
        (self.width, (self.status.len() / (self.width as usize).max(1)) as u32)
    }

    /// The maps of the validated pixels, empty elsewhere.
    pub fn validated(&self) -> Maps {
        let mut maps = self.raw.clone();
        for (pixel, status) in self.status.iter().enumerate() {
            if *status != PixelStatus::Validated {
                maps.depth[pixel] = 0.0;
                maps.normal[pixel] = [0.0; 3];
            }
        }
        maps
    }

    /// Number of pixels of each status, in the order of [`PixelStatus::ALL`].
    pub fn status_counts(&self) -> [u64; PixelStatus::ALL.len()] {
        let mut counts = [0; PixelStatus::ALL.len()];
        for &status in &self.status {
            counts[status as usize] += 1;
        }
        counts
    }
}

/// The result of a whole run.
#[derive(Debug, Clone)]
pub struct Reconstruction {
    /// One result for each view of the scene.
    pub views: Vec<ViewResult>,
    /// The fused cloud.
    pub points: PointCloud,
    /// Warnings about the run, as sentences.
    pub warnings: Vec<String>,
}
