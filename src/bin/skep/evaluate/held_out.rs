//! Clouds against photographs that were not used for them.

use super::arguments::Evaluate;
use super::points::Points;
use super::rendering::Rendering;
use super::work::Work;
use crate::arguments::{Arguments, Command};
use crate::interrupt::Interrupt;
use crate::{Failure, reconstruct};
use clap::{Parser, ValueEnum};
use serde::Serialize;
use skep::image::Picture;
use skep::import;
use skep::io::{write_file, write_picture};
use skep::{DepthRange, Error, Options, Result, View};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The scores of a cloud in photographs.
#[derive(Serialize)]
pub struct HeldOutScores {
    pub points: usize,
    pub mean: Shares,
    pub views: Vec<ViewShares>,
}

#[derive(Serialize)]
pub struct ViewShares {
    pub name: String,
    #[serde(flatten)]
    pub shares: Shares,
}

#[derive(Clone, Copy, Serialize)]
pub struct Shares {
    /// Pixels that carry a point.
    pub covered: f64,
    /// Pixels that carry one and agree.
    pub right: f64,
    /// `right / covered`.
    pub precision: f64,
}

/// A reconstruction without some photographs.
pub struct Split {
    pub cloud: PathBuf,
    pub left_out: Vec<String>,
    /// The options that say how photographs are read.
    pub options: Options,
}

/// Leaves out every `every`-th photograph and reconstructs from the others.
///
/// # Errors
/// A number that leaves less than two photographs or leaves out none; the errors of the reconstruction.
pub fn reconstruct_without(
    arguments: &Evaluate,
    scene: &Path,
    every: usize,
    interrupt: &Interrupt,
) -> std::result::Result<Split, Failure> {
    let mut names = names(scene)?;
    names.sort();
    let first = arguments.held_out.first;
    if every < 2 {
        let expected = "2 or more: 1 leaves out all photographs";
        return Err(Failure::Usage(Error::argument("--hold-out", every, expected)));
    }
    if first >= names.len() {
        let expected = format!("a number below {}, the photographs of the scene", names.len());
        return Err(Failure::Usage(Error::argument("--first", first, expected)));
    }
    let is_left_out = |index: usize| index >= first && (index - first).is_multiple_of(every);
    let side = |wanted: bool| -> Vec<String> {
        let chosen = names.iter().enumerate().filter(|(index, _)| is_left_out(*index) == wanted);
        chosen.map(|(_, name)| name.clone()).collect()
    };
    let (left_out, kept) = (side(true), side(false));
    if kept.len() < 2 {
        let expected = format!("a number that leaves 2 of the {} photographs", names.len());
        return Err(Failure::Usage(Error::argument("--hold-out", every, expected)));
    }
    let output = arguments.held_out.output.clone().unwrap_or_else(|| scene.join("held-out"));
    write_names(&output.join("left-out.txt"), &left_out)?;
    let list = output.join("used.txt");
    write_names(&list, &kept)?;
    let Command::Reconstruct(command) = parse(arguments, scene, &output, &list)?.command else {
        unreachable!("the arguments begin with `reconstruct`");
    };
    let options = command.run.options().map_err(Failure::Usage)?;
    reconstruct::run(&command, interrupt)?;
    let cloud = skep::io::Workspace::new(&output).cloud_as(options.output.cloud_format);
    Ok(Split { cloud, left_out, options })
}

/// The arguments of `skep reconstruct`.
fn parse(
    arguments: &Evaluate,
    scene: &Path,
    output: &Path,
    list: &Path,
) -> std::result::Result<Arguments, Failure> {
    let Options { threads, memory, .. } = arguments.resources.options();
    let (threads, memory) = (threads.to_string(), memory.to_string());
    let text = |path: &Path| path.as_os_str().to_owned();
    let mut words = vec!["skep".into(), "reconstruct".into(), text(scene), "--output".into(), text(output)];
    words.extend(["--images".into(), text(list), "--threads".into(), threads.into()]);
    if memory != "0" {
        words.extend(["--memory".into(), memory.into()]);
    }
    if let Some(preset) = &arguments.held_out.preset {
        words.extend(["--preset".into(), preset.into()]);
    }
    if arguments.messages.are_quiet() {
        words.push("--quiet".into());
    }
    if let Some(form) = arguments.messages.progress.and_then(|form| form.to_possible_value()) {
        words.extend(["--progress".into(), form.get_name().into()]);
    }
    words.extend(arguments.held_out.reconstruct.iter().map(Into::into));
    Arguments::try_parse_from(words).map_err(|error| {
        let given = arguments.held_out.reconstruct.join(" ");
        let text = error.to_string();
        let reason = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        let expected = format!("arguments of `skep reconstruct` ({reason})");
        Failure::Usage(Error::argument("what follows --", given, expected))
    })
}

fn write_names(path: &Path, names: &[String]) -> Result<()> {
    write_file(path, |out| names.iter().try_for_each(|name| writeln!(out, "{name}")))
}

fn names(scene: &Path) -> Result<Vec<String>> {
    Ok(import::read(scene)?.photographs.into_iter().map(|photograph| photograph.name).collect())
}

/// Compares a cloud with photographs of a scene, and writes pictures of that into `pictures`.
///
/// # Errors
/// A cloud without colors; names that the scene does not have; photographs that cannot be read; the user
/// asked to stop.
pub fn score(
    work: &Work,
    (scene, options): (&Path, &Options),
    left_out: &[String],
    (cloud, points): (&Path, &Points),
    pictures: Option<&Path>,
) -> Result<HeldOutScores> {
    let Some(colors) = &points.colors else {
        return Err(Error::file(cloud, "the points have no colors; expected red, green, blue of 8 bits"));
    };
    let views = read_views(work, scene, options, left_out)?;
    let views = work.map("photographs compared", &views, |view| {
        let photograph: Picture = view.picture.load()?;
        let rendering = Rendering::new(&view.camera, &points.positions, colors);
        let agreement = rendering.compare(&photograph);
        if let Some(folder) = pictures {
            let path = folder.join(format!("{}.png", view.name.replace(['/', '\\'], "_")));
            write_picture(&path, &rendering.picture(&photograph, &agreement)?)?;
        }
        let (covered, right) = (agreement.covered, agreement.right);
        let precision = if covered > 0.0 { right / covered } else { 0.0 };
        Ok(ViewShares { name: view.name.clone(), shares: Shares { covered, right, precision } })
    })?;
    let mean = |value: fn(&Shares) -> f64| {
        views.iter().map(|view| value(&view.shares)).sum::<f64>() / views.len() as f64
    };
    let mean = Shares {
        covered: mean(|shares| shares.covered),
        right: mean(|shares| shares.right),
        precision: mean(|shares| shares.precision),
    };
    Ok(HeldOutScores { points: points.positions.len(), mean, views })
}

/// The photographs of these names, without distortion and of the size that the options say.
fn read_views(work: &Work, scene: &Path, options: &Options, left_out: &[String]) -> Result<Vec<View>> {
    let names = names(scene)?;
    if let Some(unknown) = left_out.iter().find(|name| !names.contains(name)) {
        let expected = format!("names of photographs of the scene, such as {}", names[0]);
        return Err(Error::argument("--views", unknown, expected));
    }
    let mut chosen = left_out.to_vec();
    // A scene has two photographs at least.
    if chosen.len() == 1 {
        chosen.extend(names.iter().find(|name| **name != left_out[0]).cloned());
    }
    let failed = |error| Error::argument("--views", "a list in a temporary file", format!("space ({error})"));
    let mut list = tempfile::NamedTempFile::new().map_err(failed)?;
    chosen.iter().try_for_each(|name| writeln!(list, "{name}")).map_err(failed)?;
    let mut reading = Options { threads: options.threads, memory: options.memory, ..Options::default() };
    reading.input.max_image_size = options.input.max_image_size;
    reading.input.images = list.path().to_string_lossy().into_owned();
    // No depth is asked for, and some scenes have no points to derive one from.
    let range = Some(DepthRange { near: 1.0, far: 2.0 });
    let scene = import::read_scene(scene, range, &reading, &|_| work.control_flow())?;
    Ok(scene.views().iter().filter(|view| left_out.contains(&view.name)).cloned().collect())
}

impl HeldOutScores {
    /// The lines to print.
    pub fn lines(&self) -> Vec<String> {
        let row = |name: &str, shares: &Shares| {
            let Shares { covered, right, precision } = shares;
            format!("  covered {covered:.4}  right {right:.4}  precision {precision:.4}  {name}")
        };
        let mut lines = vec![format!("photographs left out, {} points:", self.points)];
        lines.extend(self.views.iter().map(|view| row(&view.name, &view.shares)));
        lines.push(row("mean", &self.mean));
        lines
    }
}
