//! The tasks of a planned run in the forms that schedulers read: Open Job Description and Slurm.

use serde_json::{Value, json};
use skep::Result;
use skep::io::write_file;
use skep::job::Job;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Views of a task, in runs whose steps have no more than [`MOST_TASKS`] of them.
const VIEWS_PER_TASK: usize = 16;
/// Tasks of a step, at most: Slurm's arrays have up to 1001 by default, ranges of Open Job Description 1024.
const MOST_TASKS: usize = 1000;
/// The script for Slurm, without what is of the run.
const SLURM_SCRIPT: &str = include_str!("slurm.sh");

/// The steps of a run in order; each depends on the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Search(usize),
    Check(usize),
    Next(usize),
    Finish,
    Fuse,
}

impl Step {
    fn all(cycles: usize) -> Vec<Step> {
        let of_cycle = |cycle| [Step::Search(cycle), Step::Check(cycle), Step::Next(cycle)];
        (0..cycles).flat_map(of_cycle).chain([Step::Finish, Step::Fuse]).collect()
    }

    fn name(self) -> String {
        match self {
            Step::Search(cycle) => format!("Search{cycle:02}"),
            Step::Check(cycle) => format!("Check{cycle:02}"),
            Step::Next(cycle) => format!("Next{cycle:02}"),
            Step::Finish => "Finish".to_owned(),
            Step::Fuse => "Fuse".to_owned(),
        }
    }

    /// The arguments of the program besides the folder.
    fn command(self) -> (&'static str, Option<usize>) {
        match self {
            Step::Search(cycle) => ("search", Some(cycle)),
            Step::Check(cycle) => ("check", Some(cycle)),
            Step::Next(cycle) => ("next", Some(cycle)),
            Step::Finish => ("finish", None),
            Step::Fuse => ("fuse", None),
        }
    }

    /// Whether it has a task for each range of views.
    fn is_of_views(self) -> bool {
        matches!(self, Step::Search(_) | Step::Check(_) | Step::Finish)
    }
}

/// The tasks of a run.
#[derive(Debug, Clone, Copy)]
pub struct Tasks {
    views: usize,
    cycles: usize,
    /// Whether the last task writes the page.
    has_page: bool,
}

impl Tasks {
    /// Those of a planned run.
    pub fn of(job: &Job, has_page: bool) -> Tasks {
        Tasks { views: job.stepper().views(), cycles: job.stepper().cycles().len(), has_page }
    }

    /// Arguments of a step besides the folder, the cycle and the views.
    fn more_arguments(self, step: Step) -> &'static [&'static str] {
        if step == Step::Fuse && !self.has_page { &["--no-report"] } else { &[] }
    }
}

/// Views of a task.
fn views_per_task(views: usize) -> usize {
    VIEWS_PER_TASK.max(views.div_ceil(MOST_TASKS))
}

/// The ranges of views that tasks do.
fn ranges(views: usize) -> impl Iterator<Item = Range<usize>> {
    let step = views_per_task(views);
    (0..views).step_by(step).map(move |start| start..views.min(start + step))
}

fn text(range: &Range<usize>) -> String {
    format!("{}..{}", range.start, range.end)
}

/// The commands of all tasks, with what each range of views reads.
pub fn command_lines(job: &Job, tasks: &Tasks, folder: &str) -> Vec<String> {
    let views = tasks.views;
    let mut lines = vec!["# views read, besides their own, by the tasks of a range of views".to_owned()];
    for range in ranges(views) {
        let mut read: Vec<usize> = range.clone().flat_map(|view| job.views_read_by(view)).collect();
        read.sort_unstable();
        read.dedup();
        read.retain(|view| !range.contains(view));
        let read: Vec<String> = read.iter().map(usize::to_string).collect();
        lines.push(format!("# {}: {}", text(&range), read.join(" ")));
    }
    for step in Step::all(tasks.cycles) {
        let (command, cycle) = step.command();
        let cycle = cycle.map(|cycle| format!(" --cycle {cycle}")).unwrap_or_default();
        if step.is_of_views() {
            let line = |range| format!("skep {command} {folder}{cycle} --views {}", text(&range));
            lines.extend(ranges(views).map(line));
        } else {
            let more: String = tasks.more_arguments(step).iter().map(|word| format!(" {word}")).collect();
            lines.push(format!("skep {command} {folder}{cycle}{more}"));
        }
    }
    lines
}

/// Writes a template of Open Job Description.
///
/// # Errors
/// A file that cannot be written.
pub fn write_openjd(tasks: &Tasks, folder: &Path, file: &Path) -> Result<()> {
    let template = openjd_template(tasks, default_folder(folder, file).as_deref());
    write_file(file, |out| {
        serde_json::to_writer_pretty(&mut *out, &template)?;
        out.write_all(b"\n")
    })
}

/// The folder of a run as seen from the template's file: defaults of paths must lie beside or below it.
fn default_folder(folder: &Path, file: &Path) -> Option<String> {
    let beside = match file.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let (folder, beside) = (folder.canonicalize().ok()?, beside.canonicalize().ok()?);
    let relative = folder.strip_prefix(beside).ok()?.to_str()?.to_owned();
    Some(if relative.is_empty() { ".".to_owned() } else { relative })
}

fn openjd_template(tasks: &Tasks, default_folder: Option<&str>) -> Value {
    let mut folder = json!({
        "name": "Run", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "INOUT",
        "description": "Folder of the run, as planned by `skep plan`",
    });
    if let Some(default) = default_folder {
        folder["default"] = default.into();
    }
    let steps = Step::all(tasks.cycles);
    let before = std::iter::once(None).chain(steps.iter().copied().map(Some));
    let steps: Vec<Value> =
        steps.iter().zip(before).map(|(&step, before)| openjd_step(tasks, step, before)).collect();
    json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": "skep",
        "parameterDefinitions": [
            folder,
            {
                "name": "Skep", "type": "STRING", "default": "skep",
                "description": "The program, with its path where it is not in PATH",
            },
            {
                "name": "Threads", "type": "INT", "default": 0, "minValue": 0,
                "description": "Worker threads of a task of views; 0 uses one for each core",
            },
        ],
        "steps": steps,
    })
}

fn openjd_step(tasks: &Tasks, step: Step, before: Option<Step>) -> Value {
    let (command, cycle) = step.command();
    let mut arguments = vec![command.to_owned(), "{{Param.Run}}".to_owned(), "--quiet".to_owned()];
    if let Some(cycle) = cycle {
        arguments.extend(["--cycle".to_owned(), cycle.to_string()]);
    }
    if step.is_of_views() {
        arguments
            .extend(["--views", "{{Task.Param.Views}}", "--threads", "{{Param.Threads}}"].map(String::from));
    }
    arguments.extend(tasks.more_arguments(step).iter().map(|&word| word.to_owned()));
    let action = json!({ "onRun": { "command": "{{Param.Skep}}", "args": arguments } });
    let mut template = json!({ "name": step.name(), "script": { "actions": action } });
    if step.is_of_views() {
        let range: Vec<String> = ranges(tasks.views).map(|range| text(&range)).collect();
        let parameter = json!({ "name": "Views", "type": "STRING", "range": range });
        template["parameterSpace"] = json!({ "taskParameterDefinitions": [parameter] });
    }
    if let Some(before) = before {
        template["dependencies"] = json!([{ "dependsOn": before.name() }]);
    }
    template
}

/// Writes a script that submits the run to Slurm.
///
/// # Errors
/// A file that cannot be written.
pub fn write_slurm(tasks: &Tasks, folder: &Path, file: &Path) -> Result<()> {
    // Tasks start in other folders than the script is submitted from.
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let script = slurm_script(tasks, &folder.to_string_lossy());
    write_file(file, |out| out.write_all(script.as_bytes()))
}

fn slurm_script(tasks: &Tasks, folder: &str) -> String {
    let Tasks { views, cycles, .. } = *tasks;
    let last = tasks.more_arguments(Step::Fuse).join(" ");
    // The folder last: it may contain anything.
    SLURM_SCRIPT
        .replace("@VIEWS@", &views.to_string())
        .replace("@VIEWS_PER_TASK@", &views_per_task(views).to_string())
        .replace("@CYCLES@", &cycles.to_string())
        .replace("@FUSE@", &last)
        .replace("@RUN@", &format!("'{}'", folder.replace('\'', r"'\''")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TASKS: Tasks = Tasks { views: 20, cycles: 2, has_page: true };

    #[test]
    fn ranges_cover_all_views_and_are_no_more_than_schedulers_take() {
        for views in [1, 15, 16, 17, 16_000, 16_001, 100_003] {
            let found: Vec<Range<usize>> = ranges(views).collect();
            assert!(found.len() <= MOST_TASKS, "{views}");
            assert_eq!((found[0].start, found[found.len() - 1].end), (0, views));
            assert!(found.windows(2).all(|pair| pair[0].end == pair[1].start), "{views}");
        }
    }

    #[test]
    fn every_step_of_a_template_depends_on_the_one_before() {
        let template = openjd_template(&TASKS, None);
        let steps = template["steps"].as_array().expect("steps");
        let names: Vec<&str> = steps.iter().map(|step| step["name"].as_str().unwrap_or_default()).collect();
        let expected = ["Search00", "Check00", "Next00", "Search01", "Check01", "Next01", "Finish", "Fuse"];
        assert_eq!(names, expected);
        assert!(steps[0].get("dependencies").is_none());
        for (step, before) in steps[1..].iter().zip(&names) {
            assert_eq!(step["dependencies"], json!([{ "dependsOn": before }]));
        }
        let views = &steps[6]["parameterSpace"]["taskParameterDefinitions"][0]["range"];
        assert_eq!(*views, json!(["0..16", "16..20"]));
        assert!(template["parameterDefinitions"][0].get("default").is_none());
    }

    #[test]
    fn the_last_task_of_a_run_without_a_page_makes_none() {
        let tasks = Tasks { has_page: false, ..TASKS };
        assert!(slurm_script(&tasks, "run").contains("\nfuse=(--no-report)\n"));
        let steps = openjd_template(&tasks, None)["steps"].clone();
        let last = steps.as_array().and_then(|steps| steps.last()).expect("steps");
        let expected = json!(["fuse", "{{Param.Run}}", "--quiet", "--no-report"]);
        assert_eq!(last["script"]["actions"]["onRun"]["args"], expected);
    }

    #[test]
    fn a_folder_with_any_name_is_quoted_in_a_script() {
        let script = slurm_script(&TASKS, "/a b/it's");
        assert!(
            script.contains("\nrun='/a b/it'\\''s'\nviews=20\nviews_per_task=16\ncycles=2\nfuse=()\n"),
            "{script}"
        );
        assert!(!script.contains("=@"), "{script}");
    }
}
