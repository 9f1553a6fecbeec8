//! What a run hands out for each view.

use crate::views::ViewSets;

/// Depth and normal of every pixel of a view, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Maps {
    /// Depth in world units, 0 where there is none.
    pub depth: Vec<f32>,
    /// Unit normal in the view's camera frame, facing the camera; zeros where there is no depth.
    pub normal: Vec<[f32; 3]>,
}

/// What became of a pixel, and the reason when it has no validated solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Outcome {
    /// The solution is consistent with enough source views.
    Validated,
    /// The mask leaves the pixel out.
    Masked,
    /// The window around the pixel is too uniform to be matched.
    NoTexture,
    /// Fewer than two source views can see the solution.
    NoSources,
    /// Too few source views agree with the solution.
    Inconsistent,
    /// The solution lies at an end of the depth range: the surface may lie beyond.
    OutOfRange,
}

impl Outcome {
    /// All outcomes, in the order of their discriminants.
    pub const ALL: [Outcome; 6] = [
        Outcome::Validated,
        Outcome::Masked,
        Outcome::NoTexture,
        Outcome::NoSources,
        Outcome::Inconsistent,
        Outcome::OutOfRange,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Validated => "validated",
            Outcome::Masked => "masked",
            Outcome::NoTexture => "no_texture",
            Outcome::NoSources => "no_sources",
            Outcome::Inconsistent => "inconsistent",
            Outcome::OutOfRange => "out_of_range",
        }
    }
}

/// Counts of the work done; they depend on input and options only, not on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Patches compared with a patch in one source view.
    pub ncc_evaluations: u64,
    /// Bilinear samples taken from source views.
    pub samples: u64,
    /// Hypotheses given up before all their source views were looked at.
    pub early_outs: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.ncc_evaluations += other.ncc_evaluations;
        self.samples += other.samples;
        self.early_outs += other.early_outs;
    }
}

/// One cycle's search of one view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleRecord {
    /// Size of the images: 1 is full, 2 half, 4 a quarter.
    pub reduction: u32,
    /// The cycle on that scale, counted from 0.
    pub cycle: u32,
    /// Pixels searched.
    pub pixels: u64,
    /// Pixels whose solution changed.
    pub changed: u64,
    /// Pixels validated by the check after it.
    pub validated: u64,
}

/// The result of one view.
#[derive(Debug, Clone)]
pub struct ViewResult {
    /// Width of all maps in pixels.
    pub width: u32,
    /// The raw estimate of every pixel that is not masked.
    pub estimate: Maps,
    /// Mean `1 - NCC` of the estimate over the pixel's view set, 0 to 2; lower is surer.
    pub cost: Vec<f32>,
    /// What became of each pixel; `Validated` ones make the filtered maps.
    pub outcome: Vec<Outcome>,
    /// The view's source views, as indices into the scene; `view_sets` counts along this list.
    pub sources: Vec<u32>,
    /// The source views each pixel was matched with.
    pub view_sets: ViewSets,
    /// Work done.
    pub counts: Counts,
    /// The cycles in order.
    pub cycles: Vec<CycleRecord>,
}

impl ViewResult {
    /// Width and height of all maps.
    pub fn size(&self) -> (u32, u32) {
        (self.width, (self.outcome.len() / (self.width as usize).max(1)) as u32)
    }

    /// The maps with only what was validated left in them.
    pub fn filtered(&self) -> Maps {
        let mut maps = self.estimate.clone();
        for (pixel, outcome) in self.outcome.iter().enumerate() {
            if *outcome != Outcome::Validated {
                maps.depth[pixel] = 0.0;
                maps.normal[pixel] = [0.0; 3];
            }
        }
        maps
    }

    /// Number of pixels of each outcome, in the order of [`Outcome::ALL`].
    pub fn outcome_counts(&self) -> [u64; Outcome::ALL.len()] {
        let mut counts = [0; Outcome::ALL.len()];
        for &outcome in &self.outcome {
            counts[outcome as usize] += 1;
        }
        counts
    }
}

/// Fused points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// World positions.
    pub positions: Vec<[f64; 3]>,
    /// Unit normals in the world frame.
    pub normals: Vec<[f32; 3]>,
    /// Red, green, blue.
    pub colours: Vec<[u8; 3]>,
    /// The views each point was fused from, as indices into the scene, the first being the one it started in.
    pub views: PointViews,
}

/// A list of views for each point, in one allocation.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PointViews {
    ends: Vec<usize>,
    views: Vec<u32>,
}

impl PointViews {
    /// Appends the list of one more point.
    pub fn push(&mut self, views: &[u32]) {
        self.views.extend_from_slice(views);
        self.ends.push(self.views.len());
    }

    /// The list of the point with this index.
    pub fn get(&self, point: usize) -> &[u32] {
        let start = if point == 0 { 0 } else { self.ends[point - 1] };
        &self.views[start..self.ends[point]]
    }

    /// Lengths of all lists added up.
    pub fn total(&self) -> usize {
        self.views.len()
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

/// What a whole run hands out.
#[derive(Debug, Clone)]
pub struct Reconstruction {
    /// One result for each view of the scene.
    pub views: Vec<ViewResult>,
    /// The fused cloud.
    pub points: PointCloud,
    /// What the host's user should know, in sentences.
    pub warnings: Vec<String>,
}
