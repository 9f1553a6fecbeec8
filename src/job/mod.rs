//! Runs in a folder: larger than memory, resumed after an interruption, divided among processes and machines.
//!
//! A run is a set of [tasks](Task). What a task writes is complete or absent, and a record tells that the
//! task is done, with a fingerprint of each file. So a run that ended early (a crash, a full disk, Ctrl-C)
//! goes on where it stopped, with the same bits; and any scheduler may run the tasks of one kind and cycle at
//! the same time, on machines that share the folder. Estimates of views are read when a task needs them, and
//! kept in memory as far as the option `memory` allows.
//!
//! The folder is also the workspace with the results: see [`crate::io::Workspace`].

mod cloud;
mod estimates;
mod folder;
mod fuse;
mod manifest;
mod maps;
mod meter;
mod needs;
mod outputs;
mod photograph;
mod plan;
mod run;
mod state;
mod task;

use crate::error::{Error, Result};
use crate::fusion::{CloudSource, overlaps};
use crate::geometry::DepthRange;
use crate::import::prepare;
use crate::io::{ModelImage, Workspace};
use crate::memory::require_memory;
use crate::options::Options;
use crate::parallel::{JoinedPool, ProgressFn, useful_threads};
use crate::pipeline::{Checked, CheckedEstimates, CycleRecord, Stepper, ViewEstimate, thread_count};
use crate::scene::Scene;
use cloud::CloudScene;
use estimates::Estimates;
use folder::{Access, Lock, RunFolder};
use fuse::points_of;
pub use fuse::{FusedWorkspace, fuse_workspace};
use glam::DVec3;
use manifest::Manifest;
pub use maps::check_maps;
pub use needs::Needs;
use needs::{Least, Shares};
use plan::Plan;
pub use run::Summary;
pub use state::{RunState, ViewState, read_state};
use std::path::{Path, PathBuf};
use task::{Content, Record};
pub use task::{Task, ViewSummary};

/// What tasks need is estimated upwards, and a part of it is held already: one part less than so many is asked
/// of the system for a task. Views of 12 megapixels took two thirds of the estimate.
const ROOM_PARTS: u64 = 4;

/// A run in a folder.
///
/// # Examples
/// ```no_run
/// use skep::job::Job;
/// use skep::{Options, ignore_progress};
///
/// let (scene, folder) = ("SCENE".as_ref(), "SCENE/dense".as_ref());
/// let job = Job::plan(scene, None, &Options::default(), folder, false, &ignore_progress)?;
/// println!("{:.0} CPU seconds", job.needs().cpu_seconds);
/// let summary = job.run(&ignore_progress)?;
/// println!("{} points", summary.points);
/// # Ok::<(), skep::Error>(())
/// ```
pub struct Job {
    folder: RunFolder,
    workspace: Workspace,
    scene: Scene,
    options: Options,
    stepper: Stepper,
    run: u64,
    estimates: Estimates,
    /// The views that get maps, ascending.
    references: Vec<usize>,
    /// By reference, the references that the fusion compares it with, as places in their list.
    overlaps: Vec<Vec<u32>>,
    needs: Needs,
    shares: Shares,
    notices: Vec<String>,
    /// Locked until the job is dropped.
    lock: Lock,
}

impl Job {
    /// Plans the run of a scene in a folder, which is created: reads model and photographs and puts them into
    /// the folder. The scene is a folder or file of any format that [`crate::import`] reads; photographs are
    /// undistorted and reduced as [`InputOptions`](crate::InputOptions) say. A run of the same photographs,
    /// model, options and version that began there goes on, unless `fresh`; anything else begins anew, and
    /// [`Job::notices`] tells why. The options `threads` and `memory`
    /// may change. No other process can work on the run while the job exists.
    ///
    /// # Errors
    /// An option out of its range; less memory than the run needs; a file that is missing or damaged; a
    /// folder that cannot be written, holds another scene, or in which another process works;
    /// [`Error::Cancelled`]. An earlier run in the folder is then as it was, but for photographs and model
    /// where the scene's had to be changed before the run.
    pub fn plan(
        scene: &Path,
        depth_range: Option<DepthRange>,
        options: &Options,
        folder: &Path,
        fresh: bool,
        progress: ProgressFn,
    ) -> Result<Job> {
        options.check()?;
        let folder = RunFolder::new(folder);
        // Dropped last if the run is refused: it removes what was made for it.
        let lock = folder.lock(Access::Whole)?;
        // How much work there is is known from the scene alone.
        let pool = JoinedPool::new(useful_threads(options.threads, usize::MAX))?;
        let prepared = pool.install(|| prepare(scene, options, folder.root(), progress))?;
        let plan = pool.install(|| plan::read(&prepared, depth_range, options, &folder, progress))?;
        let manifest = plan.manifest.clone();
        let mut job = pool.install(|| Job::new(folder, plan, options, lock))?;
        job.needs.require(job.needs.least_memory)?;
        // Last: a run that cannot begin leaves the folder as it was.
        job.notices = plan::prepare(&job.folder, &prepared.folder, &manifest, fresh)?;
        job.notices.splice(..0, prepared.warnings);
        job.lock.keep();
        Ok(job)
    }

    /// Opens a run that was planned, to do some of its tasks; other processes may do others at the same time.
    /// Its options are those it was planned with, but for `threads`, `memory` and `simd`, which are those of
    /// `others`.
    ///
    /// # Errors
    /// A folder without a run of this version; a model that changed; another process that plans or does the
    /// whole run.
    pub fn open(folder: &Path, others: &Options) -> Result<Job> {
        let folder = RunFolder::new(folder);
        let path = folder.manifest();
        let Some(manifest) = Manifest::read(&path)? else {
            return Err(Error::file(&path, "no such file; `skep plan SCENE -o DIR` plans a run in a folder"));
        };
        let options = manifest.options(others)?;
        options.check()?;
        let lock = folder.lock(Access::Tasks)?;
        let scene = plan::read_planned(&folder, &manifest, &options)?;
        let pool = JoinedPool::new(thread_count(&scene, &options))?;
        pool.install(|| Job::new(folder, Plan { scene, manifest }, &options, lock))
    }

    fn new(folder: RunFolder, plan: Plan, options: &Options, lock: Lock) -> Result<Job> {
        let Plan { scene, manifest } = plan;
        let run = manifest.run();
        // The first stepper knows the source views, from which the limit of the images follows.
        let planned = Stepper::with_image_limit(&scene, options, 0)?;
        let is_reference = |&view: &usize| !manifest.photographs[view].is_source_only;
        let references: Vec<usize> = (0..scene.views().len()).filter(is_reference).collect();
        let centers: Vec<DVec3> =
            references.iter().map(|&view| scene.views()[view].camera.center()).collect();
        let overlaps = overlaps(&centers, &points_of(scene.points(), &references, scene.views().len()));
        let (needs, shares) = needs::needs(&scene, options, &planned, (&references, &overlaps));
        let estimates = Estimates::new(&folder, run, shares.estimates);
        Ok(Job {
            workspace: Workspace::new(folder.root()),
            folder,
            options: options.clone(),
            stepper: planned.limited_to(shares.images),
            scene,
            run,
            estimates,
            references,
            overlaps,
            needs,
            shares,
            notices: Vec::new(),
            lock,
        })
    }

    /// The scene; its photographs are decoded when they are loaded.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The options of the run.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The cycles and source views of the run.
    pub fn stepper(&self) -> &Stepper {
        &self.stepper
    }

    /// The folder, with the results once they are written.
    pub fn workspace(&self) -> &Workspace {
        &self.workspace
    }

    /// The views that get maps, ascending: all, unless the option `input.reference` chooses them.
    pub fn references(&self) -> &[usize] {
        &self.references
    }

    /// The views whose files the tasks of a view read, ascending: its own, its sources, and those whose
    /// source it is.
    pub fn views_read_by(&self, view: usize) -> Vec<usize> {
        self.stepper.views_read_by(view)
    }

    /// What the run needs.
    pub fn needs(&self) -> Needs {
        self.needs
    }

    /// What became of an earlier run in the folder, as sentences.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The checked estimate of a view, while the run is in the cycle or in the next one.
    ///
    /// # Errors
    /// An estimate that is not there, not yet or not anymore; a damaged file.
    pub fn checked(&self, cycle: usize, view: usize) -> Result<ViewEstimate<Checked>> {
        self.check_task(Task::Check { cycle, view })?;
        let planes = self.estimates.planes(&self.stepper, cycle, view)?;
        Ok(self.stepper.publish(ViewEstimate::clone(&planes)))
    }

    /// Whether all tasks are done.
    pub fn is_complete(&self) -> bool {
        self.is_done(Task::Fuse)
    }

    /// Whether a task is done, or needless because a scale ended early.
    pub fn is_done(&self, task: Task) -> bool {
        self.record(task).is_some() || self.is_needless(task)
    }

    /// Does a task, on the threads of the current rayon pool; nothing if it is done or needless. The tasks it
    /// depends on must be done.
    ///
    /// # Errors
    /// A view or cycle that does not exist; a task that it depends on and that is not done; less memory than
    /// the task needs; a file that is damaged or cannot be written; [`Error::Cancelled`].
    pub fn run_task(&self, task: Task, progress: ProgressFn) -> Result<()> {
        self.check_task(task)?;
        if self.is_done(task) {
            return Ok(());
        }
        let Least { view, fusion, .. } = self.shares.least;
        let (bytes, purpose) = match task {
            Task::Next { .. } => (0, ""),
            Task::Fuse => (fusion, "the fusion of a view with those that overlap it"),
            _ => (view, "a view with those whose estimates it reads"),
        };
        self.needs.require(self.shares.least.base + bytes)?;
        require_memory(bytes / ROOM_PARTS * (ROOM_PARTS - 1), purpose)?;
        let (content, files) = match task {
            Task::Search { cycle, view } => self.search(cycle, view, progress)?,
            Task::Check { cycle, view } => self.check(cycle, view, progress)?,
            Task::Next { cycle } => (Content::Next(self.decide_next(cycle)?), Vec::new()),
            Task::Finish { view } => self.finish(view, progress)?,
            Task::Fuse => self.fuse(progress)?,
        };
        let paths: Vec<&Path> = files.iter().map(|path| path.as_path()).collect();
        Record::new(&self.folder, self.run, &paths, content)?.write(&self.folder.record(task))?;
        // Only now: a process that is killed in between must find what it needs to do the task again.
        match task {
            Task::Next { cycle } => self.estimates.remove_before_check(cycle),
            Task::Fuse => self.remove_temporaries(),
            _ => (),
        }
        Ok(())
    }

    fn record(&self, task: Task) -> Option<Record> {
        Record::read(&self.folder, self.run, task)
    }

    fn check_task(&self, task: Task) -> Result<()> {
        let (cycles, views) = (self.stepper.cycles().len(), self.stepper.views());
        let (cycle, view) = match task {
            Task::Search { cycle, view } | Task::Check { cycle, view } => (cycle, view),
            Task::Next { cycle } => (cycle, 0),
            Task::Finish { view } => (0, view),
            Task::Fuse => (0, 0),
        };
        if cycle >= cycles {
            return Err(Error::argument("cycle", cycle, format!("a cycle below their number, {cycles}")));
        }
        if view >= views {
            return Err(Error::argument("view", view, format!("a view below their number, {views}")));
        }
        Ok(())
    }

    /// The cycles that run, as far as that is decided, and whether the last of them is the last of the run.
    fn decided_cycles(&self) -> (Vec<usize>, bool) {
        let mut decided = vec![0];
        loop {
            let last = decided[decided.len() - 1];
            match self.record(Task::Next { cycle: last }).map(|record| record.content) {
                Some(Content::Next(Some(next)))
                    if (last + 1..self.stepper.cycles().len()).contains(&next) =>
                {
                    decided.push(next);
                }
                Some(Content::Next(None)) => return (decided, true),
                _ => return (decided, false),
            }
        }
    }

    /// Whether the task is of a cycle that does not run, or the end of a view that gets no maps.
    fn is_needless(&self, task: Task) -> bool {
        let cycle = match task {
            Task::Search { cycle, .. } | Task::Check { cycle, .. } | Task::Next { cycle } => cycle,
            Task::Finish { view } => return self.references.binary_search(&view).is_err(),
            Task::Fuse => return false,
        };
        let (decided, is_all) = self.decided_cycles();
        !decided.contains(&cycle) && (is_all || decided.last().is_some_and(|&last| cycle < last))
    }

    /// The cycle before one that runs; `None` for the first.
    fn cycle_before(&self, cycle: usize) -> Result<Option<usize>> {
        let (decided, _) = self.decided_cycles();
        match decided.iter().position(|&decided| decided == cycle) {
            Some(0) => Ok(None),
            Some(place) => Ok(Some(decided[place - 1])),
            None => {
                let last = decided[decided.len() - 1];
                let value = format!("{cycle}, before the tasks of cycle {last} are done");
                Err(Error::argument("cycle", value, format!("cycle {last}: search, check and next")))
            }
        }
    }

    fn search(&self, cycle: usize, view: usize, progress: ProgressFn) -> Result<(Content, Vec<PathBuf>)> {
        let before = self.cycle_before(cycle)?;
        let checked = before.map(|before| self.estimates.checked(&self.stepper, before, cycle));
        let checked = checked.as_ref().map(|checked| checked as &dyn CheckedEstimates);
        let found = self.stepper.search_streamed(cycle, view, checked, progress)?;
        Ok((Content::Search, vec![self.estimates.put_searched(found)?]))
    }

    fn check(&self, cycle: usize, view: usize, progress: ProgressFn) -> Result<(Content, Vec<PathBuf>)> {
        self.cycle_before(cycle)?;
        for &other in self.stepper.sources(view).iter().chain(&[view as u32]) {
            if self.record(Task::Search { cycle, view: other as usize }).is_none() {
                let value = format!("{cycle}, before the search of view {other} is done");
                return Err(Error::argument("cycle", value, "a cycle whose views are all searched"));
            }
        }
        let searched = |view| self.estimates.searched(&self.stepper, cycle, view);
        let checked = self.stepper.check_streamed(cycle, view, &searched, progress)?;
        let record = checked.cycles().last().copied();
        let record =
            record.ok_or_else(|| Error::argument("estimate", "one without a cycle", "a searched one"))?;
        Ok((Content::Check(record), self.estimates.put_checked(checked)?))
    }

    fn decide_next(&self, cycle: usize) -> Result<Option<usize>> {
        self.cycle_before(cycle)?;
        let record = |view: usize| match self.record(Task::Check { cycle, view }).map(|record| record.content)
        {
            Some(Content::Check(record)) => Ok(record),
            _ => Err(Error::argument(
                "cycle",
                format!("{cycle}, before the check of view {view} is done"),
                "a cycle whose views are all checked",
            )),
        };
        let records: Vec<CycleRecord> = (0..self.stepper.views()).map(record).collect::<Result<_>>()?;
        self.stepper.next_after(cycle, &records)
    }

    fn finish(&self, view: usize, progress: ProgressFn) -> Result<(Content, Vec<PathBuf>)> {
        let (decided, true) = self.decided_cycles() else {
            return Err(Error::argument(
                "finish",
                "before the last cycle is done",
                "a run whose cycles are done",
            ));
        };
        let last = decided[decided.len() - 1];
        let checked = self.estimates.checked(&self.stepper, last, last);
        let result = self.stepper.finish_streamed(view, &checked, progress)?;
        let own = &self.scene.views()[view];
        let files = self.options.output.write;
        self.workspace.write_view_files(&own.name, &own.camera, &result, &files)?;
        if !files.has_fused_maps() {
            self.workspace.write_fused_maps(&own.name, &own.camera, &result)?;
        }
        let summary = ViewSummary {
            status_counts: result.status_counts(),
            counts: result.counts,
            cycles: result.cycles,
        };
        let mut written = self.workspace.view_files(&own.name, &files);
        written.extend(outputs::temporary_files(&self.workspace, &own.name, &files));
        Ok((Content::Finish(summary), written))
    }

    fn fuse(&self, progress: ProgressFn) -> Result<(Content, Vec<PathBuf>)> {
        for view in 0..self.stepper.views() {
            if !self.is_done(Task::Finish { view }) {
                let value = format!("before view {view} is finished");
                return Err(Error::argument("fuse", value, "a run whose views are all finished"));
            }
        }
        self.estimates.forget();
        let (made, path) = self.fuse_finished(progress)?;
        let views = self.scene.views().iter();
        let scene = CloudScene {
            images: views.map(|view| ModelImage { name: view.name.clone(), camera: view.camera }).collect(),
            photographs: self.workspace.folder().join("images"),
            splat: self.workspace.splat(),
        };
        let files = made.write(&path, &self.options.output, &scene)?;
        Ok((Content::Fuse(made.len()), files))
    }
}
