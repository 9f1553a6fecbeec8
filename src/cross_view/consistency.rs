//! Geometric consistency check (section 5.6 of the paper): a plane is validated when enough of the source
//! views of its pixel found the same surface.
//!
//! ```text
//! same depth   |d_own - d| < depth_tolerance * d        d: depth of the point in the source view
//! in front     d - d_own > depth_tolerance * d          d_own: the source's depth at the nearest pixel
//! same normal  (R n) . n_own > cos(normal_tolerance)
//! consistent   same depth and same normal
//! validated    consistent >= min_consistent_views and consistent >= min_consistent_fraction * counted
//! ```
//!
//! Beyond the paper, depths are also the same within `reprojection_tolerance` pixels of the source view, and
//! planes have the same normal where they differ by less than `slant_tolerance` pixels at the distance of the
//! window's radius: at small triangulation angles one pixel is much depth, and normals are noise. Both are
//! widened by the error of the poses, as far as the residuals show it (`residual.rs`). Where at most
//! `few_views` views are counted a single consistent one suffices, if that error leaves its depth certain.
//!
//! Counted are the views of the pixel's view set that have the point in their image; with `ignore_occluders`
//! less those whose own depth is in front.

use super::residual;
use super::tolerance::{DepthTolerance, widening};
use crate::error::Result;
use crate::geometry::ViewSets;
use crate::matching::{PREFETCH_DISTANCE, Problem, SourceProjector};
use crate::options::CheckOptions;
use crate::parallel::{Advance, Bands, run_bands};
use crate::scene::{PixelEstimate, Verdict};
use crate::simd::{LANES, Simd, SimdLevel, Task, dispatch};
use glam::{Vec2, Vec3};

/// The depth tolerance of the recheck of filled pixels, as a fraction of the check's: their planes have no
/// cost of their own as evidence.
const RECHECK_TOLERANCE: f32 = 0.5;
/// Largest relative error of depth, from the error of the poses, with which a single view validates a plane.
const MAX_UNCERTAINTY: f32 = 0.003;
/// Median residual with exact poses, in px.
const MATCHING_ERROR: f32 = 0.25;

/// The thresholds of the check.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConsistencyRules {
    depth_tolerance: DepthTolerance,
    min_normal_cosine: f32,
    /// In px of reprojection per px of distance.
    slant_tolerance: f32,
    min_consistent_views: usize,
    min_consistent_fraction: f32,
    few_views: usize,
    /// Parallax in px from which on a single view is certain.
    min_parallax: f32,
    ignore_occluders: bool,
}

/// How the depths of eight source views compare with that of a plane, as bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DepthComparison {
    /// The source views of the same depth.
    pub same: u8,
    /// Those that are not counted: their own depth is in front, and may occlude the point.
    pub ignored: u8,
}

impl ConsistencyRules {
    /// The thresholds of these options, for planes that were matched with windows of this radius.
    pub(crate) fn new(options: &CheckOptions, window_radius: f32, median_residual: f32) -> ConsistencyRules {
        ConsistencyRules {
            depth_tolerance: DepthTolerance::new(options, median_residual),
            min_normal_cosine: options.normal_tolerance.to_radians().cos() as f32,
            slant_tolerance: options.slant_tolerance as f32 * widening(options, median_residual)
                / window_radius,
            min_consistent_views: options.min_consistent_views as usize,
            min_consistent_fraction: options.min_consistent_fraction as f32,
            few_views: options.few_views as usize,
            min_parallax: pose_error(median_residual) / MAX_UNCERTAINTY,
            ignore_occluders: options.ignore_occluders,
        }
    }

    /// The thresholds for planes that filled a gap.
    pub(crate) fn for_recheck(self) -> ConsistencyRules {
        ConsistencyRules {
            depth_tolerance: self.depth_tolerance.scaled(RECHECK_TOLERANCE),
            few_views: 0,
            ..self
        }
    }

    /// Compares the depths of a plane in eight source views' frames with the source views' own, 0 where they
    /// have none.
    #[inline(always)]
    pub(crate) fn compare<S: Simd>(
        &self,
        simd: S,
        depth: S::F32,
        own: S::F32,
        parallax: S::F32,
    ) -> DepthComparison {
        let relative = self.depth_tolerance.relative(simd, parallax);
        let tolerance = simd.mul(relative, depth);
        let (behind, in_front) = (simd.sub(own, depth), simd.sub(depth, own));
        let known = simd.simd_ge(own, simd.splat(f32::MIN_POSITIVE));
        let occluding = known & !simd.simd_ge(tolerance, in_front);
        DepthComparison {
            same: known & !simd.simd_ge(behind, tolerance) & !simd.simd_ge(in_front, tolerance),
            ignored: if self.ignore_occluders { occluding } else { 0 },
        }
    }

    /// Whether normals in the same frame are the same by their angle.
    #[inline(always)]
    pub(crate) fn is_same_normal(&self, normal: Vec3, own: Vec3) -> bool {
        normal.dot(own) > self.min_normal_cosine
    }

    /// Whether planes whose slants differ by this much, as relative inverse depth per pixel, are the same for
    /// a source view with this parallax in px: the normals of small triangulation angles are noise.
    #[inline(always)]
    fn is_same_slant(&self, difference: Vec2, parallax: f32) -> bool {
        difference.length() * parallax < self.slant_tolerance
    }

    /// Whether this many consistent views out of those counted validate a plane; the parallax of `certain`
    /// ones is large enough for a single view.
    #[inline(always)]
    pub(crate) fn validates(&self, consistent: usize, certain: usize, counted: usize) -> bool {
        (consistent >= self.min_consistent_views || counted <= self.few_views && certain > 0)
            && consistent as f32 >= self.min_consistent_fraction * counted as f32
    }
}

/// Standard deviation of the error of the poses in px, from the median residual: 1.5 medians of the absolute
/// values of a normal distribution.
fn pose_error(median_residual: f32) -> f32 {
    1.5 * (median_residual.powi(2) - MATCHING_ERROR.powi(2)).max(0.0).sqrt()
}

/// The check of the planes of a reference view against those of its source views.
pub(crate) struct ConsistencyCheck<'a> {
    /// The reference view and its sources.
    pub problem: &'a Problem<'a>,
    /// The planes that are checked.
    pub planes: &'a [PixelEstimate],
    /// The source views each is checked against.
    pub view_sets: &'a ViewSets,
    /// The planes of the source views, in the order of the problem's list; none of one that is unknown.
    pub sources: Vec<&'a [PixelEstimate]>,
    /// The thresholds.
    pub options: &'a CheckOptions,
    /// Radius in px of the windows that the planes were matched with.
    pub window_radius: f32,
    /// Whether the planes filled gaps: their tolerances are tighter.
    pub is_recheck: bool,
    /// Instruction set.
    pub level: SimdLevel,
    /// Told of the start of each band, as 0 units of work.
    pub advance: Advance<'a>,
}

impl ConsistencyCheck<'_> {
    /// The verdict on each pixel, and the median residual in px.
    ///
    /// # Errors
    /// What `advance` returns.
    pub(crate) fn run(&self) -> Result<(Vec<Verdict>, f32)> {
        dispatch(self.level, CheckTask(self))
    }
}

struct CheckTask<'a>(&'a ConsistencyCheck<'a>);

/// The pixels of a band with their verdicts.
struct Band<'b> {
    first: usize,
    verdicts: &'b mut [Verdict],
}

impl Task for CheckTask<'_> {
    type Output = Result<(Vec<Verdict>, f32)>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let CheckTask(check) = self;
        let image = check.problem.image;
        let median_residual = residual::median(simd, check);
        let rules = ConsistencyRules::new(check.options, check.window_radius, median_residual);
        let rules = if check.is_recheck { rules.for_recheck() } else { rules };
        let bands = Bands::new(image.width, image.height);
        let mut verdicts = vec![(0, false); check.planes.len()];
        let chunks = verdicts.chunks_mut(bands.pixels()).enumerate();
        let all = chunks.map(|(index, verdicts)| Band { first: index * bands.pixels(), verdicts }).collect();
        run_bands(
            simd,
            all,
            check.advance,
            |_| 0,
            #[inline(always)]
            |band: Band| {
                let mut projector = SourceProjector::with_all_sources(simd, check.problem);
                for (place, verdict) in band.verdicts.iter_mut().enumerate() {
                    let index = band.first + place;
                    let plane = &check.planes[index];
                    if plane.depth > 0.0 {
                        projector.set_pixel((index % image.width) as f32, (index / image.width) as f32);
                        *verdict =
                            check.verdict(simd, &rules, &projector, check.view_sets.words_of(index), plane);
                    }
                }
            },
        )?;
        Ok((verdicts, median_residual))
    }
}

impl ConsistencyCheck<'_> {
    /// The verdict on the plane of the projector's pixel by the views of a set; views whose image it leaves
    /// do not count.
    #[inline(always)]
    fn verdict<S: Simd>(
        &self,
        simd: S,
        rules: &ConsistencyRules,
        projector: &SourceProjector<'_, S>,
        set: &[u32],
        plane: &PixelEstimate,
    ) -> Verdict {
        let (mut consistent, mut counted, mut certain) = (0, 0, 0);
        let (focal_x, focal_y) = self.problem.inverse_focal;
        let ray = projector.ray(self.problem);
        let slant = |normal: Vec3| Vec2::new(normal.x * focal_x, normal.y * focal_y) / normal.dot(ray);
        for (index, group) in projector.groups().iter().enumerate() {
            let projections = group.project(simd, plane.depth);
            let mut known = projections.inside & ViewSets::eight(set, index);
            let pixels = group.nearest_pixels(simd, &projections);
            // All are loaded before any is compared: the loads, far apart in memory, then do not wait for
            // each other.
            let mut own_depths = [0.0; LANES];
            for (lane, (own, planes)) in own_depths.iter_mut().zip(&self.sources[index * LANES..]).enumerate()
            {
                simd.prefetch(planes, pixels[lane] as usize + PREFETCH_DISTANCE);
                match planes.get(pixels[lane] as usize) {
                    Some(found) => *own = found.depth,
                    None => known &= !(1 << lane),
                }
            }
            let depth = simd.mul(simd.load(&projections.center[2]), simd.splat(plane.depth));
            let parallax = group.parallax(simd, &projections, plane.depth);
            let DepthComparison { same, ignored } =
                rules.compare(simd, depth, simd.load(&own_depths), parallax);
            let parallax = simd.store(parallax);
            counted += (known & !ignored).count_ones() as usize;
            let mut rest = known & same;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize % LANES;
                rest &= rest - 1;
                let source = index * LANES + lane;
                let rotation = self.problem.sources[source].rotation;
                let own = self.sources[source][pixels[lane] as usize].normal;
                let same = rules.is_same_normal(rotation * plane.normal, own)
                    || rules.is_same_slant(
                        slant(plane.normal) - slant(rotation.transpose() * own),
                        parallax[lane],
                    );
                consistent += usize::from(same);
                certain += usize::from(same && parallax[lane] > rules.min_parallax);
            }
        }
        (consistent.min(255) as u8, rules.validates(consistent, certain, counted))
    }
}

#[cfg(test)]
mod tests;
