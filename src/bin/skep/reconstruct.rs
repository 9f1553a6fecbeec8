//! `skep reconstruct`: maps, previews, cloud and reports of a scene folder.

use crate::arguments::Reconstruct;
use crate::details::details;
use crate::few_points::Outcome;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::report::{self, PAGE_NAME, PageOptions, Report, RunFiles, Totals};
use crate::run_arguments::Run;
use crate::stopwatch::{Stage, Stopwatch};
use crate::streams::LogLevel;
use crate::{Failure, dump, streams};
use skep::job::{Job, Needs, Summary};
use skep::{DepthRange, Error, PixelStatus, Progress, Result, format_bytes};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Runs the command.
pub fn run(arguments: &Reconstruct, interrupt: &Interrupt) -> std::result::Result<(), Failure> {
    let run = &arguments.run;
    let stopwatch = Mutex::new(Stopwatch::start());
    let display = Display::new(&run.messages);
    let job = plan(run, display, interrupt)?;
    if let Some(folder) = &arguments.dump {
        require_writable(folder)?;
    }
    let output = run.output();
    // A report says that the files beside it are complete and of this run.
    let report = report_path(&output);
    if job.is_complete() && report.is_file() {
        display.print("the run was complete before: its files are compared with what it wrote");
    } else {
        for file in [report, output.join(PAGE_NAME)] {
            remove(&file)?;
        }
    }
    let result = with_progress(&job, arguments, display, &stopwatch, interrupt).inspect_err(|error| {
        if *error == Error::Cancelled {
            streams::notice("interrupted: what is done is kept, and the same command goes on from there");
        }
    })?;
    result.warnings.iter().for_each(|warning| streams::warning(warning));

    let mut stopwatch = stopwatch.into_inner().unwrap_or_else(PoisonError::into_inner);
    stopwatch.enter(Stage::Writing);
    let conclusion = Conclusion {
        stopwatch: Some(stopwatch),
        has_page: run.files.has_page(),
        dump: arguments.dump.as_deref(),
        quiet: run.messages.are_quiet(),
    };
    conclude(&job, &result, conclusion, interrupt)
}

fn remove(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::file(file, format!("cannot be replaced: {error}")))
        }
        _ => Ok(()),
    }
}

/// How a run is concluded.
pub struct Conclusion<'a> {
    /// What measured the whole run; `None` where several processes did it.
    pub stopwatch: Option<Stopwatch>,
    /// Whether the page is written.
    pub has_page: bool,
    /// The folder with the pictures of every cycle.
    pub dump: Option<&'a Path>,
    pub quiet: bool,
}

/// Writes the reports of a complete run, and says what the run made.
pub fn conclude(
    job: &Job,
    result: &Summary,
    conclusion: Conclusion,
    interrupt: &Interrupt,
) -> std::result::Result<(), Failure> {
    let Conclusion { stopwatch, has_page, dump, quiet } = conclusion;
    let mut report = Report::new(job, result);
    let warning = Outcome::of_run(job, &report.totals).warning();
    report.warnings.extend(warning.clone());
    let output = job.workspace().folder();
    // Reports that are there are of the process that did the work, with its times.
    let is_reported = report_path(output).is_file();
    let page_path = output.join(PAGE_NAME);
    if !is_reported {
        // One of the run before it was complete.
        remove(&page_path)?;
    }
    let page = match has_page && !page_path.is_file() {
        true => {
            let files = match is_reported {
                true => RunFiles::find(output)?,
                false => RunFiles::of_run(output, report.to_value())?,
            };
            let options = PageOptions {
                threads: skep::thread_count(job.scene(), job.options()),
                memory: job.needs().memory,
                dump: dump.map(Path::to_owned),
                goes_on: &|| interrupt.control_flow().is_continue(),
            };
            let page = report::make(&files, &options).inspect_err(|error| {
                if *error == Error::Cancelled {
                    streams::notice(
                        "interrupted: maps and cloud are done; the same command writes the reports",
                    );
                }
            })?;
            Some((page, files))
        }
        false => None,
    };
    if let Some(mut stopwatch) = stopwatch {
        report.set_times(stopwatch.times());
    }
    if let Some((page, files)) = &page {
        let figures = if is_reported { files.report.clone() } else { report.to_value() };
        report::write(page, files, &figures)?;
    }
    if !is_reported {
        report.write(&report_path(output))?;
    }
    warning.iter().for_each(|warning| streams::warning(warning));
    if !quiet {
        summary(job, &report.totals).iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// Plans the run, and says what became of an earlier one and what this one needs.
pub fn plan(run: &Run, display: Display, interrupt: &Interrupt) -> std::result::Result<Job, Failure> {
    let depth_range = run.depth_range().map_err(Failure::Usage)?;
    let options = run.options().map_err(Failure::Usage)?;
    options.check().map_err(Failure::Usage)?;
    run.check_masks(&options).map_err(Failure::Usage)?;
    display.print(&format!("reading {}", run.scene.display()));
    let reporter = display.start();
    let progress = |progress: &Progress| {
        reporter.show(progress);
        interrupt.control_flow()
    };
    let output = run.output();
    foreign_results(&output).iter().for_each(|warning| streams::warning(warning));
    let job =
        Job::plan(&run.scene, depth_range, &options, &output, run.fresh, &progress).inspect_err(|error| {
            if *error == Error::Cancelled {
                streams::notice("interrupted while reading: nothing was changed");
            }
        })?;
    drop(reporter);
    job.notices().iter().for_each(|notice| streams::warning(notice));
    job.scene().warnings().iter().for_each(|warning| streams::warning(warning));
    depth_range.and_then(|range| misplaced(&job, range)).iter().for_each(|warning| streams::warning(warning));
    if streams::is_shown(LogLevel::Debug) {
        details(&job).iter().for_each(|line| display.print(line));
    }
    display.print(&needs(&job));
    let threads = skep::thread_count(job.scene(), &options);
    fewer_threads(options.threads, threads).iter().for_each(|line| display.print(line));
    Ok(job)
}

/// Names the results in a folder that no run of skep left there; files of the same names are replaced.
fn foreign_results(output: &Path) -> Option<String> {
    let is_own = output.join("run").is_dir() || output.join("report.json").is_file();
    let has_maps =
        |folder: &Path| std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    let mut found = Vec::new();
    found.extend(output.join("fused.ply").is_file().then_some("fused.ply"));
    found.extend(has_maps(&output.join("stereo").join("depth_maps")).then_some("stereo"));
    (!is_own && !found.is_empty()).then(|| {
        format!(
            "{} has results of another program ({}), of which those of the same names are replaced; \
             --output DIR takes another folder",
            output.display(),
            found.join(", ")
        )
    })
}

/// Fraction of the depths of sparse points that a depth range for all views should have, at least.
const LEAST_INSIDE: f64 = 0.1;

/// A warning of a depth range that has hardly any of the sparse points.
fn misplaced(job: &Job, range: DepthRange) -> Option<String> {
    let scene = job.scene();
    let (mut all, mut inside, mut near, mut far) = (0_u64, 0_u64, f64::INFINITY, 0.0_f64);
    for point in scene.points() {
        for &view in &point.views {
            let depth = scene.views()[view as usize].camera.to_camera(point.position).z;
            all += 1;
            inside += u64::from(range.near <= depth && depth <= range.far);
            (near, far) = (near.min(depth), far.max(depth));
        }
    }
    ((inside as f64) < LEAST_INSIDE * all as f64).then(|| {
        format!(
            "{inside} of {all} depths of the sparse points lie in --depth-range {} {}; they lie from \
             {near:.4} to {far:.4}: what is found elsewhere may be no surface",
            range.near, range.far
        )
    })
}

/// What the run needs, in a line.
fn needs(job: &Job) -> String {
    let Needs { least_memory, expected_memory, memory, disk, cpu_seconds } = job.needs();
    let threads = skep::thread_count(job.scene(), job.options());
    let seconds = cpu_seconds / threads as f64;
    let time = match seconds {
        ..100.0 => format!("{seconds:.0} s"),
        ..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    };
    format!(
        "{} views; about {time} on {threads} threads, {} of memory (limit {}, --memory; it works with {}) \
         and {} on disk",
        job.scene().views().len(),
        format_bytes(expected_memory),
        format_bytes(memory),
        format_bytes(least_memory),
        format_bytes(disk)
    )
}

/// Does the run; measures the times, displays the progress, and ends early when interrupted.
fn with_progress(
    job: &Job,
    arguments: &Reconstruct,
    display: Display,
    stopwatch: &Mutex<Stopwatch>,
    interrupt: &Interrupt,
) -> Result<Summary> {
    let reporter = display.start();
    let progress = |progress: &Progress| {
        stopwatch.lock().unwrap_or_else(PoisonError::into_inner).enter(progress.phase.into());
        reporter.show(progress);
        interrupt.control_flow()
    };
    match &arguments.dump {
        Some(folder) => job.run_observed(&progress, &|cycle| dump::write(job, cycle, folder)),
        None => job.run(&progress),
    }
}

/// Checks that pictures can be written before the run, which may take hours.
fn require_writable(folder: &Path) -> Result<()> {
    let attempt = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
    attempt.map(drop).map_err(|error| Error::file(folder, format!("cannot be written to: {error}")))
}

/// What is said of threads that are not started, if any.
fn fewer_threads(wanted: usize, threads: usize) -> Option<String> {
    (threads < wanted).then(|| {
        format!(
            "{threads} threads instead of {wanted}: more would wait for a core, or for work in these images"
        )
    })
}

fn report_path(output: &Path) -> PathBuf {
    output.join("report.json")
}

/// The last lines: the written files and, if the cloud is empty or thin, the reasons.
fn summary(job: &Job, totals: &Totals) -> Vec<String> {
    let (workspace, scene, written) = (job.workspace(), job.scene(), job.options().output);
    let (output, references, views) = (workspace.folder(), job.references(), scene.views().len());
    let outcome = Outcome::of_run(job, totals);
    let counted = match references.len() == views {
        true => format!("{views} views"),
        false => format!("{} of {views} views", references.len()),
    };
    let validated = outcome.share(PixelStatus::Validated);
    let mut lines = vec![
        format!("{counted}, {validated:.1} % of {} pixels validated", totals.pixels),
        format!("{} points in {}", totals.points, workspace.cloud_as(written.cloud_format).display()),
    ];
    lines.extend(outcome.reasons());
    let first = &scene.views()[references[0]].name;
    if written.splat {
        lines.push(format!("scene for Gaussian splatting in {}", workspace.splat().display()));
    }
    if written.write.previews {
        lines.push(format!("previews such as {}", workspace.preview(first, "depth").display()));
    }
    lines.push(format!("maps in {}", output.join("stereo").display()));
    let page = output.join(PAGE_NAME);
    if page.is_file() {
        lines.push(format!("report in {}; `skep view {}` opens it", page.display(), output.display()));
    }
    lines.push(format!("counts and times in {}", report_path(output).display()));
    lines.extend(totals.wall_seconds.map(|seconds| format!("done in {seconds:.1} s")));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_are_not_started_are_named() {
        assert_eq!((fewer_threads(0, 8), fewer_threads(8, 8)), (None, None));
        let line = fewer_threads(4096, 8).unwrap();
        assert!(line.starts_with("8 threads instead of 4096"), "{line}");
    }
}
