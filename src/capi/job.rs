//! Runs in a folder, in C.

use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, give_text, out, path, wanted_one};
use super::progress::{Host, skep_progress_fn};
use super::scene::no_view;
use super::status::{Failure, guard, skep_status};
use crate::geometry::DepthRange;
use crate::job::{Job, Task};
use std::ffi::{c_char, c_void};

/// A run in a folder: it keeps to a budget of memory, goes on after an interruption, and can be divided among
/// processes and machines that share the folder. Immutable.
///
/// A run is a set of tasks. skep_job_run does all of them; a host with a scheduler of its own calls
/// skep_job_run_task in this order, those of a line at the same time if it likes, each process with a job
/// that skep_job_open gave:
///
///   for each cycle, from 0:  SKEP_TASK_SEARCH of every view
///                            SKEP_TASK_CHECK of every view
///                            SKEP_TASK_NEXT
///   then                     SKEP_TASK_FINISH of every view
///                            SKEP_TASK_FUSE
///
/// A task that is done, or of a cycle that the run skips, succeeds at once. The results are files in the
/// folder, which is a COLMAP workspace: stereo/, preview/, fused.ply. The options of the group "output"
/// choose among them.
pub struct skep_job {
    job: Job,
}

/// Task: search the planes of a view in a cycle.
pub const SKEP_TASK_SEARCH: u32 = 0;
/// Task: check the planes of a view in a cycle, after all views were searched.
pub const SKEP_TASK_CHECK: u32 = 1;
/// Task: decide which cycle follows, after all views were checked.
pub const SKEP_TASK_NEXT: u32 = 2;
/// Task: write the maps of a view, after the last cycle.
pub const SKEP_TASK_FINISH: u32 = 3;
/// Task: fuse the maps, after all views are finished.
pub const SKEP_TASK_FUSE: u32 = 4;

/// What a run needs, estimated before it starts.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_job_needs {
    /// The least memory in bytes with which the run works.
    pub least_memory: u64,
    /// The memory in bytes that the run keeps to.
    pub memory: u64,
    /// Bytes on disk, at most at any time.
    pub disk: u64,
    /// CPU seconds of all threads together, within a factor of about two.
    pub cpu_seconds: f64,
}

/// Plans the run of a scene in files in a folder, which is created. A run of the same photographs, model,
/// options and version that began there goes on; anything else begins anew, and skep_job_get_notice tells
/// why. The options "threads", "memory" and "simd" may change. No other process can work on the run while the
/// job exists.
///
/// @param scene            Path of the folder with images/ and a COLMAP model in sparse/ or sparse/0/, or of
///                         a scene of another program, whose formats docs/formats.md lists.
/// @param near             Smallest depth of every view in world units; 0 with `far` 0 derives the ranges.
/// @param far              Largest depth of every view in world units.
/// @param options_or_null  The options, copied; NULL: the default preset.
/// @param folder           Path of the folder of the run.
/// @param fresh            Non-zero begins anew in any case.
/// @param progress_or_null  Receives the progress of reading the photographs and may cancel; NULL: none.
/// @param user             Passed to the callback; may be NULL.
/// @param job_out          Receives the job; destroy it with skep_job_destroy.
/// @retval SKEP_ERR_ARGUMENT  Options or depths out of range, less memory than the run needs, or a scene that
///                            skep_scene_validate refuses.
/// @retval SKEP_ERR_FILE      A file that is missing or damaged; a folder that cannot be written, holds
///                            another scene, or in which another process works.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero; an earlier run in the folder is as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_plan(
    scene: *const c_char,
    near: f64,
    far: f64,
    options_or_null: *const skep_options,
    folder: *const c_char,
    fresh: i32,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    job_out: *mut *mut skep_job,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, options, folder, out) = unsafe {
            (
                path(scene, "scene")?,
                options_or_default(options_or_null)?,
                path(folder, "folder")?,
                out(job_out, "job_out")?,
            )
        };
        let range = (near != 0.0 || far != 0.0).then_some(DepthRange { near, far });
        if let Some(range) = range {
            range.check("depth range")?;
        }
        let host = Host::new(progress_or_null, user);
        let job = Job::plan(scene, range, &options, folder, fresh != 0, &|at| host.tell(at))?;
        out.give(skep_job { job });
        Ok(())
    })
}

/// Opens a run that was planned, to do some of its tasks; other processes may do others at the same time.
///
/// @param folder           Path of the folder of the run.
/// @param options_or_null  Options "threads", "memory" and "simd"; the others are those the run was planned
///                         with. NULL: the default preset.
/// @param job_out          Receives the job; destroy it with skep_job_destroy.
/// @retval SKEP_ERR_ARGUMENT  Less memory than the run needs.
/// @retval SKEP_ERR_FILE      No run of this version; a model that changed; another process that plans or
///                            does the whole run.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_open(
    folder: *const c_char,
    options_or_null: *const skep_options,
    job_out: *mut *mut skep_job,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (folder, options, out) = unsafe {
            (path(folder, "folder")?, options_or_default(options_or_null)?, out(job_out, "job_out")?)
        };
        out.give(skep_job { job: Job::open(folder, &options)? });
        Ok(())
    })
}

/// Destroys a job and unlocks its folder; what is done stays there.
///
/// @param job  The job; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_destroy(job: *mut skep_job) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(job) };
        Ok(())
    });
}

/// Gets the number of cycles of the schedule, and of views.
///
/// @param job              The job.
/// @param cycle_count_out  Receives the number of cycles on all scales; may be NULL.
/// @param view_count_out   Receives the number of views; may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_get_count(
    job: *const skep_job,
    cycle_count_out: *mut u32,
    view_count_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let stepper = unsafe { get(job, "job") }?.job.stepper();
        // SAFETY: as the header demands of the caller.
        let (cycle_count, view_count) = unsafe {
            (wanted_one(cycle_count_out, "cycle_count_out")?, wanted_one(view_count_out, "view_count_out")?)
        };
        cycle_count.into_iter().for_each(|out| out.set(stepper.cycles().len() as u32));
        view_count.into_iter().for_each(|out| out.set(stepper.views() as u32));
        Ok(())
    })
}

/// Gets what the run needs.
///
/// @param job        The job.
/// @param needs_out  Receives memory, disk and time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_get_needs(
    job: *const skep_job,
    needs_out: *mut skep_job_needs,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (job, out) = unsafe { (get(job, "job")?, out(needs_out, "needs_out")?) };
        let needs = job.job.needs();
        out.set(skep_job_needs {
            least_memory: needs.least_memory,
            memory: needs.memory,
            disk: needs.disk,
            cpu_seconds: needs.cpu_seconds,
        });
        Ok(())
    })
}

/// Copies a notice on what became of an earlier run in the folder, or a warning about the scene.
///
/// @param job         The job.
/// @param index       Number of the notice, from 0.
/// @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity    Bytes of room in `buffer`; a longer text is cut.
/// @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  No such notice.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_get_notice(
    job: *const skep_job,
    index: usize,
    buffer: *mut c_char,
    capacity: usize,
    needed_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let job = &unsafe { get(job, "job") }?.job;
        let all: Vec<&String> =
            job.notices().iter().chain(job.scene().warnings()).chain(job.stepper().warnings()).collect();
        let Some(text) = all.get(index) else {
            let expected = format!("a number below that of the notices, {}", all.len());
            return Err(Failure::argument("index", index, expected));
        };
        // SAFETY: as the header demands of the caller.
        unsafe { give_text(text, buffer, capacity, needed_out) }
    })
}

/// Gets the views whose files the tasks of a view read, ascending: its own, its sources, and those whose
/// source it is. A scheduler places tasks by them.
///
/// @param job        The job.
/// @param view       Number of the view.
/// @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity   Elements of room in `views`; at most the number of views is needed.
/// @param count_out  Receives the number of views.
/// @retval SKEP_ERR_ARGUMENT  No such view.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_get_views_read(
    job: *const skep_job,
    view: u32,
    views: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let job = &unsafe { get(job, "job") }?.job;
        if view as usize >= job.stepper().views() {
            return Err(no_view(view, job.stepper().views()));
        }
        let read: Vec<u32> = job.views_read_by(view as usize).into_iter().map(|view| view as u32).collect();
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&read, views, capacity, count_out, ("views", "count_out")) }
    })
}

/// Does all tasks that are not done. Files that were damaged since they were written are made again.
///
/// @param job               The job.
/// @param progress_or_null  Receives the progress and may cancel; NULL: none.
/// @param user              Passed to the callback; may be NULL.
/// @param point_count_out   Receives the number of points; may be NULL.
/// @retval SKEP_ERR_FILE       A file that cannot be read or written; what is done stays done, as in every
///                             other case.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero; the same call goes on from there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_run(
    job: *const skep_job,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    point_count_out: *mut u64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (job, count) = unsafe { (get(job, "job")?, wanted_one(point_count_out, "point_count_out")?) };
        let host = Host::new(progress_or_null, user);
        let summary = job.job.run(&|at| host.tell(at))?;
        count.into_iter().for_each(|out| out.set(summary.points as u64));
        Ok(())
    })
}

/// Does a task; nothing if it is done or needless. The tasks it depends on must be done. Several tasks may be
/// done at the same time, by threads, processes or machines.
///
/// @param job               The job.
/// @param task              A SKEP_TASK_ value.
/// @param cycle             Number of the cycle; ignored by SKEP_TASK_FINISH and SKEP_TASK_FUSE.
/// @param view              Number of the view; ignored by SKEP_TASK_NEXT and SKEP_TASK_FUSE.
/// @param progress_or_null  Receives the progress and may cancel; NULL: none.
/// @param user              Passed to the callback; may be NULL.
/// @retval SKEP_ERR_ARGUMENT   No such task, cycle or view; a task it depends on is not done.
/// @retval SKEP_ERR_FILE       A file that is damaged, or cannot be written.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_run_task(
    job: *const skep_job,
    task: u32,
    cycle: u32,
    view: u32,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let job = unsafe { get(job, "job") }?;
        let task = task_of(task, cycle, view)?;
        let host = Host::new(progress_or_null, user);
        Ok(job.job.run_tasks(&[task], &|at| host.tell(at))?)
    })
}

/// Gets whether a task is done, or needless because a scale ended early.
///
/// @param job       The job.
/// @param task      A SKEP_TASK_ value.
/// @param cycle     Number of the cycle; ignored by SKEP_TASK_FINISH and SKEP_TASK_FUSE.
/// @param view      Number of the view; ignored by SKEP_TASK_NEXT and SKEP_TASK_FUSE.
/// @param done_out  Receives 1 or 0.
/// @retval SKEP_ERR_ARGUMENT  No such task.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_job_is_done(
    job: *const skep_job,
    task: u32,
    cycle: u32,
    view: u32,
    done_out: *mut i32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (job, out) = unsafe { (get(job, "job")?, out(done_out, "done_out")?) };
        out.set(i32::from(job.job.is_done(task_of(task, cycle, view)?)));
        Ok(())
    })
}

fn task_of(task: u32, cycle: u32, view: u32) -> Result<Task, Failure> {
    let (cycle, view) = (cycle as usize, view as usize);
    match task {
        SKEP_TASK_SEARCH => Ok(Task::Search { cycle, view }),
        SKEP_TASK_CHECK => Ok(Task::Check { cycle, view }),
        SKEP_TASK_NEXT => Ok(Task::Next { cycle }),
        SKEP_TASK_FINISH => Ok(Task::Finish { view }),
        SKEP_TASK_FUSE => Ok(Task::Fuse),
        _ => Err(Failure::argument("task", task, "a SKEP_TASK_ value, 0 to 4")),
    }
}
