//! The rules that refine a pixel's view set once it has a solution: incidence and visibility.

use super::{Reference, Source, ViewSets};
use crate::options::Options;
use glam::Vec3;

/// Whether the surface faces the source: the angle between its normal and the ray to the source's centre is at most
/// the one of this cosine (incident angle term of section 4). All in the reference camera's frame.
#[inline(always)]
pub fn faces_source(point: Vec3, normal: Vec3, source_centre: Vec3, min_cosine: f32) -> bool {
    let to_source = source_centre - point;
    normal.dot(to_source) >= min_cosine * to_source.length()
}

/// Whether a validated surface at `validated_depth` hides a point at `depth` of the same source view (visibility term
/// of section 4); `margin` is the relative distance that may be noise.
#[inline(always)]
pub fn is_occluded(depth: f32, validated_depth: f32, margin: f32) -> bool {
    validated_depth < depth * (1.0 - margin)
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
            min_cosine: options.max_incident_angle.to_radians().cos() as f32,
            occlusion_margin: options.occlusion_margin as f32,
            min_views,
            enabled: options.view_selection,
        }
    }

    /// Puts into `sets` the source views that see the solution of a pixel: inside the image and, with view selection,
    /// neither at grazing incidence nor occluded.
    #[inline(always)]
    pub fn select(
        &self,
        reference: &Reference,
        sets: &mut [u32],
        (x, y): (f32, f32),
        depth: f32,
        normal: Vec3,
    ) {
        sets.fill(0);
        let point = reference.ray(x, y) * depth;
        let mut kept = 0;
        for (index, source) in reference.sources.iter().enumerate() {
            let homogeneous = source.pose.at_infinity(x, y) + source.pose.epipole / depth;
            let Some(at) = source.project(homogeneous) else { continue };
            if self.enabled && !self.sees(source, point, normal, homogeneous.z * depth, (at.x, at.y)) {
                continue;
            }
            ViewSets::insert_into(sets, index);
            kept += 1;
        }
        if kept < self.min_views {
            ViewSets::fill_words(sets, reference.sources.len());
        }
    }

    #[inline(always)]
    fn sees(&self, source: &Source, point: Vec3, normal: Vec3, depth: f32, (x, y): (f32, f32)) -> bool {
        faces_source(point, normal, source.centre, self.min_cosine)
            && !source
                .validated_at(x, y)
                .is_some_and(|validated| is_occluded(depth, 1.0 / validated.nearest, self.occlusion_margin))
    }
}
