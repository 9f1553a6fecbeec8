//! `skep plan` and the commands that do tasks of a planned run.

use crate::arguments::{FinishViews, NextCycle, Plan, Planned, Views};
use crate::interrupt::Interrupt;
use crate::plan_files::Tasks;
use crate::progress::Display;
use crate::{Failure, plan_files, reconstruct, streams};
use skep::job::{Job, Task};
use skep::{Error, Progress};
use std::ops::Range;

/// `skep plan`: prepares the folder, and prints the tasks or writes them to the files that were asked for.
pub fn plan(arguments: &Plan, interrupt: &Interrupt) -> Result<(), Failure> {
    let run = &arguments.run;
    let job = reconstruct::plan(run, Display::new(&run.messages), interrupt)?;
    let folder = run.output();
    let tasks = Tasks::of(&job, run.files.has_page());
    if let Some(file) = &arguments.openjd {
        plan_files::write_openjd(&tasks, &folder, file)?;
    }
    if let Some(file) = &arguments.slurm {
        plan_files::write_slurm(&tasks, &folder, file)?;
    }
    if !run.messages.are_quiet() && arguments.openjd.is_none() && arguments.slurm.is_none() {
        let lines = plan_files::command_lines(&job, &tasks, &folder.display().to_string());
        lines.iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// `skep search`
pub fn search(arguments: &Views, interrupt: &Interrupt) -> Result<(), Failure> {
    let Views { planned, cycle, views } = arguments;
    of_views(planned, views.as_ref(), interrupt, |view| Task::Search { cycle: *cycle, view })
}

/// `skep check`
pub fn check(arguments: &Views, interrupt: &Interrupt) -> Result<(), Failure> {
    let Views { planned, cycle, views } = arguments;
    of_views(planned, views.as_ref(), interrupt, |view| Task::Check { cycle: *cycle, view })
}

/// `skep finish`
pub fn finish(arguments: &FinishViews, interrupt: &Interrupt) -> Result<(), Failure> {
    of_views(&arguments.planned, arguments.views.as_ref(), interrupt, |view| Task::Finish { view })
}

/// `skep next`
pub fn next(arguments: &NextCycle, interrupt: &Interrupt) -> Result<(), Failure> {
    let planned = &arguments.planned;
    let job = Job::open(&planned.folder, &planned.resources.options())?;
    let display = Display::new(&planned.messages);
    Ok(run(&job, &[Task::Next { cycle: arguments.cycle }], display, interrupt)?)
}

/// Does the tasks of a range of views.
fn of_views(
    planned: &Planned,
    views: Option<&Range<usize>>,
    interrupt: &Interrupt,
    task: impl Fn(usize) -> Task,
) -> Result<(), Failure> {
    let job = Job::open(&planned.folder, &planned.resources.options())?;
    let count = job.scene().views().len();
    let views = views.cloned().unwrap_or(0..count);
    if views.end > count {
        let value = format!("{}..{}", views.start, views.end);
        return Err(Failure::Usage(Error::argument("--views", value, format!("views of 0..{count}"))));
    }
    let tasks: Vec<Task> = views.map(task).collect();
    Ok(run(&job, &tasks, Display::new(&planned.messages), interrupt)?)
}

/// Does tasks; displays the progress, and ends early when interrupted.
pub fn run(job: &Job, tasks: &[Task], display: Display, interrupt: &Interrupt) -> skep::Result<()> {
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
