//! The depth range of each view: its own, or one derived from the sparse points.

use super::{SparsePoint, Tracks, View};
use crate::error::{Error, Result};
use crate::geometry::DepthRange;

/// Percentiles of the depths of sparse points that bound a view's range: outliers of the triangulation lie
/// beyond.
const RANGE_PERCENTILES: (f64, f64) = (0.01, 0.99);
/// Surfaces without features may lie in front of and behind all points. The search is uniform in inverse
/// depth: doubling the largest depth adds little to it.
const RANGE_WIDENING: (f64, f64) = (0.75, 2.0);

/// Surfaces without any sparse point may be farther away still: factors of a derived range within which a
/// small part of the random planes is drawn, and depths are kept.
const OUTER_WIDENING: (f64, f64) = (0.7, 4.0);

/// The depth ranges of all views.
pub(super) struct DepthRanges {
    /// One for each view: where most surfaces are.
    pub ranges: Vec<DepthRange>,
    /// One for each view: where any may be.
    pub outer: Vec<DepthRange>,
    /// A sentence for each view whose range is neither its own nor that of points it saw; a single one where
    /// no point has a track, as this holds for all views then.
    pub warnings: Vec<String>,
}

/// A depth range, and what it was taken from.
enum Known {
    /// The view's own, or that of the points it saw.
    Reliable(DepthRange),
    /// That of so many points that project into its image. Some may be hidden there by nearer surfaces.
    Projected(DepthRange, usize),
}

impl Known {
    fn range(&self) -> DepthRange {
        let (Known::Reliable(range) | Known::Projected(range, _)) = self;
        *range
    }
}

/// Determines the range of each view from the first of these that there is: its own; the sparse points it
/// saw; those that project into its image; the ranges of the other views.
///
/// # Errors
/// A view for which there is none of these. Without any sparse point the views must have ranges of their
/// own: those of other views, given for these alone, are not taken over.
pub(super) fn depth_ranges(views: &[View], points: &[SparsePoint]) -> Result<DepthRanges> {
    let tracks = Tracks::new(views.len(), points);
    let known = views
        .iter()
        .enumerate()
        .map(|(index, view)| match view.depth_range {
            Some(range) => Ok(Some(Known::Reliable(range))),
            None => derive(view, tracks.points_of(index), points),
        })
        .collect::<Result<Vec<Option<Known>>>>()?;
    let union = if points.is_empty() { None } else { union(known.iter().flatten().map(Known::range)) };

    let has_tracks = points.iter().any(|point| !point.views.is_empty());
    let mut warnings = Vec::new();
    let projected = known.iter().filter(|known| matches!(known, Some(Known::Projected(..)))).count();
    if !has_tracks && projected > 0 {
        warnings.push(format!(
            "none of the {} sparse points names a view that saw it: the depth range of {projected} view(s) \
             is that of the points that project into the image",
            points.len()
        ));
    }
    let (mut ranges, mut outer) = (Vec::with_capacity(views.len()), Vec::with_capacity(views.len()));
    for (view, known) in views.iter().zip(&known) {
        let name = &view.name;
        let range = known.as_ref().map(Known::range).or(union).ok_or_else(|| unknown(name, points.len()))?;
        match known {
            Some(Known::Projected(_, count)) if has_tracks => warnings.push(format!(
                "{name} saw no sparse point; its depth range, {}, is that of the {count} points that project \
                 into its image",
                describe(range)
            )),
            None => warnings.push(format!(
                "{name} saw no sparse point, and none projects into its image; its depth range, {}, is that \
                 of the other views together",
                describe(range)
            )),
            Some(_) => {}
        }
        ranges.push(range);
        outer.push(if view.depth_range.is_some() { range } else { widened(range) });
    }
    Ok(DepthRanges { ranges, outer, warnings })
}

/// The range of the points that a view saw or, where it saw none, of those that project into its image.
fn derive(view: &View, seen: impl Iterator<Item = usize>, points: &[SparsePoint]) -> Result<Option<Known>> {
    let depths = seen.map(|point| view.camera.to_camera(points[point].position).z);
    if let Some(range) = range_of_depths(&view.name, depths.filter(|&depth| depth > 0.0).collect())? {
        return Ok(Some(Known::Reliable(range)));
    }
    let inside = |point: &SparsePoint| {
        let (pixel, depth) = view.camera.project(point.position)?;
        view.camera.nearest_pixel(pixel).map(|_| depth)
    };
    let depths: Vec<f64> = points.iter().filter_map(inside).collect();
    let count = depths.len();
    Ok(range_of_depths(&view.name, depths)?.map(|range| Known::Projected(range, count)))
}

/// The range of depths above 0, wider than from the smallest to the largest but without outliers; `None` of
/// none.
fn range_of_depths(name: &str, mut depths: Vec<f64>) -> Result<Option<DepthRange>> {
    depths.sort_by(f64::total_cmp);
    let Some(last) = depths.len().checked_sub(1) else { return Ok(None) };
    let percentile = |share: f64| depths[(last as f64 * share).round() as usize];
    let range = DepthRange {
        near: percentile(RANGE_PERCENTILES.0) * RANGE_WIDENING.0,
        far: percentile(RANGE_PERCENTILES.1) * RANGE_WIDENING.1,
    };
    range.check(&format!("depth range of {name} from its sparse points")).map(|()| Some(range))
}

/// The range beyond a derived one, as far as it is representable.
fn widened(range: DepthRange) -> DepthRange {
    let wide = DepthRange { near: range.near * OUTER_WIDENING.0, far: range.far * OUTER_WIDENING.1 };
    if wide.check("range").is_ok() { wide } else { range }
}

fn union(ranges: impl Iterator<Item = DepthRange>) -> Option<DepthRange> {
    ranges.reduce(|a, b| DepthRange { near: a.near.min(b.near), far: a.far.max(b.far) })
}

fn unknown(name: &str, points: usize) -> Error {
    let value = match points {
        0 => "unknown (there are no sparse points)".to_owned(),
        _ => format!(
            "unknown (of {points} sparse points, none in front of this view names it or projects into its \
             image)"
        ),
    };
    let expected = "sparse points that this view saw, or a depth range (--depth-range MIN MAX)";
    Error::argument(format!("depth range of {name}"), value, expected)
}

/// `NEAR to FAR`, with the four significant digits that a message needs.
fn describe(range: DepthRange) -> String {
    let rounded = |depth: f64| format!("{depth:.3e}").parse().unwrap_or(depth);
    format!("{} to {}", rounded(range.near), rounded(range.far))
}
