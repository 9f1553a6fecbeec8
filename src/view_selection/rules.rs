//! The rules that refine a pixel's view set once it has a solution: incidence and visibility.

use crate::geometry::ViewSets;
use crate::matching::{Problem, Source, SourceProjector, Surfaces};
use crate::options::Options;
use crate::simd::{LANES, Scalar, Simd};
use glam::Vec3;
use rayon::prelude::*;

type Lanes = [f32; LANES];

/// Eight points or directions, one a lane.
type Vectors<S> = [<S as Simd>::F32; 3];

/// Which of eight sources a surface faces: the angle between its normal and the ray to the source's center is at most
/// the one of this cosine (incident angle term of section 4). All in the reference camera's frame.
#[inline(always)]
pub fn faces_sources<S: Simd>(
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

/// In which of eight sources a validated surface at an inverse depth of `validated` hides a point at `depth` of the same
/// source (visibility term of section 4); `margin` is the relative distance that may be noise.
#[inline(always)]
pub fn are_occluded<S: Simd>(simd: S, depth: S::F32, validated: S::F32, margin: f32) -> u8 {
    let nearest = simd.mul(simd.mul(depth, simd.splat(1.0 - margin)), validated);
    !simd.simd_ge(simd.splat(1.0), nearest)
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &Vectors<S>, b: &Vectors<S>) -> S::F32 {
    simd.mul_add(a[2], b[2], simd.mul_add(a[1], b[1], simd.mul(a[0], b[0])))
}

/// The rules with their thresholds.
#[derive(Debug, Clone, Copy)]
pub struct ViewRules {
    min_cosine: f32,
    occlusion_margin: f32,
    /// Sets smaller than this fall back to the whole start set; 0 never does.
    min_views: usize,
    enabled: bool,
}

impl ViewRules {
    /// The rules of these options. A wrong solution may be hidden from everywhere; unless the options are the paper's
    /// (whose cost is then infinite), its pixel starts again from the whole start set.
    pub fn new(options: &Options, min_views: usize) -> ViewRules {
        ViewRules {
            min_cosine: options.view_selection.max_incident_angle.to_radians().cos() as f32,
            occlusion_margin: options.view_selection.occlusion_tolerance as f32,
            min_views,
            enabled: options.view_selection.pixelwise_view_selection,
        }
    }
}

/// Applies the rules to one pixel of a reference view after the other, to eight of its sources at a time.
#[derive(Debug, Clone)]
pub struct ViewSelector<'a, S: Simd> {
    simd: S,
    problem: &'a Problem<'a>,
    rules: ViewRules,
    /// Of all sources.
    projector: SourceProjector<'a, S>,
    /// Centers of projection of the sources of each group, in the reference camera's frame.
    centers: Vec<[Lanes; 3]>,
}

impl<'a, S: Simd> ViewSelector<'a, S> {
    /// A selector for the pixels of a view.
    pub fn new(simd: S, problem: &'a Problem<'a>, rules: ViewRules) -> ViewSelector<'a, S> {
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

    /// Puts into `set` the source views that see the solution of a pixel: inside the image and, with view selection,
    /// neither at grazing incidence nor occluded.
    #[inline(always)]
    pub fn select(&mut self, set: &mut [u32], (x, y): (f32, f32), depth: f32, normal: Vec3) {
        let ViewSelector { simd, problem, rules, projector, centers } = self;
        set.fill(0);
        projector.set_pixel(x, y);
        let point = problem.ray(x, y) * depth;
        let mut kept = 0;
        for (index, (group, centers)) in projector.groups().iter().zip(centers).enumerate() {
            let projections = group.project(*simd, depth);
            let mut seen = projections.inside;
            if rules.enabled {
                let centers = [simd.load(&centers[0]), simd.load(&centers[1]), simd.load(&centers[2])];
                seen &= faces_sources(*simd, point, normal, &centers, rules.min_cosine);
                let Surfaces { nearest, .. } = group.surfaces(*simd, &projections);
                let depth = simd.mul(simd.load(&projections.center[2]), simd.splat(depth));
                seen &= !are_occluded(*simd, depth, simd.load(&nearest), rules.occlusion_margin);
            }
            ViewSets::insert_eight(set, index, seen);
            kept += seen.count_ones() as usize;
        }
        if kept < rules.min_views {
            ViewSets::fill_words(set, problem.sources.len());
        }
    }
}

/// Selects the sets of some pixels, given with depth and normal of their solutions.
pub fn select_sets(
    problem: &Problem,
    rules: ViewRules,
    sets: &mut ViewSets,
    solutions: &[(usize, f32, Vec3)],
) {
    let words = sets.words_per_pixel();
    let mut selected = vec![0; solutions.len() * words];
    let groups =
        selected.par_chunks_mut(SELECTED_AT_ONCE * words).zip(solutions.par_chunks(SELECTED_AT_ONCE));
    groups.for_each(|(selected, solutions)| {
        // Every back-end gives the same bits.
        let mut selector = ViewSelector::new(Scalar, problem, rules);
        for (set, &(pixel, depth, normal)) in selected.chunks_exact_mut(words).zip(solutions) {
            let at = ((pixel % problem.image.width) as f32, (pixel / problem.image.width) as f32);
            selector.select(set, at, depth, normal);
        }
    });
    for (set, &(pixel, ..)) in selected.chunks_exact(words).zip(solutions) {
        sets.words_mut()[pixel * words..][..words].copy_from_slice(set);
    }
}

/// Pixels whose sets one thread selects at once.
const SELECTED_AT_ONCE: usize = 1 << 10;
