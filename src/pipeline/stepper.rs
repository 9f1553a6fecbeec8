//! The public stepwise interface: checks the arguments and calls the stages.

use super::context::RunContext;
use super::cycle::{Cycle, CycleRecord, Place};
use super::estimate::{Checked, CheckedPlanes, EstimateRef, OwnMaps, Searched, ViewEstimate};
use super::progress::Tracker;
use super::result::ViewResult;
use super::sources::{PublishedSurfaces, SourcePlanes};
use super::stages::{self, Candidates, Propagation, SearchInput};
use super::view_tasks;
use crate::error::{Error, Result};
use crate::fusion::PointCloud;
use crate::options::Options;
use crate::parallel::{Phase, ProgressFn};
use crate::scene::Scene;

/// A run stage by stage, for hosts that schedule views themselves, on one machine or many, or provide maps of
/// their own.
///
/// A run is, for each cycle from [`Stepper::cycles`]:
///
/// 1. [`upsample`](Stepper::upsample) the estimates when the cycle is on a finer scale;
/// 2. [`propagate`](Stepper::propagate) to and [`search`](Stepper::search) every view, from the checked
///    estimates of the cycle before;
/// 3. [`check`](Stepper::check) every view against the searched estimates of this cycle;
/// 4. call [`next`](Stepper::next) for the next cycle.
///
/// After the last, [`finish`](Stepper::finish) every view and [`fuse`](Stepper::fuse) the results. This gives
/// the same bits as [`reconstruct`](crate::reconstruct).
///
/// The estimates of other views are passed as one entry for each view of the scene; `None` where a view has
/// no estimate. Each call reads only the entries that its documentation names.
///
/// A stepper is immutable: calls for different views may run concurrently from several threads. They run on
/// the rayon pool of the caller.
pub struct Stepper(RunContext);

/// One entry for each view of the scene.
type Known<'a, S> = &'a [Option<&'a ViewEstimate<S>>];

impl Stepper {
    /// Prepares the images of all scales, and chooses the source views.
    ///
    /// # Errors
    /// An option out of its range, named.
    pub fn new(scene: &Scene, options: &Options) -> Result<Stepper> {
        RunContext::new(scene, options, &|_| Ok(())).map(Stepper)
    }

    /// Like [`Stepper::new`], but photographs are decoded when they are needed, and packed images of up to
    /// `limit` bytes stay in memory.
    ///
    /// # Errors
    /// An option out of its range, named.
    pub fn with_image_limit(scene: &Scene, options: &Options, limit: usize) -> Result<Stepper> {
        RunContext::with_image_limit(scene, options, limit).map(Stepper)
    }

    /// The same with another limit of the packed images in memory.
    #[cfg(feature = "io")]
    pub(crate) fn limited_to(self, limit: usize) -> Stepper {
        Stepper(self.0.limited_to(limit))
    }

    /// The cycles in order.
    pub fn cycles(&self) -> &[Cycle] {
        self.0.cycles()
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        self.0.views()
    }

    /// The source views of a view, which its view sets index.
    pub fn sources(&self, view: usize) -> &[u32] {
        self.0.sources(view)
    }

    /// Warnings about the selection of source views, as sentences.
    pub fn warnings(&self) -> &[String] {
        self.0.warnings()
    }

    /// Width and height of a view's maps in a cycle.
    ///
    /// # Errors
    /// A cycle or view that does not exist.
    pub fn size(&self, cycle: usize, view: usize) -> Result<(u32, u32)> {
        let at = Place { cycle, view };
        self.0.check_place(at)?;
        let camera = &self.0.scaled(at).camera;
        Ok((camera.width, camera.height))
    }

    /// The checked estimate of a view on the scale of `cycle`, the next finer one: each pixel gets the plane
    /// of its coarse pixel. Reads this view only.
    ///
    /// # Errors
    /// A cycle that does not exist; an estimate that is not of the scale before that of `cycle`, or of
    /// another scene.
    pub fn upsample(&self, cycle: usize, estimate: &ViewEstimate<Checked>) -> Result<ViewEstimate<Checked>> {
        let at = Place { cycle, view: estimate.view() };
        self.0.check_place(at)?;
        let scale = |cycle: usize| self.cycles().get(cycle).map(|cycle| cycle.scale_index);
        let is_coarser = scale(estimate.cycle()).map(|scale| scale + 1) == scale(cycle);
        if !is_coarser {
            let value = format!("one of cycle {}", estimate.cycle());
            let expected = format!("one of the scale before that of cycle {cycle}");
            return Err(Error::argument("estimate", value, expected));
        }
        self.check_size(estimate.cycle(), estimate, "estimate")?;
        Ok(self.publish(stages::upsampled(&self.0, at, estimate)))
    }

    /// The candidates for the pixels of a view that have no validated plane: of the planes of other views
    /// that at least one source view confirms, the one of lowest cost. None in a scale's first cycle. Reads
    /// the checked planes of the view itself and of the views that have it among their sources, on the scale
    /// of the cycle.
    ///
    /// # Errors
    /// A cycle or view that does not exist; estimates whose scale, scene or view does not match their entry.
    pub fn propagate(&self, cycle: usize, view: usize, estimates: Known<Checked>) -> Result<Candidates> {
        let at = Place { cycle, view };
        self.check_estimates(at, estimates)?;
        let known = |view: usize| estimates.get(view).copied().flatten();
        let mut propagation = Propagation::new(&self.0, at, known(view).map(ViewEstimate::as_own));
        for &donor in propagation.donors() {
            if let Some(found) = known(donor as usize) {
                propagation.add(donor as usize, found.planes(), &|_| Ok(()))?;
            }
        }
        Ok(propagation.finish())
    }

    /// Searches the planes of a view and fills its textureless regions. Starts from the view's own checked
    /// estimate, where one is given, else at random; reads the published surfaces of the view's sources and
    /// the candidates.
    ///
    /// # Errors
    /// The errors of [`Stepper::propagate`]; candidates of another view or cycle; [`Error::Cancelled`] when
    /// `progress` returns `Break`.
    pub fn search(
        &self,
        cycle: usize,
        view: usize,
        estimates: Known<Checked>,
        candidates: Option<&Candidates>,
        progress: ProgressFn,
    ) -> Result<ViewEstimate<Searched>> {
        let at = Place { cycle, view };
        self.check_estimates(at, estimates)?;
        let pixels = self.0.scaled(at).camera.pixels();
        if let Some(found) = candidates
            && (found.at, found.pixels) != (at, pixels)
        {
            let value = format!("those of view {} in cycle {}", found.at.view, found.at.cycle);
            let expected = format!("those of view {view} in cycle {cycle}, of the same stepper");
            return Err(Error::argument("candidates", value, expected));
        }
        let tracker = Tracker::with_work(progress, self.cycles()[cycle].work(pixels as u64));
        let advance = |units| tracker.advance(units, self.0.progress(Phase::Search, at));
        let own = estimates.get(view).copied().flatten().map(ViewEstimate::as_own);
        let is_guided = estimates.iter().any(Option::is_some);
        let input = SearchInput { own, candidates, is_guided };
        view_tasks::search(&self.0, at, self.surfaces(view, estimates), input, &advance)
    }

    /// Checks the planes of a view against those of its sources, then corrects foreground fattening (where
    /// the scale may end with this cycle), smooths the validated planes and publishes them: depths, normals
    /// and verdicts differ from those of the searched estimate. Reads the searched planes of the view's
    /// sources in the same cycle, or maps of the host for them; a source without an estimate counts neither
    /// for nor against a plane.
    ///
    /// # Errors
    /// An estimate or a source whose scale, scene or view does not match its entry.
    pub fn check(
        &self,
        own: &ViewEstimate<Searched>,
        sources: &[Option<EstimateRef>],
    ) -> Result<ViewEstimate<Checked>> {
        self.check_size(own.cycle(), own, "own")?;
        self.check_sources(own.at, sources)?;
        let planes = |view: usize| sources.get(view).copied().flatten().map(EstimateRef::planes);
        let planes = SourcePlanes::new(self.sources(own.view()), planes);
        view_tasks::check(&self.0, own, planes, &|_| Ok(()))
    }

    /// The cycle that follows this one; `None` after the last. Call it once every view is checked
    /// in this cycle. From its second cycle on, a scale ends early once the fraction of changed pixels of the
    /// given estimates is below the option `schedule.min_changed_fraction`.
    ///
    /// # Errors
    /// A cycle that does not exist; estimates of another scale.
    pub fn next(&self, cycle: usize, estimates: Known<Checked>) -> Result<Option<usize>> {
        self.check_estimates(Place { cycle, view: 0 }, estimates)?;
        Ok(self
            .0
            .next_cycle(cycle, estimates.iter().copied().flatten().filter_map(|own| own.cycles().last())))
    }

    /// Like [`Stepper::next`], from the last record of every view.
    ///
    /// # Errors
    /// A cycle that does not exist.
    pub fn next_after(&self, cycle: usize, records: &[CycleRecord]) -> Result<Option<usize>> {
        self.0.check_place(Place { cycle, view: 0 })?;
        Ok(self.0.next_cycle(cycle, records.iter()))
    }

    #[cfg(feature = "io")]
    /// Units of work of searching all views in the cycles before this one; see [`Cycle::work`].
    pub(crate) fn work_before(&self, cycle: usize) -> u64 {
        self.0.work_before(cycle)
    }

    /// The result of a view after the last cycle: averages validated planes across views, fills small gaps
    /// where the sources confirm them, removes speckles, and determines view set, cost (mean of 1 - NCC) and
    /// status of every pixel. Reads the published surfaces of the view's sources, and their checked planes.
    ///
    /// # Errors
    /// A view that does not exist; estimates that are not of full size, or whose scene or view does not match
    /// their entry; no estimate of the view itself; [`Error::Cancelled`] when `progress` returns `Break`.
    pub fn finish(&self, view: usize, estimates: Known<Checked>, progress: ProgressFn) -> Result<ViewResult> {
        let at = Place { cycle: self.cycles().len() - 1, view };
        self.check_estimates(at, estimates)?;
        let Some(own) = estimates.get(view).copied().flatten() else {
            let name = format!("estimates[{view}]");
            return Err(Error::argument(name, "none", "the estimate of the view itself"));
        };
        let tracker = Tracker::with_work(progress, 1);
        let advance = |units| tracker.advance(units, self.0.progress(Phase::Check, at));
        let known = |view: usize| estimates.get(view).copied().flatten().map(ViewEstimate::planes);
        let sources = SourcePlanes::new(self.sources(view), known);
        view_tasks::finish(&self.0, at, self.surfaces(view, estimates), own.as_own(), sources, &advance)
    }

    /// Fuses the validated pixels of the results of all views into points.
    ///
    /// # Errors
    /// A scene or results of another number of views than the stepper has; [`Error::Cancelled`] when
    /// `progress` breaks.
    pub fn fuse(&self, scene: &Scene, results: &[ViewResult], progress: ProgressFn) -> Result<PointCloud> {
        for (name, count) in [("scene", scene.views().len()), ("results", results.len())] {
            if count != self.views() {
                let expected = format!("the {} views of the stepper", self.views());
                return Err(Error::argument(name, format!("{count} views"), expected));
            }
        }
        stages::fuse(scene, &self.0.options, results, progress)
    }

    /// The views that have a view among their sources, ascending.
    #[cfg(feature = "io")]
    pub(crate) fn readers(&self, view: usize) -> &[u32] {
        self.0.readers(view)
    }

    /// The views whose estimates the stages of a view read, ascending: its own, its sources, and those whose
    /// source it is.
    #[cfg(feature = "io")]
    pub(crate) fn views_read_by(&self, view: usize) -> Vec<usize> {
        let others = self.sources(view).iter().chain(self.readers(view));
        let mut read: Vec<usize> = others.map(|&other| other as usize).chain([view]).collect();
        read.sort_unstable();
        read.dedup();
        read
    }

    #[cfg(feature = "io")]
    pub(super) fn context(&self) -> &RunContext {
        &self.0
    }

    /// Publishes the surface of an estimate that has none yet.
    pub(crate) fn publish(&self, planes: ViewEstimate<CheckedPlanes>) -> ViewEstimate<Checked> {
        let surface = stages::surface(&self.0, &planes);
        planes.into_stage(Checked { surface }).0
    }

    fn surfaces<'e>(&self, view: usize, estimates: Known<'e, Checked>) -> PublishedSurfaces<'e> {
        let surface =
            |source: usize| estimates.get(source).copied().flatten().map_or(&[][..], ViewEstimate::surface);
        PublishedSurfaces::new(self.sources(view), surface)
    }

    /// Returns an error for sources of a check whose view or scale does not match their entry.
    pub(crate) fn check_sources(&self, at: Place, sources: &[Option<EstimateRef>]) -> Result<()> {
        self.0.check_place(at)?;
        self.check_count(sources.len())?;
        for (view, source) in sources.iter().enumerate() {
            let name = format!("estimates[{view}]");
            match source {
                Some(EstimateRef::Searched(found)) => self.check_estimate(at.cycle, view, found, &name)?,
                Some(EstimateRef::Checked(found)) => self.check_estimate(at.cycle, view, found, &name)?,
                None => (),
            }
        }
        Ok(())
    }

    /// Returns an error for estimates whose view or scale does not match their entry.
    fn check_estimates<S>(&self, at: Place, estimates: Known<S>) -> Result<()> {
        self.0.check_place(at)?;
        self.check_count(estimates.len())?;
        for (view, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate else { continue };
            self.check_estimate(at.cycle, view, estimate, &format!("estimates[{view}]"))?;
        }
        Ok(())
    }

    fn check_count(&self, count: usize) -> Result<()> {
        if count == 0 || count == self.views() {
            return Ok(());
        }
        let expected = format!("one entry for each of the {} views, or none at all", self.views());
        Err(Error::argument("estimates", format!("{count} entries"), expected))
    }

    fn check_estimate<S>(
        &self,
        cycle: usize,
        view: usize,
        found: &ViewEstimate<S>,
        name: &str,
    ) -> Result<()> {
        if found.view() != view {
            let (value, expected) =
                (format!("the estimate of view {}", found.view()), format!("that of view {view}"));
            return Err(Error::argument(name, value, expected));
        }
        self.check_size(cycle, found, name)
    }

    /// Returns an error for an estimate that is not of the scale of a cycle.
    fn check_size<S>(&self, cycle: usize, found: &ViewEstimate<S>, name: &str) -> Result<()> {
        let (width, height) = self.size(cycle, found.view())?;
        let scale = |cycle: usize| self.cycles().get(cycle).map(|cycle| cycle.scale_index);
        let has_scale = scale(found.cycle()) == scale(cycle);
        if has_scale && found.pixels() == width as usize * height as usize {
            return Ok(());
        }
        let value = format!("one of cycle {} with {} pixels", found.cycle(), found.pixels());
        let expected = format!(
            "one on the scale of cycle {cycle}, {width}x{height} pixels, of the same scene and options; \
             estimates of the next coarser scale are upsampled first"
        );
        Err(Error::argument(name, value, expected))
    }
}

impl ViewEstimate<Checked> {
    /// The estimate of a view whose maps the host brings, as if it had been checked in this cycle.
    ///
    /// # Errors
    /// A cycle or view that does not exist; maps of another size than the view has in the cycle; a depth that
    /// is negative or not finite; a normal that is not unit or turned away from the camera where there is a
    /// depth; a cost that is negative or not a number.
    pub fn from_maps(stepper: &Stepper, cycle: usize, view: usize, own: &OwnMaps) -> Result<Self> {
        ViewEstimate::of_maps(&stepper.0, Place { cycle, view }, own)
    }
}
