//! Pixelwise view selection: the view set of a pixel, from the incidence and the visibility of its solution.

use crate::geometry::ViewSets;
use crate::matching::{Problem, Source, SourceProjector, Surfaces};
use crate::options::Options;
use crate::simd::{LANES, Scalar, Simd};
use glam::Vec3;
use rayon::prelude::*;

/// Pixels per parallel job: many enough that scheduling costs little beside the work.
const PIXELS_PER_JOB: usize = 1 << 10;

/// One value per source view of a group, in memory.
type Lanes = [f32; LANES];

/// Eight points or directions, one per lane.
type Vectors<S> = [<S as Simd>::F32; 3];

/// Bit mask of the sources that a surface faces: the incident angle, between its normal and the ray to the
/// center of the source, has at least this cosine (incident angle term of section 4). All vectors are in the
/// reference camera's frame.
#[inline(always)]
pub(super) fn faces_sources<S: Simd>(
    simd: S,
    point: Vec3,
    normal: Vec3,
    source_centers: &Vectors<S>,
    min_cosine: f32,
) -> u8 {
    let [x, y, z] = *source_centers;
    let to_source = [
        simd.sub(x, simd.splat(point.x)),
        simd.sub(y, simd.splat(point.y)),
        simd.sub(z, simd.splat(point.z)),
    ];
    let normal = [simd.splat(normal.x), simd.splat(normal.y), simd.splat(normal.z)];
    let length = simd.sqrt(dot(simd, &to_source, &to_source));
    simd.simd_ge(dot(simd, &normal, &to_source), simd.mul(simd.splat(min_cosine), length))
}

/// Bit mask of the sources in which a point is occluded: its depth in the source exceeds that of the
/// validated surface by more than `tolerance`, relative to the depth (visibility term of section 4).
/// `validated` is the inverse depth of the surface, 0 where there is none.
#[inline(always)]
pub(super) fn are_occluded<S: Simd>(simd: S, depth: S::F32, validated: S::F32, tolerance: f32) -> u8 {
    let ratio = simd.mul(simd.mul(depth, simd.splat(1.0 - tolerance)), validated);
    !simd.simd_ge(simd.splat(1.0), ratio)
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &Vectors<S>, b: &Vectors<S>) -> S::F32 {
    simd.mul_add(a[2], b[2], simd.mul_add(a[1], b[1], simd.mul(a[0], b[0])))
}

/// The thresholds of pixelwise view selection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ViewRules {
    /// Cosine of the largest incident angle.
    min_cosine: f32,
    /// Relative difference in depth up to which nothing is occluded.
    occlusion_tolerance: f32,
    /// A smaller set is replaced by all source views; 0 never is.
    min_views: usize,
    enabled: bool,
}

impl ViewRules {
    /// The thresholds of these options. A wrong solution may be occluded in every source view: with
    /// `min_views` above 0 its pixel gets all source views again. The paper has no such rule: its cost is
    /// then infinite.
    pub(crate) fn new(options: &Options, min_views: usize) -> ViewRules {
        ViewRules {
            min_cosine: options.view_selection.max_incident_angle.to_radians().cos() as f32,
            occlusion_tolerance: options.view_selection.occlusion_tolerance as f32,
            min_views,
            enabled: options.view_selection.pixelwise_view_selection,
        }
    }
}

/// Selects the view sets of the pixels of a reference view, one pixel at a time and eight source views at a
/// time.
#[derive(Debug, Clone)]
pub(crate) struct ViewSelector<'a, S: Simd> {
    simd: S,
    problem: &'a Problem<'a>,
    rules: ViewRules,
    /// Projects into all source views.
    projector: SourceProjector<'a, S>,
    /// Centers of projection of the source views of each group, in the reference camera's frame.
    centers: Vec<[Lanes; 3]>,
}

impl<'a, S: Simd> ViewSelector<'a, S> {
    /// A selector for the pixels of a reference view.
    pub(crate) fn new(simd: S, problem: &'a Problem<'a>, rules: ViewRules) -> ViewSelector<'a, S> {
        let lanes = |sources: &[Source], axis: usize| -> Lanes {
            std::array::from_fn(|lane| sources.get(lane).map_or(0.0, |source| source.center[axis]))
        };
        let centers = |sources: &[Source]| std::array::from_fn(|axis| lanes(sources, axis));
        let centers = problem.sources.chunks(LANES).map(centers).collect();
        ViewSelector {
            simd,
            problem,
            rules,
            projector: SourceProjector::with_all_sources(simd, problem),
            centers,
        }
    }

    /// Sets `set` to the source views that see the solution of a pixel: inside the image and, with pixelwise
    /// view selection, neither at grazing incidence nor occluded.
    #[inline(always)]
    pub(crate) fn select(&mut self, set: &mut [u32], (x, y): (f32, f32), depth: f32, normal: Vec3) {
        let ViewSelector { simd, problem, rules, projector, centers } = self;
        set.fill(0);
        projector.set_pixel(x, y);
        let point = problem.ray(x, y) * depth;
        let mut selected = 0;
        for (index, (group, centers)) in projector.groups().iter().zip(centers).enumerate() {
            let projections = group.project(*simd, depth);
            let mut visible = projections.inside;
            if rules.enabled {
                let centers = [simd.load(&centers[0]), simd.load(&centers[1]), simd.load(&centers[2])];
                visible &= faces_sources(*simd, point, normal, &centers, rules.min_cosine);
                let Surfaces { nearest, .. } = group.surfaces(*simd, &projections);
                let depth = simd.mul(simd.load(&projections.center[2]), simd.splat(depth));
                visible &= !are_occluded(*simd, depth, simd.load(&nearest), rules.occlusion_tolerance);
            }
            ViewSets::insert_eight(set, index, visible);
            selected += visible.count_ones() as usize;
        }
        if selected < rules.min_views {
            ViewSets::fill_words(set, problem.sources.len());
        }
    }
}

/// Replaces the view sets of some pixels, each given as index, depth and normal of its solution.
pub(crate) fn select_sets(
    problem: &Problem,
    rules: ViewRules,
    sets: &mut ViewSets,
    solutions: &[(usize, f32, Vec3)],
) {
    let words = sets.words_per_pixel();
    let mut selected = vec![0; solutions.len() * words];
    let jobs = selected.par_chunks_mut(PIXELS_PER_JOB * words).zip(solutions.par_chunks(PIXELS_PER_JOB));
    jobs.for_each(|(selected, solutions)| {
        // Only filled pixels come here, and every back-end gives the same bits.
        let mut selector = ViewSelector::new(Scalar, problem, rules);
        for (set, &(pixel, depth, normal)) in selected.chunks_exact_mut(words).zip(solutions) {
            let position = ((pixel % problem.image.width) as f32, (pixel / problem.image.width) as f32);
            selector.select(set, position, depth, normal);
        }
    });
    for (set, &(pixel, ..)) in selected.chunks_exact(words).zip(solutions) {
        sets.words_mut()[pixel * words..][..words].copy_from_slice(set);
    }
}
