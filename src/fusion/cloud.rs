//! Fused points.

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
