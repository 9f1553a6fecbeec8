//! `skep evaluate`: scores of depth maps and clouds, with ground truth and without.

mod arguments;
mod cloud;
mod depth;
mod dtu;
mod float_maps;
mod held_out;
mod kd_tree;
mod matlab;
mod pictures;
mod plots;
mod points;
mod regions;
mod rendering;
mod scores;
mod surface;
mod thinning;
mod truth;
mod view_sets;
mod work;

use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::{Failure, streams};
pub use arguments::Evaluate;
use arguments::{Outliers, Thinning};
use cloud::{CloudScores, Defaults, Settings, Sides};
use depth::DepthScores;
use held_out::HeldOutScores;
use points::Points;
use regions::Region;
use serde::Serialize;
use skep::io::{ColmapModel, SceneFolder, Workspace, write_file};
use skep::{Error, Options, Result};
use std::path::Path;
use truth::Truth;
use work::Work;

/// All scores of a call.
#[derive(Default, Serialize)]
struct Scores {
    #[serde(skip_serializing_if = "Option::is_none")]
    depth: Option<DepthScores>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cloud: Option<CloudScores>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOutScores>,
}

/// Runs the command.
pub fn run(arguments: &Evaluate, interrupt: &Interrupt) -> std::result::Result<(), Failure> {
    let display = Display::new(&arguments.messages);
    let options = arguments.resources.options();
    let work = Work::new(options.threads, display, interrupt)?;
    let (scores, lines) = score(arguments, &options, &work, interrupt)?;
    if let Some(file) = &arguments.json {
        write_file(file, |out| serde_json::to_writer_pretty(out, &scores).map_err(Into::into))?;
    }
    if let Some(folder) = &arguments.plots {
        pictures::draw(&scores, folder)?;
    }
    if !arguments.messages.are_quiet() {
        lines.iter().for_each(|line| streams::result(line));
    }
    Ok(())
}

/// The scores, and the lines to print.
fn score(
    arguments: &Evaluate,
    options: &Options,
    work: &Work,
    interrupt: &Interrupt,
) -> std::result::Result<(Scores, Vec<String>), Failure> {
    let mut scores = Scores::default();
    let pictures = arguments.plots.as_deref();
    if let Some(every) = arguments.held_out.hold_out {
        let scene = path(arguments, "a scene whose photographs are left out")?;
        let split = held_out::reconstruct_without(arguments, scene, every, interrupt)?;
        let points = read_points(work, &split.cloud)?;
        let (scene, cloud) = ((scene, &split.options), (split.cloud.as_path(), &points));
        let found = scores.held_out.insert(held_out::score(work, scene, &split.left_out, cloud, pictures)?);
        let lines = found.lines();
        return Ok((scores, lines));
    }
    if !arguments.held_out.views.is_empty() {
        let scene = path(arguments, "a scene whose photographs judge the cloud")?;
        let file = arguments.cloud.as_deref().unwrap_or(Path::new(""));
        let points = read_points(work, file)?;
        let views = &arguments.held_out.views;
        let found = held_out::score(work, (scene, options), views, (file, &points), pictures)?;
        let lines = found.lines();
        scores.held_out = Some(found);
        return Ok((scores, lines));
    }
    if let (Some(file), Some(truth)) = (&arguments.cloud, &arguments.truth_cloud) {
        let (found, lines) = clouds(arguments, work, file, truth)?;
        scores.cloud = Some(found);
        return Ok((scores, lines));
    }
    let Some(truth) = &arguments.truth else {
        let expected = "--truth DIR, --truth-cloud FILE, --views NAMES or --hold-out N";
        return Err(Failure::Usage(Error::argument("what to compare with", "missing", expected)));
    };
    maps(arguments, work, truth)
}

/// The positional argument.
fn path<'a>(arguments: &'a Evaluate, expected: &str) -> std::result::Result<&'a Path, Failure> {
    let missing = || Failure::Usage(Error::argument("PATH", "missing", expected));
    arguments.path.as_deref().ok_or_else(missing)
}

/// Depth maps against true ones, and the cloud, if one is given, against their surface.
fn maps(
    arguments: &Evaluate,
    work: &Work,
    folder: &Path,
) -> std::result::Result<(Scores, Vec<String>), Failure> {
    let path = path(arguments, "a workspace whose depth maps are compared with --truth")?;
    let (options, kind) = (&arguments.maps, arguments.maps.kind.into());
    let truth =
        Truth::find(folder, options.truth_normals.as_deref(), options.depth_scale).map_err(Failure::Usage)?;
    for &threshold in &options.thresholds {
        if !(threshold.is_finite() && threshold > 0.0) {
            let expected = "a relative error above 0, such as 0.01";
            return Err(Failure::Usage(Error::argument("--thresholds", threshold, expected)));
        }
    }
    let defaults = Defaults {
        max_distance: None,
        outliers: Outliers::Clamp,
        voxel: None,
        thins_truth: true,
        thinning: Thinning::First,
    };
    let settings = Settings::new(&arguments.distances, &defaults).map_err(Failure::Usage)?;
    let region = Region::read(&arguments.region)?;
    let workspace = Workspace::new(path);
    let scene = match &options.scene {
        Some(folder) => SceneFolder::find(folder)?,
        None => workspace.find_scene()?,
    };
    work.say(&format!("reading {}", path.display()));
    let images = ColmapModel::read(&scene.sparse)?.images;
    let has_maps = images.iter().any(|image| workspace.depth_map(&image.name, kind).is_file());
    if !has_maps && arguments.cloud.is_none() {
        let expected = workspace.depth_map(&images[0].name, kind);
        let problem = format!("no depth maps; expected files like {}", expected.display());
        return Err(Error::file(path, problem).into());
    }
    let mut scores = Scores::default();
    let mut lines = Vec::new();
    let has_graphs = images.iter().any(|image| workspace.consistency_graph(&image.name, kind).is_file());
    let views = if has_graphs || arguments.cloud.is_some() {
        surface::read(work, &images, &truth)?
    } else {
        Vec::new()
    };
    if has_maps {
        let mut found = depth::score(work, &workspace, kind, &images, &truth, &options.thresholds)?;
        let left_out = images.len() - found.views.len();
        if left_out > 0 {
            let text = format!("{left_out} of {} views have no true depths and are left out", images.len());
            streams::warning(&text);
        }
        if has_graphs {
            found.view_sets = view_sets::score(work, &workspace, kind, &images, &views)?;
        }
        lines.extend(found.lines(kind));
        scores.depth = Some(found);
    }
    if let Some(file) = &arguments.cloud {
        let mut cloud = read_points(work, file)?.positions;
        let count = cloud.len();
        let surface::Surface { mut all, mut seen } = surface::surface(work, &views, options.min_views)?;
        region.align(&mut cloud);
        [&mut cloud, &mut all, &mut seen].into_iter().for_each(|points| region.crop(points));
        let cloud = settings.thin(work, cloud, 0)?;
        let (all, seen) = (settings.thin(work, all, 1)?, settings.thin(work, seen, 1)?);
        let sides = Sides { judged: &cloud, cloud: &cloud, wanted: &seen, truth: &all };
        let found = cloud::compare(work, count, &sides, &settings)?;
        lines.extend(found.lines(&settings));
        scores.cloud = Some(found);
    }
    Ok((scores, lines))
}

/// A cloud against a true one.
fn clouds(
    arguments: &Evaluate,
    work: &Work,
    file: &Path,
    truth_file: &Path,
) -> std::result::Result<(CloudScores, Vec<String>), Failure> {
    let is_dtu = arguments.region.dtu_mask.is_some();
    let defaults = Defaults {
        max_distance: is_dtu.then_some(dtu::MAX_DISTANCE),
        outliers: if is_dtu { Outliers::Drop } else { Outliers::Clamp },
        voxel: is_dtu.then_some(dtu::SPACING),
        thins_truth: !is_dtu,
        thinning: if is_dtu { Thinning::Radius } else { Thinning::Mean },
    };
    let settings = Settings::new(&arguments.distances, &defaults).map_err(Failure::Usage)?;
    let region = Region::read(&arguments.region)?;
    let mask = arguments.region.dtu_mask.as_deref().map(dtu::read_mask).transpose()?;
    let plane = arguments.region.dtu_plane.as_deref().map(dtu::read_plane).transpose()?;
    let mut cloud = read_points(work, file)?.positions;
    let mut truth = read_points(work, truth_file)?.positions;
    let count = cloud.len();
    region.align(&mut cloud);
    region.crop(&mut cloud);
    region.crop(&mut truth);
    if truth.is_empty() {
        return Err(Error::file(truth_file, "none of its points lies within the region").into());
    }
    let cloud = settings.thin(work, cloud, 0)?;
    let truth = settings.thin(work, truth, 1)?;
    let is_judged = |point: &&[f64; 3]| mask.as_ref().is_none_or(|mask| mask.contains(point));
    let is_wanted = |point: &&[f64; 3]| plane.as_ref().is_none_or(|plane| dtu::is_above(plane, point));
    let judged: Vec<[f64; 3]> = cloud.iter().filter(is_judged).copied().collect();
    let wanted: Vec<[f64; 3]> = truth.iter().filter(is_wanted).copied().collect();
    let sides = Sides { judged: &judged, cloud: &cloud, wanted: &wanted, truth: &truth };
    let found = cloud::compare(work, count, &sides, &settings)?;
    let lines = found.lines(&settings);
    Ok((found, lines))
}

/// Reads a cloud and says what was left out.
fn read_points(work: &Work, file: &Path) -> Result<Points> {
    work.check()?;
    work.say(&format!("reading {}", file.display()));
    let points = points::read(file)?;
    if points.dropped > 0 {
        let (dropped, file) = (points.dropped, file.display());
        streams::warning(&format!("{dropped} points of {file} are not finite and are left out"));
    }
    Ok(points)
}
