//! `skep fuse`: the cloud from existing maps.

use crate::arguments::Fuse;
use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::{Failure, reconstruct, streams, tasks};
use skep::fusion::{FusionView, fuse, overlaps};
use skep::io::{ModelImage, SceneFolder, Workspace, WorkspaceMaps, WorkspaceView};
use skep::job::{self, Job, Task};
use skep::{Error, FusionOptions, PointCloud, Progress};
use std::path::Path;

/// Runs the command.
pub fn run(arguments: &Fuse) -> Result<(), Failure> {
    let display = Display::new(arguments.quiet);
    if arguments.is_task() {
        return task(arguments, display);
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
    let maps = workspace.read(&scene)?;
    if !maps.missing.is_empty() {
        let missing = maps.missing.join(", ");
        streams::warning(&format!(
            "{} views have no {} maps: {missing}",
            maps.missing.len(),
            maps.kind.colmap_name()
        ));
    }

    let interrupt = Interrupt::watch();
    let threads = arguments.resources.options().threads;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Error::argument("--threads", threads, error.to_string()))?;
    let cloud =
        pool.install(|| fuse_maps(&maps, &options.fusion, display, &interrupt)).inspect_err(|error| {
            if *error == Error::Cancelled {
                streams::notice(&format!("interrupted: {} was not written", output.display()));
            }
        })?;
    Workspace::write_cloud(&output, &cloud)?;
    if options.output.splat {
        write_splat(&output, &scene, &maps, &cloud)?;
    }

    if !arguments.quiet {
        summary(&maps, &cloud).iter().for_each(|line| streams::result(line));
        streams::result(&format!("{} points in {}", cloud.positions.len(), output.display()));
    }
    Ok(())
}

/// Writes a scene for Gaussian splatting beside the cloud.
fn write_splat(
    output: &Path,
    scene: &SceneFolder,
    maps: &WorkspaceMaps,
    cloud: &PointCloud,
) -> skep::Result<()> {
    let image = |view: &WorkspaceView| ModelImage { name: view.name.clone(), camera: view.camera };
    let images: Vec<ModelImage> = maps.views.iter().map(image).collect();
    let folder = output.parent().unwrap_or(Path::new("")).join("splat");
    Workspace::write_splat(&folder, &images, &scene.images, cloud)
}

/// Does the last task of a run.
fn task(arguments: &Fuse, display: Display) -> Result<(), Failure> {
    let job = Job::open(&arguments.workspace, &arguments.resources.options())?;
    tasks::run(&job, &[Task::Fuse], display)?;
    reconstruct::conclude(&job, &job.summary()?, None, arguments.quiet)
}

fn fuse_maps(
    maps: &WorkspaceMaps,
    options: &FusionOptions,
    display: Display,
    interrupt: &Interrupt,
) -> skep::Result<PointCloud> {
    let centers: Vec<_> = maps.views.iter().map(|view| view.camera.center()).collect();
    let overlaps = overlaps(&centers, &maps.points);
    let views: Vec<FusionView> = maps
        .views
        .iter()
        .zip(&overlaps)
        .map(|(view, overlap)| FusionView {
            camera: &view.camera,
            maps: &view.maps,
            status: None,
            confidence: view.confidence.as_deref(),
            picture: view.picture.as_ref(),
            overlap,
        })
        .collect();
    let reporter = display.start();
    let progress = |progress: &Progress| {
        reporter.show(progress);
        interrupt.control_flow()
    };
    let cloud = fuse(&views, options, &progress)?;
    interrupt.check().map(|()| cloud)
}

/// What was fused and, when the cloud is empty, the likely reason.
fn summary(maps: &WorkspaceMaps, cloud: &PointCloud) -> Vec<String> {
    let pixels: usize = maps.views.iter().map(|view| view.maps.depth.len()).sum();
    let depths = |view: &WorkspaceView| view.maps.depth.iter().filter(|&&depth| depth > 0.0).count();
    let estimated: usize = maps.views.iter().map(depths).sum();
    let kind = maps.kind.colmap_name();
    let mut lines = vec![format!("{estimated} depths of {pixels} pixels in the {kind} maps")];
    if cloud.positions.is_empty() {
        lines.push(match estimated {
            0 => "the cloud is empty because no map holds a depth".to_owned(),
            _ => "the cloud is empty because too few other views confirm the depths; `skep info \
                  min_agreeing_views` explains how many must"
                .to_owned(),
        });
    }
    lines
}
