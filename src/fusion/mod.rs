//! Fusion of depth and normal maps into points (section 6 of the paper).
//!
//! Each view in turn is the reference. The 3D point of each of its pixels is projected into the overlapping
//! views and compared with depth and normal of the pixel there. With enough consistent views it becomes a
//! point of the cloud, the average over them, and their pixels start no points of their own. All other pixels
//! do, so each surface gets the density of the view with the highest resolution on it.

mod average;
mod cloud;
mod exposure;
mod overlap;
mod source;
#[cfg(feature = "io")]
mod streamed;
mod thinning;

use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::options::FusionOptions;
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::scene::{Maps, PixelStatus};
use average::{Member, average};
#[cfg(feature = "io")]
pub(crate) use cloud::CloudSource;
pub(crate) use cloud::Emit;
pub use cloud::{PointCloud, PointViews};
use glam::{DVec2, DVec3};
pub use overlap::overlaps;
use rayon::prelude::*;
use source::{Comparison, Source};
use std::sync::atomic::{AtomicU64, Ordering};
#[cfg(feature = "io")]
pub(crate) use streamed::{LoadedView, StreamedViews, streamed_bytes};
#[cfg(feature = "io")]
pub(crate) use thinning::{draw, thin_by_voxels};

/// A view with its maps: the input of [`fuse`].
#[derive(Debug, Clone, Copy)]
pub struct FusionView<'a> {
    /// The camera of the maps.
    pub camera: &'a Camera,
    /// Depth and normal of every pixel. A depth that is not a finite number above 0 is no estimate.
    pub maps: &'a Maps,
    /// The status of every pixel: only validated ones are fused. `None` fuses all that have a depth.
    pub status: Option<&'a [PixelStatus]>,
    /// The confidence of every pixel, 0 to 1: weighs it in the averages, and `min_confidence` filters by it.
    /// `None` is 1 for all.
    pub confidence: Option<&'a [f32]>,
    /// The photograph, for the colors; points are gray (128) without.
    pub picture: Option<&'a Picture>,
    /// The views that may see the same surface, as indices into the list of views.
    pub overlap: &'a [u32],
}

/// Rows fused in parallel between two calls of the progress function.
const BAND_ROWS: u32 = 32;

/// Fuses the maps of all views, on the threads of the current rayon pool; the cloud does not depend on their
/// number. The progress function gets [`Phase::Fusion`] with `done` from 0 to 1 for the fusion alone.
///
/// # Errors
/// Options out of range; an invalid camera; maps or a picture of another size than their camera; a confidence
/// outside of 0 to 1; an overlap
/// that names no view of the list, the view itself or a view twice; [`Error::Cancelled`].
///
/// # Examples
/// The plane z = 2 seen by two cameras side by side:
/// ```
/// use glam::{DMat3, DVec3};
/// use skep::fusion::{FusionView, fuse};
/// use skep::geometry::Camera;
/// use skep::{FusionOptions, Maps, Options, ignore_progress};
///
/// let camera = |x: f64| Camera {
///     width: 8,
///     height: 6,
///     fx: 10.0,
///     fy: 10.0,
///     cx: 3.5,
///     cy: 2.5,
///     rotation: DMat3::IDENTITY,
///     translation: DVec3::new(-x, 0.0, 0.0),
/// };
/// let cameras = [camera(0.0), camera(0.2)];
/// let maps = Maps { depth: vec![2.0; 48], normal: vec![[0.0, 0.0, -1.0]; 48] };
/// let overlaps = [[1], [0]];
/// let view = |index: usize| FusionView {
///     camera: &cameras[index],
///     maps: &maps,
///     status: None,
///     confidence: None,
///     picture: None,
///     overlap: &overlaps[index],
/// };
/// let options = FusionOptions { min_agreeing_views: 1, ..Options::default().fusion };
/// let cloud = fuse(&[view(0), view(1)], &options, &ignore_progress)?;
/// // The second camera sees everything one pixel further left: 7 columns are common to both.
/// assert_eq!(cloud.positions.len(), 7 * 6);
/// assert_eq!(cloud.positions[0][2], 2.0);
/// assert_eq!(cloud.views.get(0), [0, 1]);
/// # Ok::<(), skep::Error>(())
/// ```
pub fn fuse(views: &[FusionView], options: &FusionOptions, progress: ProgressFn) -> Result<PointCloud> {
    options.check()?;
    for index in 0..views.len() {
        check_view(views, index)?;
    }
    let mut cloud = PointCloud::default();
    fuse_input(&InMemory(views), options, progress, &mut |points| {
        cloud.append(points);
        Ok(())
    })?;
    thinning::thin(cloud, options)
}

/// Whether the fusion goes on; an error ends it.
type Check<'a> = &'a (dyn Fn() -> Result<()> + Sync);
/// What is done with a group of views.
type Body<'a> = &'a mut dyn FnMut(&[FusionView]) -> Result<()>;

/// The views of a fusion, of which a few at a time have to be in memory.
pub(crate) trait FusionInput {
    /// Number of views.
    fn len(&self) -> usize;

    /// The camera of a view.
    fn camera(&self, view: usize) -> &Camera;

    /// The views that may see the same surface as a view.
    fn overlap(&self, view: usize) -> &[u32];

    /// Calls `body` with these views, in this order, and `check` before each one that has to be read.
    ///
    /// # Errors
    /// Views that cannot be read; what `check` and `body` return.
    fn with_views(&self, views: &[u32], check: Check, body: Body) -> Result<()>;
}

/// Views that are all in memory.
struct InMemory<'a>(&'a [FusionView<'a>]);

impl FusionInput for InMemory<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn camera(&self, view: usize) -> &Camera {
        self.0[view].camera
    }

    fn overlap(&self, view: usize) -> &[u32] {
        self.0[view].overlap
    }

    fn with_views(&self, views: &[u32], _: Check, body: Body) -> Result<()> {
        let group: Vec<FusionView> = views.iter().map(|&view| self.0[view as usize]).collect();
        body(&group)
    }
}

/// Calls `body` with a view and those that overlap with it, in this order.
fn with_group(input: &dyn FusionInput, index: usize, check: Check, body: Body) -> Result<()> {
    let group: Vec<u32> = std::iter::once(index as u32).chain(input.overlap(index).iter().copied()).collect();
    input.with_views(&group, check, body)
}

/// Fuses like [`fuse`] but does not thin the cloud, gives the points to `emit` as they are made, and has only
/// the views that overlap with one in memory at a time. The options and the views must be valid.
///
/// # Errors
/// Views that cannot be read; what `emit` returns; [`Error::Cancelled`].
pub(crate) fn fuse_input(
    input: &dyn FusionInput,
    options: &FusionOptions,
    progress: ProgressFn,
    emit: Emit,
) -> Result<()> {
    let count = input.len();
    let order = overlap::fusion_order(count, |view| input.overlap(view));
    let used: Vec<Used> = (0..count).map(|view| Used::none_of(input.camera(view).pixels())).collect();
    let total_rows: u64 = (0..count).map(|view| u64::from(input.camera(view).height)).sum();
    let mut rows_done = 0;
    let compared = if options.compensate_exposure { exposure::SHARE } else { 0.0 };
    let report_share = |view: usize, done: f64| {
        let at = Progress { phase: Phase::Fusion, downscale: 1, cycle: 0, view, views: count, done };
        if progress(&at).is_break() { Err(Error::Cancelled) } else { Ok(()) }
    };
    let report = |view: usize, rows_done: u64| {
        report_share(view, compared + (1.0 - compared) * rows_done as f64 / total_rows.max(1) as f64)
    };

    let gains = match options.compensate_exposure {
        true => exposure::gains(input, options, &order, |place| {
            report_share(order[place], compared * place as f64 / count as f64)
        })?,
        false => vec![DVec3::ONE; count],
    };
    for &index in &order {
        let before = rows_done;
        with_group(input, index, &|| report(index, before), &mut |group| {
            let reference = Reference::new(group, index, input.overlap(index), options);
            let height = group[0].camera.height;
            for top in (0..height).step_by(BAND_ROWS as usize) {
                report(index, rows_done)?;
                let rows = top..height.min(top + BAND_ROWS);
                rows_done += rows.len() as u64;
                let fused: Vec<PointCloud> =
                    rows.into_par_iter().map(|row| reference.fuse_row(row, &used, &gains)).collect();
                fused.iter().try_for_each(&mut *emit)?;
            }
            Ok(())
        })?;
    }
    order.last().map_or(Ok(()), |&last| report(last, rows_done))
}

fn check_view(views: &[FusionView], index: usize) -> Result<()> {
    let (view, name) = (&views[index], format!("views[{index}]"));
    view.camera.check(&format!("{name}.camera"))?;
    let pixels = view.camera.pixels();
    let lengths = [
        ("maps.depth", Some(view.maps.depth.len())),
        ("maps.normal", Some(view.maps.normal.len())),
        ("status", view.status.map(<[PixelStatus]>::len)),
        ("confidence", view.confidence.map(<[f32]>::len)),
    ];
    for (map, len) in lengths {
        if let Some(len) = len.filter(|len| *len != pixels) {
            let expected = format!("one for each of the camera's {pixels} pixels");
            return Err(Error::argument(format!("{name}.{map}"), format!("{len} values"), expected));
        }
    }
    let is_fraction = |confidence: &f32| (0.0..=1.0).contains(confidence);
    if let Some((pixel, value)) =
        view.confidence.unwrap_or_default().iter().enumerate().find(|(_, value)| !is_fraction(value))
    {
        return Err(Error::argument(format!("{name}.confidence[{pixel}]"), value, "a number of 0 to 1"));
    }
    if let Some(picture) = view.picture
        && (picture.width(), picture.height()) != (view.camera.width, view.camera.height)
    {
        let value = format!("{}x{}", picture.width(), picture.height());
        let expected = format!("the camera's size, {}x{}", view.camera.width, view.camera.height);
        return Err(Error::argument(format!("{name}.picture"), value, expected));
    }
    for (place, &other) in view.overlap.iter().enumerate() {
        let known = (other as usize) < views.len() && other as usize != index;
        if !known || view.overlap[..place].contains(&other) {
            let expected = format!("other views below {}, each once", views.len());
            return Err(Error::argument(format!("{name}.overlap[{place}]"), other, expected));
        }
    }
    Ok(())
}

/// Depth and unit normal of a pixel, `None` where there is no usable estimate.
fn estimate(view: &FusionView, options: &FusionOptions, pixel: usize) -> Option<(f64, DVec3)> {
    if view.status.is_some_and(|status| status[pixel] != PixelStatus::Validated)
        || view.confidence.is_some_and(|confidence| f64::from(confidence[pixel]) < options.min_confidence)
    {
        return None;
    }
    let depth = view.maps.depth[pixel];
    let normal = DVec3::from_array(view.maps.normal[pixel].map(f64::from)).try_normalize()?;
    (depth > 0.0 && depth.is_finite()).then_some((f64::from(depth), normal))
}

/// The pixels of a view that are part of a point, one bit each.
struct Used(Vec<AtomicU64>);

impl Used {
    fn none_of(pixels: usize) -> Used {
        Used((0..pixels.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    fn has(&self, pixel: usize) -> bool {
        self.0[pixel / 64].load(Ordering::Relaxed) >> (pixel % 64) & 1 != 0
    }

    fn add(&self, pixel: usize) {
        self.0[pixel / 64].fetch_or(1 << (pixel % 64), Ordering::Relaxed);
    }
}

/// The view whose pixels become points.
struct Reference<'a> {
    /// The reference, then the views of the sources.
    group: &'a [FusionView<'a>],
    index: usize,
    options: &'a FusionOptions,
    sources: Vec<Source<'a>>,
}

impl<'a> Reference<'a> {
    fn new(
        group: &'a [FusionView<'a>],
        index: usize,
        overlap: &[u32],
        options: &'a FusionOptions,
    ) -> Reference<'a> {
        let source = |(slot, &view): (usize, &u32)| {
            Source::new(group[0].camera, (view, slot + 1), &group[slot + 1], options)
        };
        Reference { group, index, options, sources: overlap.iter().enumerate().map(source).collect() }
    }

    /// The place, depth and member of a pixel with a usable estimate.
    fn start(&self, (column, row): (u32, u32)) -> Option<(DVec2, f64, Member)> {
        let view = &self.group[0];
        let pixel = row as usize * view.camera.width as usize + column as usize;
        let (depth, normal) = estimate(view, self.options, pixel)?;
        let place = DVec2::new(f64::from(column), f64::from(row));
        let to_world = view.camera.rotation.transpose();
        let start = Member {
            view: self.index as u32,
            slot: 0,
            pixel,
            position: to_world * (view.camera.ray(place) * depth),
            normal: to_world * normal,
            weight: weight(view, pixel, depth),
        };
        Some((place, depth, start))
    }

    /// The points that start in a row; `gains` are the factors of the colors of each view. `used` tells by
    /// view and pixel whether it is part of a point: while one view is the reference, its own flags are only
    /// read and those of the others only set, so that the order of the threads does not matter.
    fn fuse_row(&self, row: u32, used: &[Used], gains: &[DVec3]) -> PointCloud {
        let view = &self.group[0];
        let first = row as usize * view.camera.width as usize;
        let mut points = PointCloud::default();
        let (mut members, mut point_views) = (Vec::new(), Vec::new());
        for column in 0..view.camera.width {
            let pixel = first + column as usize;
            if used[self.index].has(pixel) {
                continue;
            }
            let Some((place, depth, start)) = self.start((column, row)) else { continue };
            if !self.collect_members(start, place, depth, &mut members) {
                continue;
            }
            for member in &members[1..] {
                used[member.view as usize].add(member.pixel);
            }
            point_views.clear();
            point_views.extend(members.iter().map(|member| member.view));
            let (position, normal, color) = average(&members, |member| {
                let color = |rgb| DVec3::from_array(rgb) * gains[member.view as usize];
                self.group[member.slot].picture.map(|picture| color(picture.rgb(member.pixel).map(f64::from)))
            });
            points.positions.push((view.camera.center() + position).to_array());
            points.normals.push(normal.as_vec3().to_array());
            points.colors.push(color);
            points.views.push(&point_views);
        }
        points
    }

    /// Collects the start and the consistent pixels of other views; `true` when they make a point.
    fn collect_members(&self, start: Member, pixel: DVec2, depth: f64, members: &mut Vec<Member>) -> bool {
        members.clear();
        members.push(start);
        let (mut conflicts, mut seeing) = (0, 0);
        for source in &self.sources {
            match source.compare(pixel, depth, &start) {
                Comparison::Consistent(member) => {
                    members.push(member);
                    seeing += 1;
                }
                Comparison::SeesThrough => conflicts += 1,
                Comparison::Sees => seeing += 1,
                Comparison::Unknown => {}
            }
        }
        let agreeing = members.len() - 1;
        let FusionOptions { min_agreeing_views, min_agreeing_fraction, .. } = *self.options;
        if agreeing >= min_agreeing_views as usize {
            // At edges of thin objects the pixel of another view, half a pixel off, may be on the background:
            // only a majority of conflicts rejects a point.
            return conflicts <= members.len();
        }
        min_agreeing_fraction > 0.0
            && agreeing >= 1
            && agreeing as f64 >= min_agreeing_fraction * f64::from(seeing)
            && conflicts == 0
    }
}

/// Smallest weight of a pixel without confidence: an average has a weight.
const MIN_CONFIDENCE_WEIGHT: f64 = 0.01;

/// Weight in the average: the confidence over the square of the width of a pixel on the surface.
fn weight(view: &FusionView, pixel: usize, depth: f64) -> f64 {
    let confidence = view.confidence.map_or(1.0, |confidence| f64::from(confidence[pixel]));
    confidence.max(MIN_CONFIDENCE_WEIGHT) * view.camera.fx * view.camera.fy / (depth * depth)
}
