//! All tasks of a run, in one process.

use super::meter::Meter;
use super::outputs::temporary_files;
use super::task::{Content, Record};
use super::{Job, Task, ViewSummary, plan};
use crate::error::{Error, Result};
use crate::parallel::{JoinedPool, ProgressFn};
use crate::pipeline::thread_count;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a run made.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// By view.
    pub views: Vec<ViewSummary>,
    /// Number of points.
    pub points: usize,
    /// What was damaged and made again, and warnings about the source views, as sentences.
    pub warnings: Vec<String>,
}

/// Units of work, for each pixel, of a check, the end of a view, and the fusion, if a unit of the search (see
/// [`Cycle::work`](crate::Cycle::work)) is [`SEARCH_UNITS`]; by their CPU time on photographs.
const SEARCH_UNITS: u64 = 10;
const CHECK_UNITS: u64 = 7;
const FINISH_UNITS: u64 = 10;
const FUSE_UNITS: u64 = 5;

const NOT_COMPLETE: &str = "no such record: the run is not complete";

impl Job {
    /// Does all tasks that are not done, on a thread pool of its own, and returns what the run made. Files
    /// that were damaged since they were written are made again.
    ///
    /// # Errors
    /// The errors of [`Job::run_task`]. What is done stays done: the same call goes on there.
    pub fn run(&self, progress: ProgressFn) -> Result<Summary> {
        self.run_observed(progress, &|_| Ok(()))
    }

    /// Like [`Job::run`], and calls `after_cycle` with each cycle that was run, when its views are checked:
    /// [`Job::checked`] gives their estimates.
    ///
    /// # Errors
    /// The errors of [`Job::run`]; what `after_cycle` returns.
    pub fn run_observed(
        &self,
        progress: ProgressFn,
        after_cycle: &(dyn Fn(usize) -> Result<()> + Sync),
    ) -> Result<Summary> {
        let mut repaired = Vec::new();
        JoinedPool::new(thread_count(&self.scene, &self.options))?.install(|| {
            repaired = self.repair()?;
            self.run_all(progress, after_cycle)
        })?;
        let mut summary = self.summary()?;
        summary.warnings.extend(repaired);
        Ok(summary)
    }

    /// What a complete run made.
    ///
    /// # Errors
    /// A run that is not complete.
    pub fn summary(&self) -> Result<Summary> {
        let summary = |view| match self.record(Task::Finish { view }).map(|record| record.content) {
            Some(Content::Finish(summary)) => Ok(summary),
            _ => Err(Error::file(self.folder.record(Task::Finish { view }), NOT_COMPLETE)),
        };
        let mut views = vec![ViewSummary::default(); self.stepper.views()];
        self.references.iter().try_for_each(|&view| summary(view).map(|found| views[view] = found))?;
        let points = match self.record(Task::Fuse).map(|record| record.content) {
            Some(Content::Fuse(points)) => points,
            _ => return Err(Error::file(self.folder.record(Task::Fuse), NOT_COMPLETE)),
        };
        Ok(Summary { views, points, warnings: self.stepper.warnings().to_vec() })
    }

    /// Does some tasks that do not depend on each other, a few at a time, on a thread pool of its own.
    ///
    /// # Errors
    /// The errors of [`Job::run_task`]. What is done stays done.
    pub fn run_tasks(&self, tasks: &[Task], progress: ProgressFn) -> Result<()> {
        tasks.iter().try_for_each(|&task| self.check_task(task))?;
        let meter = Meter::new(progress, tasks.len() as u64);
        JoinedPool::new(thread_count(&self.scene, &self.options))?
            .install(|| self.run_counted(tasks.iter().map(|&task| (task, 1)).collect(), &meter))
    }

    fn run_all(
        &self,
        progress: ProgressFn,
        after_cycle: &(dyn Fn(usize) -> Result<()> + Sync),
    ) -> Result<()> {
        let pixels: u64 = self.scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
        let cycles = self.stepper.cycles();
        let checks = |before: usize| -> u64 {
            let checked = |cycle: &crate::pipeline::Cycle| {
                CHECK_UNITS * pixels / u64::from(cycle.scale.downscale).pow(2)
            };
            cycles[..before].iter().map(checked).sum()
        };
        let work_before = |cycle: usize| SEARCH_UNITS * self.stepper.work_before(cycle) + checks(cycle);
        let of_view = |view: usize| self.scene.views()[view].camera.pixels() as u64;
        let finished: u64 = self.references.iter().map(|&view| of_view(view)).sum();
        let total = work_before(cycles.len()) + FINISH_UNITS * finished + FUSE_UNITS * pixels;
        let meter = Meter::new(progress, total);
        loop {
            // Cycles that are decided are done: their estimates may be gone.
            let (decided, is_all) = self.decided_cycles();
            let cycle = decided[decided.len() - 1];
            meter.reach(if is_all { work_before(cycles.len()) } else { work_before(cycle) });
            if is_all {
                break;
            }
            let pixels_of = |view: usize| {
                let (width, height) = self.stepper.size(cycle, view).unwrap_or_default();
                u64::from(width) * u64::from(height)
            };
            let search =
                |view| (Task::Search { cycle, view }, SEARCH_UNITS * cycles[cycle].work(pixels_of(view)));
            self.run_counted((0..self.stepper.views()).map(search).collect(), &meter)?;
            let check = |view| (Task::Check { cycle, view }, CHECK_UNITS * pixels_of(view));
            self.run_counted((0..self.stepper.views()).map(check).collect(), &meter)?;
            after_cycle(cycle)?;
            self.run_task(Task::Next { cycle }, progress)?;
        }
        let finish = |view| (Task::Finish { view }, FINISH_UNITS * of_view(view));
        self.run_counted(self.references.iter().map(|&view| finish(view)).collect(), &meter)?;
        self.run_counted(vec![(Task::Fuse, FUSE_UNITS * pixels)], &meter)?;
        self.remove_temporaries();
        Ok(())
    }

    /// Does some tasks that do not depend on each other, a few at a time, with their units of work.
    fn run_counted(&self, tasks: Vec<(Task, u64)>, meter: &Meter) -> Result<()> {
        let next = AtomicUsize::new(0);
        let run = |_| -> Result<()> {
            while let Some(&(task, units)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                if self.is_done(task) {
                    meter.skip(units);
                } else {
                    let part = meter.task(units);
                    self.run_task(task, &|at| part.report(at))?;
                    part.complete();
                }
            }
            Ok(())
        };
        let lanes = self.shares.tasks.min(tasks.len());
        (0..lanes).into_par_iter().with_max_len(1).try_for_each(run)
    }

    /// Compares the files of tasks that are done with their records. What is damaged is made again: the task
    /// alone where its inputs are still there, else the run begins anew. Returns what was damaged.
    fn repair(&self) -> Result<Vec<String>> {
        let mut warnings = Vec::new();
        let (decided, is_all) = self.decided_cycles();
        let last = decided[decided.len() - 1];
        let views = || 0..self.stepper.views();
        // Once all views are finished no task needs estimates, and after the fusion they are gone.
        let is_finished = self.references.iter().all(|&view| self.record(Task::Finish { view }).is_some());
        let is_complete = is_finished && self.record(Task::Fuse).is_some();
        let before = self.cycle_before(last)?;
        let mut inputs: Vec<Task> = Vec::new();
        let mut current: Vec<Task> = self.references.iter().map(|&view| Task::Finish { view }).collect();
        current.push(Task::Fuse);
        if !is_finished && is_all {
            inputs.extend(views().map(|view| Task::Check { cycle: last, view }));
        } else if !is_finished {
            inputs.extend(
                before.into_iter().flat_map(|cycle| views().map(move |view| Task::Check { cycle, view })),
            );
            current.extend(views().map(|view| Task::Search { cycle: last, view }));
            current.extend(views().map(|view| Task::Check { cycle: last, view }));
        }
        let wanted = self.options.output.write;
        let damaged = |task: &Task| -> Option<(Task, Error)> {
            let may_be_gone = match task {
                Task::Finish { view } if is_complete => {
                    temporary_files(&self.workspace, &self.scene.views()[*view].name, &wanted)
                }
                _ => Vec::new(),
            };
            let record: Option<Record> = self.record(*task);
            record
                .and_then(|record| record.verify(&self.folder, &may_be_gone).err())
                .map(|error| (*task, error))
        };
        let mut begin_anew = false;
        let broken: Vec<_> = current.par_iter().filter_map(damaged).collect();
        // A damaged map is made again from the estimates, if they are still there.
        let is_map_broken = broken.iter().any(|(task, _)| matches!(task, Task::Finish { .. }));
        if is_finished && is_map_broken {
            inputs.extend(views().map(|view| Task::Check { cycle: last, view }));
            begin_anew = !self.folder.estimates().exists();
        }
        // The maps that a cloud is made again from may be gone, too.
        let is_cloud_broken = broken.iter().any(|(task, _)| *task == Task::Fuse);
        begin_anew |= is_complete && is_cloud_broken && !wanted.has_fused_maps();
        for (task, error) in broken {
            warnings.push(format!("{error}; it is made again"));
            let _ = std::fs::remove_file(self.folder.record(task));
        }
        if begin_anew {
            inputs.clear();
        }
        let broken: Vec<_> = inputs.par_iter().filter_map(damaged).collect();
        begin_anew |= !broken.is_empty();
        warnings.extend(broken.iter().map(|(_, error)| format!("{error}; the run begins anew")));
        if begin_anew {
            let manifest = std::fs::read(self.folder.manifest());
            plan::remove_run(&self.folder)?;
            let path = self.folder.manifest();
            let manifest = manifest.map_err(|error| crate::io::cannot_be_read(&path, error))?;
            crate::io::write_file(&path, |out| std::io::Write::write_all(out, &manifest))?;
            self.estimates.remove_all();
        }
        Ok(warnings)
    }
}
