//! `skep reconstruct`: a scene folder in, maps, previews, cloud and report out.

use crate::arguments::Reconstruct;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::report::{Report, Totals};
use crate::stopwatch::{Stage, Stopwatch};
use crate::{Failure, streams};
use rayon::prelude::*;
use skep::io::{SceneFolder, Workspace, read_scene};
use skep::{Error, Options, PixelStatus, Progress, Reconstruction, Result, Scene};
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
    display.say(&format!("reading {}", arguments.scene.display()));
    let scene = read_scene(&arguments.scene, depth_range)?;
    require_writable(&output)?;

    let interrupt = Interrupt::watch();
    let result = solve(&scene, &options, display, &stopwatch, &interrupt)
        .inspect_err(|error| explain_interruption(error, "nothing was written"))?;
    result.warnings.iter().for_each(|warning| streams::warning(warning));

    let mut stopwatch = stopwatch.into_inner().unwrap_or_else(PoisonError::into_inner);
    stopwatch.enter(Stage::Writing);
    display.say(&format!("writing {}", output.display()));
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

/// Estimates and fuses, timed and shown, until it is done or interrupted.
fn solve(
    scene: &Scene,
    options: &Options,
    display: Display,
    stopwatch: &Mutex<Stopwatch>,
    interrupt: &Interrupt,
) -> Result<Reconstruction> {
    let follower = display.follow();
    let hook = |progress: &Progress| {
        stopwatch.lock().unwrap_or_else(PoisonError::into_inner).enter(progress.phase.into());
        follower.show(progress);
        interrupt.control_flow()
    };
    skep::reconstruct(scene, options, &hook)
}

/// Finds out before hours of work whether the results can be written.
fn require_writable(folder: &Path) -> Result<()> {
    let attempt = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
    attempt.map(drop).map_err(|error| Error::file(folder, format!("cannot be written to: {error}")))
}

/// Writes every file, the report excepted, on the threads of the current pool; stops between two views when interrupted.
fn write(
    output: &Path,
    folder: &Path,
    scene: &Scene,
    result: &Reconstruction,
    interrupt: &Interrupt,
) -> Result<()> {
    // A report says that everything beside it is there and belongs together: an older one must not say so meanwhile.
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
        let kept = format!("{written} of {} views are written and whole", scene.views().len());
        explain_interruption(error, &kept);
    })?;
    let kept = "the maps of all views are written and whole; `skep fuse` makes the cloud from them";
    interrupt.check().inspect_err(|error| explain_interruption(error, kept))?;
    workspace.write_lists(scene.views().iter().map(|view| view.name.as_str()))?;
    workspace.adopt(&SceneFolder::find(folder)?)?;
    Workspace::write_cloud(&workspace.cloud(), &result.points)
}

/// Threads for what the library has no part in; 0 takes one for each core. Started when the library's threads have ended,
/// they take over the memory that those have freed. Hours of work are not lost where no thread can be started: the
/// current one does all of it then.
fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let expected = "a number of threads that the system can start";
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.or_else(|_| rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build());
    pool.map_err(|error| Error::argument("--threads", threads, format!("{expected} ({error})")))
}

fn report_path(output: &Path) -> PathBuf {
    output.join("report.json")
}

/// Says what an interruption leaves behind. Other errors speak for themselves.
fn explain_interruption(error: &Error, kept: &str) {
    if *error == Error::Cancelled {
        streams::notice(&format!("interrupted: {kept}"));
    }
}

/// The last lines: what was made and where to look first, or why there is nothing to see.
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
    lines.push(format!("look at {} and its neighbors first", workspace.preview(first, "depth").display()));
    lines.push(format!("maps in {}", output.join("stereo").display()));
    lines.push(format!("counts and times in {}", report_path(output).display()));
    lines.push(format!("done in {:.1} s", totals.wall_seconds));
    lines
}

/// Why the cloud is empty: how many pixels were dropped for which reason, and what would help.
fn reasons(totals: &Totals) -> Vec<String> {
    let help = |outcome| match outcome {
        PixelStatus::Validated => {
            "confirmed, but in fewer views than fusion asks for: more views of each surface"
        }
        PixelStatus::Masked => "left out by their mask",
        PixelStatus::NoTexture => "too uniform to be matched: more texture or light",
        PixelStatus::NoSources => "seen by fewer than two other views: more overlap between photographs",
        PixelStatus::Inconsistent => "other views disagree: check the calibration and that nothing moved",
        PixelStatus::OutOfRange => "at an end of the depth range: try --depth-range MIN MAX with a wider one",
    };
    let mut lines = vec!["the cloud is empty; what became of the pixels:".to_owned()];
    for outcome in PixelStatus::ALL.into_iter().filter(|outcome| totals.outcomes[outcome.name()] > 0) {
        let (name, share) = (outcome.name(), share(totals, outcome));
        lines.push(format!("  {} ({share:.1} %) {name}: {}", totals.outcomes[name], help(outcome)));
    }
    lines
}

/// Percentage of the pixels with this outcome.
fn share(totals: &Totals, outcome: PixelStatus) -> f64 {
    totals.outcomes[outcome.name()] as f64 * 100.0 / totals.pixels.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_cloud_is_explained_by_the_reasons_that_occurred() {
        let counts = [0, 0, 300, 0, 700, 0];
        let outcomes = PixelStatus::ALL.iter().map(|outcome| outcome.name()).zip(counts).collect();
        let lines = reasons(&Totals { pixels: 1000, outcomes, ..Totals::default() });
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines[1].starts_with("  300 (30.0 %) no_texture: "), "{}", lines[1]);
        assert!(lines[2].starts_with("  700 (70.0 %) inconsistent: "), "{}", lines[2]);
    }
}
