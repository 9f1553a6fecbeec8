//! `skep convert`: the maps of a workspace in formats of other programs.

use crate::Failure;
use crate::interrupt::Interrupt;
use crate::output_arguments::{Convert, ConvertFormat};
use crate::streams;
use skep::fusion::overlaps;
use skep::io::{
    ColmapModel, DepthMapFile, MapFormat, MapKind, ModelImage, SceneFolder, Workspace, read_depth_map,
    read_normal_map, write_dmap, write_float_map,
};
use skep::{Error, Maps, Result};
use std::path::Path;

/// Runs the command.
pub fn run(arguments: &Convert, interrupt: &Interrupt) -> std::result::Result<(), Failure> {
    let workspace = Workspace::new(&arguments.workspace);
    let scene = match &arguments.scene {
        Some(folder) => SceneFolder::find(folder)?,
        None => workspace.find_scene()?,
    };
    let model = ColmapModel::read(&scene.sparse)?;
    let kind = kind(&workspace, &model, arguments)?;
    let centers: Vec<_> = model.images.iter().map(|image| image.camera.center()).collect();
    let overlaps = overlaps(&centers, &model.points);
    let mut written = 0;
    for (index, image) in model.images.iter().enumerate() {
        if interrupt.control_flow().is_break() {
            return Err(Error::Cancelled.into());
        }
        if !workspace.depth_map(&image.name, kind).is_file() {
            streams::warning(&format!("{} has no {} depth map", image.name, kind.colmap_name()));
            continue;
        }
        match arguments.to.map_format() {
            Some(format) => write_maps(&workspace, &image.name, kind, format, &arguments.output)?,
            None => {
                let photograph = scene.images.join(&image.name);
                let path = arguments.output.join(format!("depth{index:04}.dmap"));
                write_openmvs(&workspace, image, kind, &photograph, (index as u32, &overlaps[index]), &path)?;
            }
        }
        written += 1;
    }
    if !streams::is_quiet(arguments.quiet) {
        let (kind, folder) = (kind.colmap_name(), arguments.output.display());
        streams::result(&format!("{kind} maps of {written} views in {folder}"));
    }
    Ok(())
}

/// The kind of maps that was asked for, else the validated ones where any view has one.
fn kind(workspace: &Workspace, model: &ColmapModel, arguments: &Convert) -> Result<MapKind> {
    let wanted = if arguments.raw { &[MapKind::Raw][..] } else { &[MapKind::Validated, MapKind::Raw] };
    let has_map =
        |kind: &&MapKind| model.images.iter().any(|image| workspace.depth_map(&image.name, **kind).is_file());
    wanted.iter().find(has_map).copied().ok_or_else(|| {
        let expected = workspace.depth_map(&model.images[0].name, wanted[0]);
        Error::file(
            &arguments.workspace,
            format!("no depth maps; expected files like {}", expected.display()),
        )
    })
}

/// Writes the maps of a view that are there, under the names of their folders in the workspace.
fn write_maps(
    workspace: &Workspace,
    name: &str,
    kind: MapKind,
    format: MapFormat,
    output: &Path,
) -> Result<()> {
    let file = |what: &str| output.join(what).join(format!("{name}.{}", format.name()));
    for (what, path) in [
        ("depth_maps", workspace.depth_map(name, kind)),
        ("confidence_maps", workspace.confidence_map(name, kind)),
    ] {
        if path.is_file() {
            let map = read_depth_map(&path)?;
            write_float_map(&file(what), format, (map.width, map.height), 1, &map.values)?;
        }
    }
    let path = workspace.normal_map(name, kind);
    if path.is_file() {
        let map = read_normal_map(&path)?;
        write_float_map(&file("normal_maps"), format, (map.width, map.height), 3, map.values.as_flattened())?;
    }
    Ok(())
}

/// Writes the depth map of a view for OpenMVS.
fn write_openmvs(
    workspace: &Workspace,
    image: &ModelImage,
    kind: MapKind,
    photograph: &Path,
    (view, neighbors): (u32, &[u32]),
    path: &Path,
) -> Result<()> {
    let maps: Maps = workspace.read_maps(&image.name, kind, &image.camera)?;
    let confidence_path = workspace.confidence_map(&image.name, kind);
    let confidence = confidence_path.is_file().then(|| read_depth_map(&confidence_path)).transpose()?;
    let photograph = photograph.canonicalize().unwrap_or_else(|_| photograph.to_owned());
    let content = DepthMapFile {
        photograph: &photograph.to_string_lossy(),
        camera: &image.camera,
        view,
        neighbors,
        maps: &maps,
        confidence: confidence.as_ref().map(|map| map.values.as_slice()),
    };
    write_dmap(path, &content)
}

impl ConvertFormat {
    /// The format of single maps; `None` for OpenMVS' files of all maps of a view.
    fn map_format(self) -> Option<MapFormat> {
        match self {
            ConvertFormat::Pfm => Some(MapFormat::Pfm),
            ConvertFormat::Npy => Some(MapFormat::Npy),
            ConvertFormat::Tiff => Some(MapFormat::Tiff),
            ConvertFormat::Dmap => None,
        }
    }
}
