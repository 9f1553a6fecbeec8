//! `skep reconstruct`: maps, previews, cloud and report of a scene folder.

use crate::arguments::Reconstruct;
use crate::dump;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::report::{Report, Totals};
use crate::stopwatch::{Stage, Stopwatch};
use crate::{Failure, streams};
use rayon::prelude::*;
use skep::io::{SceneFolder, Workspace, read_scene};
use skep::{Error, PixelStatus, Progress, ProgressFn, Reconstruction, Result, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Runs the command.
pub fn run(arguments: &Reconstruct) -> std::result::Result<(), Failure> {
    let depth_range = arguments.depth_range().map_err(Failure::Usage)?;
    let options = arguments.options().map_err(Failure::Usage)?;
    options.check().map_err(Failure::Usage)?;
    let output = arguments.output();

    let stopwatch = Mutex::new(Stopwatch::start());
    let display = Display::new(arguments.quiet);
    display.print(&format!("reading {}", arguments.scene.display()));
    let scene = read_scene(&arguments.scene, depth_range)?;
    require_writable(&output)?;
    if let Some(folder) = &arguments.dump {
        require_writable(folder)?;
    }

    let interrupt = Interrupt::watch();
    let estimate = |progress: ProgressFn| match &arguments.dump {
        Some(folder) => {
            pool(options.threads)?.install(|| dump::reconstruct(&scene, &options, folder, progress))
        }
        None => skep::reconstruct(&scene, &options, progress),
    };
    let kept = match &arguments.dump {
        Some(_) => "the pictures of the finished cycles are complete, nothing else was written",
        None => "nothing was written",
    };
    let result = with_progress(&estimate, display, &stopwatch, &interrupt)
        .inspect_err(|error| explain_interruption(error, kept))?;
    result.warnings.iter().for_each(|warning| streams::warning(warning));

    let mut stopwatch = stopwatch.into_inner().unwrap_or_else(PoisonError::into_inner);
    stopwatch.enter(Stage::Writing);
    display.print(&format!("writing {}", output.display()));
    let mut report = Report::new(&scene, &arguments.preset, &options, &result);
    let writers = pool(options.threads)?;
    writers.install(|| write(&output, &arguments.scene, &scene, &result, &interrupt))?;
    report.set_times(stopwatch.times());
    report.write(&report_path(&output))?;

    if !arguments.quiet {
        summary(&output, &scene, &report.totals).iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// Estimates and fuses; measures the times, displays the progress, and ends early when interrupted.
fn with_progress(
    estimate: &dyn Fn(ProgressFn) -> Result<Reconstruction>,
    display: Display,
    stopwatch: &Mutex<Stopwatch>,
    interrupt: &Interrupt,
) -> Result<Reconstruction> {
    let reporter = display.start();
    let progress = |progress: &Progress| {
        stopwatch.lock().unwrap_or_else(PoisonError::into_inner).enter(progress.phase.into());
        reporter.show(progress);
        interrupt.control_flow()
    };
    estimate(&progress)
}

/// Checks that results can be written before the run, which may take hours.
fn require_writable(folder: &Path) -> Result<()> {
    let attempt = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
    attempt.map(drop).map_err(|error| Error::file(folder, format!("cannot be written to: {error}")))
}

/// Writes every file, the report excepted, on the threads of the current pool; stops between two views when
/// interrupted.
fn write(
    output: &Path,
    folder: &Path,
    scene: &Scene,
    result: &Reconstruction,
    interrupt: &Interrupt,
) -> Result<()> {
    // A report implies that the files beside it are complete and of the same run: an older one is removed
    // first.
    let report = report_path(output);
    match std::fs::remove_file(&report) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            return Err(Error::file(report, format!("cannot be replaced: {error}")));
        }
        _ => (),
    }
    let workspace = Workspace::new(output);
    let written = AtomicUsize::new(0);
    let views = scene.views().par_iter().zip(&result.views).with_max_len(1);
    let all = views.try_for_each(|(view, result)| {
        interrupt.check()?;
        workspace.write_view(&view.name, &view.camera, result)?;
        written.fetch_add(1, Ordering::Relaxed);
        Ok(())
    });
    all.inspect_err(|error| {
        let written = written.load(Ordering::Relaxed);
        let kept = format!("the files of {written} of {} views are complete", scene.views().len());
        explain_interruption(error, &kept);
    })?;
    let kept = "the maps of all views are complete; `skep fuse` makes the cloud from them";
    interrupt.check().inspect_err(|error| explain_interruption(error, kept))?;
    workspace.write_lists(scene.views().iter().map(|view| view.name.as_str()))?;
    workspace.adopt(&SceneFolder::find(folder)?)?;
    Workspace::write_cloud(&workspace.cloud(), &result.points)
}

/// A thread pool for work outside the library; 0 starts one thread for each core. The pool for writing is
/// started after that of the library has ended, and reuses its memory. If no thread can be started, the
/// current one does the work, so that the estimates are not lost.
fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let expected = "a number of threads that the system can start";
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.or_else(|_| rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build());
    pool.map_err(|error| Error::argument("--threads", threads, format!("{expected} ({error})")))
}

fn report_path(output: &Path) -> PathBuf {
    output.join("report.json")
}

/// Prints which files an interruption leaves. Other errors have a text of their own.
fn explain_interruption(error: &Error, kept: &str) {
    if *error == Error::Cancelled {
        streams::notice(&format!("interrupted: {kept}"));
    }
}

/// The last lines: the written files and, if the cloud is empty, the reasons.
fn summary(output: &Path, scene: &Scene, totals: &Totals) -> Vec<String> {
    let workspace = Workspace::new(output);
    let validated = share(totals, PixelStatus::Validated);
    let mut lines = vec![
        format!("{} views, {validated:.1} % of {} pixels validated", scene.views().len(), totals.pixels),
        format!("{} points in {}", totals.points, workspace.cloud().display()),
    ];
    if totals.points == 0 {
        lines.extend(reasons(totals));
    }
    let first = &scene.views()[0].name;
    lines.push(format!("previews such as {}", workspace.preview(first, "depth").display()));
    lines.push(format!("maps in {}", output.join("stereo").display()));
    lines.push(format!("counts and times in {}", report_path(output).display()));
    lines.push(format!("done in {:.1} s", totals.wall_seconds));
    lines
}

/// Why the cloud is empty: the number of pixels of each status, and the remedy.
fn reasons(totals: &Totals) -> Vec<String> {
    let help = |status| match status {
        PixelStatus::Validated => {
            "validated, but confirmed by fewer views than fusion needs: more views of each surface"
        }
        PixelStatus::Masked => "excluded by a mask",
        PixelStatus::NoTexture => "too uniform to be matched: more texture or more light",
        PixelStatus::NoSources => "seen by fewer than two other views: more overlap between photographs",
        PixelStatus::Inconsistent => "other views disagree: check the calibration and that nothing moved",
        PixelStatus::OutOfRange => "at an end of the depth range: widen it with --depth-range MIN MAX",
    };
    let mut lines = vec!["the cloud is empty; the status of the pixels:".to_owned()];
    for status in PixelStatus::ALL.into_iter().filter(|status| totals.status_counts[status.name()] > 0) {
        let (name, share) = (status.name(), share(totals, status));
        lines.push(format!("  {} ({share:.1} %) {name}: {}", totals.status_counts[name], help(status)));
    }
    lines
}

/// Percentage of the pixels with this status.
fn share(totals: &Totals, status: PixelStatus) -> f64 {
    totals.status_counts[status.name()] as f64 * 100.0 / totals.pixels.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_cloud_is_explained_by_the_reasons_that_occurred() {
        let counts = [0, 0, 300, 0, 700, 0];
        let status_counts = PixelStatus::ALL.iter().map(|status| status.name()).zip(counts).collect();
        let lines = reasons(&Totals { pixels: 1000, status_counts, ..Totals::default() });
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines[1].starts_with("  300 (30.0 %) no_texture: "), "{}", lines[1]);
        assert!(lines[2].starts_with("  700 (70.0 %) inconsistent: "), "{}", lines[2]);
    }
}
