//! Fused points.

use crate::error::Result;
use glam::DVec3;

/// Fused points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// World positions.
    pub positions: Vec<[f64; 3]>,
    /// Unit normals in the world frame.
    pub normals: Vec<[f32; 3]>,
    /// Red, green, blue.
    pub colors: Vec<[u8; 3]>,
    /// The views each point was fused from, as indices into the scene; first the one it started in.
    pub views: PointViews,
}

impl PointCloud {
    /// The points whose positions are wanted.
    pub(crate) fn filtered(&self, is_wanted: impl Fn(DVec3) -> bool) -> PointCloud {
        let mut kept = PointCloud::default();
        for (point, &position) in self.positions.iter().enumerate() {
            if is_wanted(position.into()) {
                kept.positions.push(position);
                kept.normals.push(self.normals[point]);
                kept.colors.push(self.colors[point]);
                kept.views.push(self.views.get(point));
            }
        }
        kept
    }

    /// The points with other numbers of their views.
    #[cfg(feature = "io")]
    pub(crate) fn renumbered(mut self, numbers: &[u32]) -> PointCloud {
        self.views.views.iter_mut().for_each(|view| *view = numbers[*view as usize]);
        self
    }

    /// Appends the points of another cloud.
    pub(crate) fn append(&mut self, other: &PointCloud) {
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.colors.extend_from_slice(&other.colors);
        for point in 0..other.views.len() {
            self.views.push(other.views.get(point));
        }
    }
}

/// Takes points as they are made.
pub(crate) type Emit<'a> = &'a mut dyn FnMut(&PointCloud) -> Result<()>;

/// Points that are read in parts, as often as it takes.
pub(crate) trait CloudSource {
    /// Number of points.
    fn len(&self) -> usize;

    /// Calls `body` with the points, some at a time, in the same order each time.
    ///
    /// # Errors
    /// Points that cannot be read; what `body` returns.
    fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()>;
}

impl CloudSource for PointCloud {
    fn len(&self) -> usize {
        self.positions.len()
    }

    fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()> {
        body(self)
    }
}

/// A list of views for each point, in one allocation.
///
/// # Examples
/// ```
/// let mut views = skep::PointViews::default();
/// views.push(&[0, 2]);
/// views.push(&[]);
/// views.push(&[1]);
/// assert_eq!((views.len(), views.total()), (3, 3));
/// assert_eq!(views.get(0), [0, 2]);
/// ```
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

    /// Sum of the lengths of all lists.
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
