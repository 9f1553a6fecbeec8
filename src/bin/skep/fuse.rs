//! `skep fuse`: the cloud from existing maps.

use crate::arguments::Fuse;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::reconstruct::Conclusion;
use crate::{Failure, few_points, reconstruct, streams, tasks};
use skep::io::{SceneFolder, Workspace, WorkspaceMaps, WorkspaceView};
use skep::job::{self, FusedWorkspace, Job, Task};
use skep::{Error, Options, Progress};

/// Names of a list that a warning has, at most.
const MOST_NAMES: usize = 5;

/// Runs the command.
pub fn run(arguments: &Fuse, interrupt: &Interrupt) -> Result<(), Failure> {
    let display = Display::new(&arguments.messages);
    if arguments.is_task() {
        return task(arguments, display, interrupt);
    }
    let (options, output) = arguments.options().map_err(Failure::Usage)?;
    display.print(&format!("reading {}", arguments.workspace.display()));
    let workspace = Workspace::new(&arguments.workspace);
    let scene = match &arguments.scene {
        Some(folder) => SceneFolder::find(folder)?,
        None => workspace.find_scene()?,
    };
    for problem in job::check_maps(&arguments.workspace, &scene)? {
        streams::warning(&problem);
    }
    let maps = workspace.maps(&scene)?;
    missing_files(&maps).iter().for_each(|warning| streams::warning(warning));

    if arguments.replaces_cloud_of_run() {
        streams::warning(
            "the cloud of the run is replaced: its reports are of the one before, and `skep reconstruct` \
             makes that again; --output FILE keeps both",
        );
    }
    let reporter = display.start();
    let progress = |progress: &Progress| {
        reporter.show(progress);
        interrupt.control_flow()
    };
    let fused = job::fuse_workspace(&maps, &options, &output, &progress).inspect_err(|error| {
        if *error == Error::Cancelled {
            streams::notice(&format!("interrupted: {} was not written", output.display()));
        }
    })?;
    drop(reporter);
    colorless(&maps, &fused).iter().for_each(|warning| streams::warning(warning));
    why_few_points(&fused, &options).iter().for_each(|warning| streams::warning(warning));
    if !arguments.messages.are_quiet() {
        let FusedWorkspace { points, pixels, depths, .. } = fused;
        let kind = maps.kind.colmap_name();
        streams::result(&format!("{depths} depths of {pixels} pixels in the {kind} maps"));
        streams::result(&format!("{points} points in {}", output.display()));
    }
    Ok(())
}

/// Does the last task of a run.
fn task(arguments: &Fuse, display: Display, interrupt: &Interrupt) -> Result<(), Failure> {
    let job = Job::open(&arguments.workspace, &arguments.resources.options())?;
    if job.is_complete() {
        display.print("the cloud of this run is complete; --output FILE makes another one");
    }
    tasks::run(&job, &[Task::Fuse], display, interrupt)?;
    let conclusion = Conclusion {
        stopwatch: None,
        has_page: !arguments.no_report,
        dump: None,
        quiet: arguments.messages.are_quiet(),
    };
    reconstruct::conclude(&job, &job.summary()?, conclusion, interrupt)
}

/// The views without maps, and the number of views without photographs.
fn missing_files(maps: &WorkspaceMaps) -> Vec<String> {
    let views = maps.views.len();
    let named = |is_wanted: fn(&WorkspaceView) -> bool| -> Vec<&str> {
        maps.views.iter().filter(|view| is_wanted(view)).map(|view| view.name.as_str()).collect()
    };
    let without_maps = named(|view| view.is_listed && !view.has_maps);
    let left_out = named(|view| !view.is_listed);
    let mut warnings = Vec::new();
    if !left_out.is_empty() {
        let count = left_out.len();
        warnings.push(format!(
            "{count} of {views} views are not in stereo/fusion.cfg and are left out: {}",
            listed(&left_out)
        ));
    }
    if !without_maps.is_empty() {
        let (count, kind) = (without_maps.len(), maps.kind.colmap_name());
        warnings.push(format!("{count} of {views} views have no {kind} maps: {}", listed(&without_maps)));
    }
    warnings
}

/// What the photographs that are missing mean for the cloud, if any are.
fn colorless(maps: &WorkspaceMaps, fused: &FusedWorkspace) -> Option<String> {
    let of_maps = || maps.views.iter().filter(|view| view.has_maps);
    let missing: Vec<&str> =
        of_maps().filter(|view| !view.has_photograph).map(|view| view.name.as_str()).collect();
    let (count, views) = (missing.len(), of_maps().count());
    (count > 0).then(|| {
        format!(
            "{count} of {views} photographs are missing: their points are gray, {} points; missing: {}",
            fused.points_without_color,
            listed(&missing)
        )
    })
}

/// The first names of a list, and the number of the others.
fn listed(names: &[&str]) -> String {
    let first = names[..names.len().min(MOST_NAMES)].join(", ");
    match names.len().saturating_sub(MOST_NAMES) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Why a cloud is empty or thin, and the options that would help; nothing for other clouds.
fn why_few_points(fused: &FusedWorkspace, options: &Options) -> Option<String> {
    let cloud = few_points::few_points(fused.points, fused.pixels, &options.fusion)?;
    let FusedWorkspace { pixels, depths, .. } = *fused;
    let share = depths as f64 * 100.0 / pixels.max(1) as f64;
    let mut text =
        format!("the cloud is {cloud}: {depths} of {pixels} pixels ({share:.1} %) have a depth in the maps");
    if depths > 0 {
        let least = options.fusion.min_agreeing_views;
        text += &format!(", which {least} other views must confirm");
        if least > 1 {
            text += &format!("; with fewer: --set fusion.min_agreeing_views={}", least - 1);
        }
        let confidence = options.fusion.min_confidence;
        if confidence > 0.0 {
            text += &format!("; with smaller confidences: fusion.min_confidence below {confidence}");
        }
        text += "; `skep info fusion.depth_tolerance` explains how much their depths may differ";
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FUSED: FusedWorkspace =
        FusedWorkspace { points: 3, points_without_color: 0, pixels: 1000, depths: 500 };

    #[test]
    fn an_empty_or_thin_cloud_is_explained_with_the_options_that_help() {
        let options = Options::default();
        let thin = why_few_points(&FUSED, &options).unwrap();
        assert!(thin.starts_with("the cloud is thin: 500 of 1000 pixels (50.0 %) have a depth"), "{thin}");
        assert!(thin.contains("--set fusion.min_agreeing_views=2"), "{thin}");
        assert!(!thin.contains("min_confidence"), "{thin}");
        let empty = why_few_points(&FusedWorkspace { points: 0, depths: 0, ..FUSED }, &options).unwrap();
        assert_eq!(empty, "the cloud is empty: 0 of 1000 pixels (0.0 %) have a depth in the maps");
        assert_eq!(why_few_points(&FusedWorkspace { points: 10, ..FUSED }, &options), None);
        let mut strict = options.clone();
        strict.fusion.min_confidence = 0.5;
        assert!(why_few_points(&FUSED, &strict).unwrap().contains("fusion.min_confidence below 0.5"));
    }

    #[test]
    fn long_lists_of_names_are_shortened() {
        assert_eq!(listed(&["a", "b"]), "a, b");
        assert_eq!(listed(&["a", "b", "c", "d", "e", "f", "g"]), "a, b, c, d, e and 2 more");
    }
}
