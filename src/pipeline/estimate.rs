//! The estimate of one view between two stages. Its type parameter is the stage that it has passed.

use super::context::RunContext;
use super::cycle::{CycleRecord, Place};
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::ViewSets;
use crate::scene::{CompactPlane, Maps, PixelEstimate, PlaneMap};
use glam::{DVec2, Vec3};

/// The planes of one view on one scale, after the stage `S`: [`Searched`] or [`Checked`].
#[derive(Debug, Clone)]
pub struct ViewEstimate<S> {
    pub(super) at: Place,
    pub(super) map: PlaneMap,
    pub(super) counts: Counts,
    pub(super) cycles: Vec<CycleRecord>,
    pub(super) stage: S,
}

/// Searched, textureless regions not filled yet.
#[derive(Debug, Clone)]
pub(super) struct Unfilled {
    pub(super) view_sets: ViewSets,
    pub(super) is_textureless: Vec<bool>,
}

/// Searched in a cycle and not checked: no plane is validated.
#[derive(Debug, Clone)]
pub struct Searched {
    /// The source views that each plane is checked against.
    pub(super) view_sets: ViewSets,
}

/// Checked; its surface is not published yet, or kept apart.
#[derive(Debug, Clone)]
pub(crate) struct CheckedPlanes;

/// Checked in a cycle, filtered and published: has the verdicts, and the validated surface that other views
/// read.
#[derive(Debug, Clone)]
pub struct Checked {
    pub(super) surface: Vec<CompactPlane>,
}

/// An estimate after either stage.
#[derive(Debug, Clone)]
pub enum AnyEstimate {
    /// After a search.
    Searched(ViewEstimate<Searched>),
    /// After a check.
    Checked(ViewEstimate<Checked>),
}

/// A reference to an estimate after either stage.
#[derive(Debug, Clone, Copy)]
pub enum EstimateRef<'a> {
    /// After a search.
    Searched(&'a ViewEstimate<Searched>),
    /// After a check.
    Checked(&'a ViewEstimate<Checked>),
}

/// The maps of a view that the host provides, as the start of a search or the reference of a check.
#[derive(Debug, Clone, Copy)]
pub struct OwnMaps<'a> {
    /// Depth and normal of every pixel on the cycle's scale.
    pub maps: &'a Maps,
    /// Which planes count as validated; `None` validates all that have a depth.
    pub validated: Option<&'a [bool]>,
    /// Cost of each plane, by which planes propagated to other views are ranked; stored with a relative error
    /// of at most 1/256. `None` is 0.
    pub cost: Option<&'a [f32]>,
}

/// What the stages read of a view's own estimate: all but its surface, which other views read.
#[derive(Clone, Copy)]
pub(super) struct OwnEstimate<'a> {
    pub at: Place,
    /// One for each pixel.
    pub planes: &'a [PixelEstimate],
    /// Work done for the view so far.
    pub counts: Counts,
    /// The cycles of the view so far.
    pub cycles: &'a [CycleRecord],
}

impl<S> ViewEstimate<S> {
    pub(super) fn as_own(&self) -> OwnEstimate<'_> {
        OwnEstimate { at: self.at, planes: self.planes(), counts: self.counts, cycles: &self.cycles }
    }

    /// The view.
    pub fn view(&self) -> usize {
        self.at.view
    }

    /// The cycle it was searched in, or to whose scale it was upsampled.
    pub fn cycle(&self) -> usize {
        self.at.cycle
    }

    /// Number of pixels on its scale.
    pub fn pixels(&self) -> usize {
        self.map.planes.len()
    }

    /// Depth and normal of every pixel, validated or not.
    pub fn maps(&self) -> Maps {
        maps_of(&self.map.planes)
    }

    /// Aggregated cost of every pixel's plane, with a relative error of at most 1/256.
    pub fn cost(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.map.planes.iter().map(|plane| plane.cost.into())
    }

    /// Work done for the view so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The cycles of the view so far.
    pub fn cycles(&self) -> &[CycleRecord] {
        &self.cycles
    }

    pub(super) fn planes(&self) -> &[PixelEstimate] {
        &self.map.planes
    }

    /// The same planes after another stage.
    pub(super) fn into_stage<T>(self, stage: T) -> (ViewEstimate<T>, S) {
        let ViewEstimate { at, map, counts, cycles, stage: before } = self;
        (ViewEstimate { at, map, counts, cycles, stage }, before)
    }
}

impl ViewEstimate<Searched> {
    /// The source views that each pixel is checked against, as indices into the view's source list.
    pub fn view_sets(&self) -> &ViewSets {
        &self.stage.view_sets
    }
}

impl ViewEstimate<Checked> {
    pub(super) fn of_maps(context: &RunContext, at: Place, own: &OwnMaps) -> Result<Self> {
        context.check_place(at)?;
        let map = plane_map(context, at, own)?;
        let surface = map.publish(&context.scaled(at).camera);
        let (counts, cycles) = (Counts::default(), Vec::new());
        Ok(ViewEstimate { at, map, counts, cycles, stage: Checked { surface } })
    }

    /// For every pixel the number of source views consistent with its plane, at most 255, and whether that
    /// validates it.
    pub fn verdicts(&self) -> impl ExactSizeIterator<Item = (u8, bool)> + '_ {
        self.map.planes.iter().map(|plane| (plane.consistent_views, plane.validated))
    }

    /// The planes and the surface apart.
    #[cfg(feature = "io")]
    pub(crate) fn without_surface(self) -> (ViewEstimate<CheckedPlanes>, Vec<CompactPlane>) {
        let (planes, Checked { surface }) = self.into_stage(CheckedPlanes);
        (planes, surface)
    }

    pub(super) fn surface(&self) -> &[CompactPlane] {
        &self.stage.surface
    }

    pub(super) fn take_surface(&mut self) -> Vec<CompactPlane> {
        std::mem::take(&mut self.stage.surface)
    }
}

/// Calls a method of the estimate, whatever its stage.
macro_rules! either {
    ($estimate:expr, $name:ident => $call:expr) => {
        match $estimate {
            AnyEstimate::Searched($name) => $call,
            AnyEstimate::Checked($name) => $call,
        }
    };
}

impl AnyEstimate {
    /// The view.
    pub fn view(&self) -> usize {
        either!(self, estimate => estimate.view())
    }

    /// The cycle it was searched in, or to whose scale it was upsampled.
    pub fn cycle(&self) -> usize {
        either!(self, estimate => estimate.cycle())
    }

    /// Number of pixels on its scale.
    pub fn pixels(&self) -> usize {
        either!(self, estimate => estimate.pixels())
    }

    /// Depth and normal of every pixel, validated or not.
    pub fn maps(&self) -> Maps {
        either!(self, estimate => estimate.maps())
    }

    /// Aggregated cost of every pixel's plane, with a relative error of at most 1/256.
    pub fn cost(&self) -> Vec<f32> {
        either!(self, estimate => estimate.cost().collect())
    }

    /// Whether each pixel's plane is validated; none is before a check.
    pub fn validated(&self) -> Vec<bool> {
        self.planes().iter().map(|plane| plane.validated).collect()
    }

    /// Work done for the view so far.
    pub fn counts(&self) -> Counts {
        either!(self, estimate => estimate.counts())
    }

    /// The cycles of the view so far.
    pub fn cycles(&self) -> &[CycleRecord] {
        either!(self, estimate => estimate.cycles())
    }

    /// The estimate as bytes, which [`AnyEstimate::from_bytes`] of the same version of the crate reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        either!(self, estimate => estimate.to_bytes())
    }

    /// Length of [`AnyEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        either!(self, estimate => estimate.byte_len())
    }

    /// The estimate, `None` when it is not checked.
    pub fn checked(&self) -> Option<&ViewEstimate<Checked>> {
        match self {
            AnyEstimate::Checked(estimate) => Some(estimate),
            AnyEstimate::Searched(_) => None,
        }
    }

    /// The estimate, `None` when it is checked.
    pub fn searched(&self) -> Option<&ViewEstimate<Searched>> {
        match self {
            AnyEstimate::Searched(estimate) => Some(estimate),
            AnyEstimate::Checked(_) => None,
        }
    }

    fn planes(&self) -> &[PixelEstimate] {
        either!(self, estimate => estimate.planes())
    }
}

impl<'a> EstimateRef<'a> {
    pub(super) fn planes(self) -> &'a [PixelEstimate] {
        match self {
            EstimateRef::Searched(estimate) => estimate.planes(),
            EstimateRef::Checked(estimate) => estimate.planes(),
        }
    }
}

impl<'a> From<&'a ViewEstimate<Searched>> for EstimateRef<'a> {
    fn from(estimate: &'a ViewEstimate<Searched>) -> Self {
        EstimateRef::Searched(estimate)
    }
}

impl<'a> From<&'a ViewEstimate<Checked>> for EstimateRef<'a> {
    fn from(estimate: &'a ViewEstimate<Checked>) -> Self {
        EstimateRef::Checked(estimate)
    }
}

impl<'a> From<&'a AnyEstimate> for EstimateRef<'a> {
    fn from(estimate: &'a AnyEstimate) -> Self {
        either!(estimate, estimate => estimate.into())
    }
}

/// Converts the host's maps to planes.
fn plane_map(context: &RunContext, at: Place, own: &OwnMaps) -> Result<PlaneMap> {
    let camera = &context.scaled(at).camera;
    let grid = camera.grid();
    let lengths = [
        ("maps.depth", Some(own.maps.depth.len())),
        ("maps.normal", Some(own.maps.normal.len())),
        ("validated", own.validated.map(<[bool]>::len)),
        ("cost", own.cost.map(<[f32]>::len)),
    ];
    for (name, length) in lengths {
        if let Some(length) = length.filter(|&length| length != grid.pixels()) {
            let expected = format!("one for each of {} x {} pixels", grid.width, grid.height);
            return Err(Error::argument(name, format!("{length} values"), expected));
        }
    }
    let consistent_views = context.options.check.min_consistent_views.min(255) as u8;
    let mut planes = vec![PixelEstimate::default(); grid.pixels()];
    for (index, plane) in planes.iter_mut().enumerate() {
        let (depth, normal) = (own.maps.depth[index], Vec3::from_array(own.maps.normal[index]));
        let (x, y) = grid.position(index);
        let name = |map: &str| format!("{map} at column {x}, row {y}");
        if !(depth.is_finite() && depth >= 0.0) {
            return Err(Error::argument(name("depth"), depth, "a finite depth above 0, or 0 for none"));
        }
        if let Some(cost) = own.cost.map(|cost| cost[index])
            && (cost.is_nan() || cost < 0.0)
        {
            return Err(Error::argument(name("cost"), cost, "a number of at least 0"));
        }
        plane.cost = own.cost.map_or(0.0, |cost| cost[index]).into();
        if depth == 0.0 {
            continue;
        }
        let ray = camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
        if !is_unit(normal) || normal.dot(ray) >= 0.0 {
            let expected = "a unit vector that faces the camera (n . ray < 0)";
            return Err(Error::argument(name("normal"), normal, expected));
        }
        let validated = own.validated.is_none_or(|validated| validated[index]);
        let consistent_views = if validated { consistent_views } else { 0 };
        *plane = PixelEstimate { depth, normal: normal.normalize(), consistent_views, validated, ..*plane };
    }
    Ok(PlaneMap { planes })
}

/// Whether a normal is a unit vector within the precision of files and f32.
pub(super) fn is_unit(normal: Vec3) -> bool {
    (normal.length() - 1.0).abs() < 1e-2
}

/// Depth and normal of every plane; on one thread, since hosts call this outside of any pool.
pub(super) fn maps_of(planes: &[PixelEstimate]) -> Maps {
    Maps {
        depth: planes.iter().map(|plane| plane.depth).collect(),
        normal: planes.iter().map(|plane| plane.normal.to_array()).collect(),
    }
}
