//! `skep reconstruct`: maps, previews, cloud and reports of a scene folder.

use crate::arguments::Reconstruct;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::report::{self, PAGE_NAME, PageOptions, Report, RunFiles, Totals};
use crate::run_arguments::Run;
use crate::stopwatch::{Stage, Stopwatch};
use crate::{Failure, dump, streams};
use skep::job::{Job, Needs, Summary};
use skep::{DepthRange, Error, Options, PixelStatus, Progress, Result, format_bytes};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Points for each unmasked pixel below which a cloud is thin. A point takes the pixel of every view that
/// agrees: 0.03 to 0.2 are usual, and 0.01 is left of a complete cloud that 100 views see everywhere.
const THIN_CLOUD: f64 = 0.01;
/// Percentage of the pixels above which a status is named as a reason of an empty cloud; the two largest at
/// most. One of the six statuses always has more.
const LARGE_SHARE: f64 = 10.0;

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
        quiet: run.messages.quiet,
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
    let scene = job.scene();
    let ranges: Vec<DepthRange> = (0..scene.views().len()).map(|view| scene.depth_range(view)).collect();
    let warning = few_points_warning(&report.totals, &ranges, job.options());
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
                threads: skep::thread_count(scene, job.options()),
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
        summary(job, &ranges, &report.totals).iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// Plans the run, and says what became of an earlier one and what this one needs.
pub fn plan(run: &Run, display: Display, interrupt: &Interrupt) -> std::result::Result<Job, Failure> {
    let depth_range = run.depth_range().map_err(Failure::Usage)?;
    let options = run.options().map_err(Failure::Usage)?;
    options.check().map_err(Failure::Usage)?;
    display.print(&format!("reading {}", run.scene.display()));
    let reporter = display.start();
    let progress = |progress: &Progress| {
        reporter.show(progress);
        interrupt.control_flow()
    };
    let job = Job::plan(&run.scene, depth_range, &options, &run.output(), run.fresh, &progress).inspect_err(
        |error| {
            if *error == Error::Cancelled {
                streams::notice("interrupted while reading: nothing was changed");
            }
        },
    )?;
    drop(reporter);
    job.notices().iter().for_each(|notice| streams::warning(notice));
    job.scene().warnings().iter().for_each(|warning| streams::warning(warning));
    display.print(&needs(&job));
    let threads = skep::thread_count(job.scene(), &options);
    fewer_threads(options.threads, threads).iter().for_each(|line| display.print(line));
    Ok(job)
}

/// What the run needs, in a line.
fn needs(job: &Job) -> String {
    let Needs { least_memory, memory, disk, cpu_seconds } = job.needs();
    let threads = skep::thread_count(job.scene(), job.options());
    let seconds = cpu_seconds / threads as f64;
    let time = match seconds {
        ..100.0 => format!("{seconds:.0} s"),
        ..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    };
    format!(
        "{} views; about {time} on {threads} threads, at most {} of memory (it works with {}) and {} on disk",
        job.scene().views().len(),
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
fn summary(job: &Job, ranges: &[DepthRange], totals: &Totals) -> Vec<String> {
    let (workspace, scene, written) = (job.workspace(), job.scene(), job.options().output);
    let output = workspace.folder();
    let validated = share(totals, PixelStatus::Validated);
    let mut lines = vec![
        format!("{} views, {validated:.1} % of {} pixels validated", scene.views().len(), totals.pixels),
        format!("{} points in {}", totals.points, workspace.cloud_as(written.cloud_format).display()),
    ];
    lines.extend(reasons(totals, ranges));
    let first = &scene.views()[0].name;
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

/// `empty` or `thin` for a cloud of few points, of maps with so many pixels.
pub fn few_points(points: u64, pixels: u64) -> Option<&'static str> {
    match points {
        0 => Some("empty"),
        points if (points as f64) < THIN_CLOUD * pixels as f64 => Some("thin"),
        _ => None,
    }
}

/// Why the cloud is empty or thin: the number of pixels of each status with the remedy, and the depth range.
/// Nothing for other clouds.
fn reasons(totals: &Totals, ranges: &[DepthRange]) -> Vec<String> {
    let Some(cloud) = few_points(totals.points as u64, unmasked(totals)) else { return Vec::new() };
    let mut lines = vec![format!("the cloud is {cloud}; the status of the pixels:")];
    for status in PixelStatus::ALL.into_iter().filter(|status| totals.status_counts[status.name()] > 0) {
        let (name, share) = (status.name(), share(totals, status));
        lines.push(format!("  {} ({share:.1} %) {name}: {}", totals.status_counts[name], help(status)));
    }
    lines.push(format!("{}; --depth-range MIN MAX sets another range", searched(ranges)));
    lines
}

fn unmasked(totals: &Totals) -> u64 {
    totals.pixels - totals.status_counts[PixelStatus::Masked.name()]
}

/// One sentence on an empty or thin cloud, with the most frequent statuses of the pixels and the remedies;
/// nothing for other clouds.
fn few_points_warning(totals: &Totals, ranges: &[DepthRange], options: &Options) -> Option<String> {
    let cloud = few_points(totals.points as u64, unmasked(totals))?;
    let mut statuses = PixelStatus::ALL;
    statuses.sort_by_key(|status| std::cmp::Reverse(totals.status_counts[status.name()]));
    let large = statuses.into_iter().filter(|&status| share(totals, status) > LARGE_SHARE);
    let large = large.take(2).map(|status| {
        let (name, share) = (status.name(), share(totals, status));
        format!("{share:.1} % of the pixels are {name} ({})", help(status))
    });
    let reasons: Vec<String> = large.collect();
    let mut text = format!("the cloud is {cloud}: {}; {}", reasons.join(", "), searched(ranges));
    let (others, wanted) = (ranges.len() - 1, options.check.min_consistent_views as usize);
    if others < wanted {
        text += &format!(
            "; {} views cannot confirm a depth in {wanted} other ones: --set \
             check.min_consistent_views={others}",
            ranges.len(),
        );
    }
    let agreeing = options.fusion.min_agreeing_views as usize;
    if agreeing > 1 && (others < agreeing || share(totals, PixelStatus::Validated) > LARGE_SHARE) {
        let fewer = others.min(agreeing - 1);
        text += &format!(
            "; a point needs {agreeing} views that agree with its pixel: --set \
             fusion.min_agreeing_views={fewer}"
        );
    }
    if options.fusion.min_confidence > 0.0 {
        let confidence = options.fusion.min_confidence;
        text += &format!("; pixels below fusion.min_confidence={confidence} are left out");
    }
    Some(text)
}

/// What a status says about the scene, and the remedy.
pub fn help(status: PixelStatus) -> &'static str {
    match status {
        PixelStatus::Validated => {
            "validated, but confirmed by fewer views than fusion needs: more views of each surface"
        }
        PixelStatus::Masked => "excluded by a mask",
        PixelStatus::NoTexture => "too uniform to be matched: more texture or more light",
        PixelStatus::NoSources => "seen by too few other views: more overlap between photographs",
        PixelStatus::Inconsistent => "other views disagree: check the calibration and that nothing moved",
        PixelStatus::OutOfRange => "at an end of the depth range: widen it with --depth-range MIN MAX",
    }
}

/// The depths that were searched, over all views, with the four significant digits that a message needs.
fn searched(ranges: &[DepthRange]) -> String {
    let rounded = |depth: f64| format!("{depth:.3e}").parse().unwrap_or(depth);
    let near = ranges.iter().map(|range| range.near).fold(f64::INFINITY, f64::min);
    let far = ranges.iter().map(|range| range.far).fold(0.0, f64::max);
    format!("depths of {} to {} were searched", rounded(near), rounded(far))
}

/// Percentage of the pixels with this status.
fn share(totals: &Totals, status: PixelStatus) -> f64 {
    totals.status_counts[status.name()] as f64 * 100.0 / totals.pixels.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGES: [DepthRange; 2] =
        [DepthRange { near: 1.25, far: 4.0 }, DepthRange { near: 1.5, far: 4.133_94 }];

    /// Totals of 1000 pixels with these statuses, in the order of [`PixelStatus::ALL`].
    fn totals(points: usize, counts: [u64; 6]) -> Totals {
        let status_counts = PixelStatus::ALL.iter().map(|status| status.name()).zip(counts).collect();
        Totals { pixels: 1000, points, status_counts, ..Totals::default() }
    }

    #[test]
    fn threads_that_are_not_started_are_named() {
        assert_eq!((fewer_threads(0, 8), fewer_threads(8, 8)), (None, None));
        let line = fewer_threads(4096, 8).unwrap();
        assert!(line.starts_with("8 threads instead of 4096"), "{line}");
    }

    #[test]
    fn an_empty_cloud_is_explained_by_the_reasons_that_occurred() {
        let lines = reasons(&totals(0, [0, 0, 300, 0, 700, 0]), &RANGES);
        assert_eq!(lines.len(), 4, "{lines:?}");
        assert_eq!(lines[0], "the cloud is empty; the status of the pixels:");
        assert!(lines[1].starts_with("  300 (30.0 %) no_texture: "), "{}", lines[1]);
        assert!(lines[2].starts_with("  700 (70.0 %) inconsistent: "), "{}", lines[2]);
        assert!(
            lines[3].starts_with("depths of 1.25 to 4.134 were searched; --depth-range "),
            "{}",
            lines[3]
        );
    }

    #[test]
    fn a_thin_cloud_is_explained_as_well_and_measured_by_the_unmasked_pixels() {
        let thin = reasons(&totals(9, [400, 0, 0, 600, 0, 0]), &RANGES);
        assert_eq!(thin[0], "the cloud is thin; the status of the pixels:");
        assert!(thin[2].starts_with("  600 (60.0 %) no_sources: seen by too few other views"), "{}", thin[2]);
        assert_eq!(reasons(&totals(10, [400, 0, 0, 600, 0, 0]), &RANGES), Vec::<String>::new());
        assert_eq!(reasons(&totals(9, [100, 900, 0, 0, 0, 0]), &RANGES), Vec::<String>::new());
    }

    #[test]
    fn the_warning_of_an_empty_cloud_names_the_largest_reasons_and_the_remedy() {
        let options = Options::default();
        let counts = totals(0, [0, 0, 250, 90, 660, 0]);
        let ranges = [RANGES[0], RANGES[1], RANGES[1], RANGES[0]];
        let warning = few_points_warning(&counts, &ranges, &options).unwrap();
        let start = "the cloud is empty: 66.0 % of the pixels are inconsistent (other views disagree: ";
        assert!(warning.starts_with(start), "{warning}");
        assert!(warning.contains(", 25.0 % of the pixels are no_texture (too uniform "), "{warning}");
        assert!(!warning.contains("no_sources"), "{warning}");
        assert!(warning.ends_with("; depths of 1.25 to 4.134 were searched"), "{warning}");

        let two_views = few_points_warning(&totals(0, [0, 0, 0, 1000, 0, 0]), &RANGES, &options).unwrap();
        assert!(two_views.contains("100.0 % of the pixels are no_sources"), "{two_views}");
        assert!(two_views.contains("--set check.min_consistent_views=1"), "{two_views}");
        assert!(two_views.ends_with("--set fusion.min_agreeing_views=1"), "{two_views}");
    }

    #[test]
    fn a_thin_cloud_of_validated_pixels_is_a_warning_with_the_option_of_the_fusion() {
        let mut options = Options::default();
        options.fusion.min_confidence = 0.9;
        let counts = totals(5, [900, 0, 100, 0, 0, 0]);
        let warning = few_points_warning(&counts, &[RANGES[0]; 5], &options).unwrap();
        assert!(warning.starts_with("the cloud is thin: 90.0 % of the pixels are validated"), "{warning}");
        assert!(warning.contains("--set fusion.min_agreeing_views=2"), "{warning}");
        assert!(warning.ends_with("pixels below fusion.min_confidence=0.9 are left out"), "{warning}");
        assert_eq!(few_points_warning(&totals(10, [900, 0, 100, 0, 0, 0]), &RANGES, &options), None);
    }
}
