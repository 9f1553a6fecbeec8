//! `skep plan` and the commands that do tasks of a planned run.

use crate::arguments::{FinishViews, NextCycle, Plan, Planned, Views};
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::reconstruct;
use crate::{Failure, streams};
use skep::job::{Job, Task};
use skep::{Error, Progress};
use std::ops::Range;

/// Views of a task in the list of `skep plan`.
const VIEWS_PER_TASK: usize = 16;

/// `skep plan`: prepares the folder and prints the tasks.
pub fn plan(arguments: &Plan) -> Result<(), Failure> {
    let run = &arguments.run;
    let job = reconstruct::plan(run, Display::new(run.quiet))?;
    if !run.quiet {
        task_list(&job, &run.output().display().to_string()).iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// The commands of all tasks, with what each range of views reads.
fn task_list(job: &Job, folder: &str) -> Vec<String> {
    let views = job.scene().views().len();
    let ranges = || (0..views).step_by(VIEWS_PER_TASK).map(|start| start..views.min(start + VIEWS_PER_TASK));
    let text = |range: &Range<usize>| format!("{}..{}", range.start, range.end);
    let mut lines = vec!["# views read, besides their own, by the tasks of a range of views".to_owned()];
    for range in ranges() {
        let mut read: Vec<usize> = range.clone().flat_map(|view| job.views_read_by(view)).collect();
        read.sort_unstable();
        read.dedup();
        read.retain(|view| !range.contains(view));
        let read: Vec<String> = read.iter().map(usize::to_string).collect();
        lines.push(format!("# {}: {}", text(&range), read.join(" ")));
    }
    for cycle in 0..job.stepper().cycles().len() {
        for command in ["search", "check"] {
            let of_range =
                |range| format!("skep {command} {folder} --cycle {cycle} --views {}", text(&range));
            lines.extend(ranges().map(of_range));
        }
        lines.push(format!("skep next {folder} --cycle {cycle}"));
    }
    lines.extend(ranges().map(|range| format!("skep finish {folder} --views {}", text(&range))));
    lines.push(format!("skep fuse {folder}"));
    lines
}

/// `skep search`
pub fn search(arguments: &Views) -> Result<(), Failure> {
    let Views { planned, cycle, views } = arguments;
    of_views(planned, views.as_ref(), |view| Task::Search { cycle: *cycle, view })
}

/// `skep check`
pub fn check(arguments: &Views) -> Result<(), Failure> {
    let Views { planned, cycle, views } = arguments;
    of_views(planned, views.as_ref(), |view| Task::Check { cycle: *cycle, view })
}

/// `skep finish`
pub fn finish(arguments: &FinishViews) -> Result<(), Failure> {
    of_views(&arguments.planned, arguments.views.as_ref(), |view| Task::Finish { view })
}

/// `skep next`
pub fn next(arguments: &NextCycle) -> Result<(), Failure> {
    let planned = &arguments.planned;
    let job = Job::open(&planned.folder, &planned.options())?;
    Ok(run(&job, &[Task::Next { cycle: arguments.cycle }], Display::new(planned.quiet))?)
}

/// Does the tasks of a range of views.
fn of_views(
    planned: &Planned,
    views: Option<&Range<usize>>,
    task: impl Fn(usize) -> Task,
) -> Result<(), Failure> {
    let job = Job::open(&planned.folder, &planned.options())?;
    let count = job.scene().views().len();
    let views = views.cloned().unwrap_or(0..count);
    if views.end > count {
        let value = format!("{}..{}", views.start, views.end);
        return Err(Failure::Usage(Error::argument("--views", value, format!("views of 0..{count}"))));
    }
    let tasks: Vec<Task> = views.map(task).collect();
    Ok(run(&job, &tasks, Display::new(planned.quiet))?)
}

/// Does tasks; displays the progress, and ends early when interrupted.
pub fn run(job: &Job, tasks: &[Task], display: Display) -> skep::Result<()> {
    let interrupt = Interrupt::watch();
    let reporter = display.start();
    let progress = |progress: &Progress| {
        reporter.show(progress);
        interrupt.control_flow()
    };
    job.run_tasks(tasks, &progress).inspect_err(|error| {
        if *error == Error::Cancelled {
            streams::notice(
                "interrupted: the tasks that are done are kept; repeat the command for the others",
            );
        }
    })
}
