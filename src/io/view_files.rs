//! The files of a view in a dense folder: maps, consistency graphs, status and previews.

use super::colmap_maps::{write_consistency_graph, write_depth_map, write_normal_map};
use super::previews::{
    write_depth_preview, write_fraction_preview, write_normal_preview, write_numbers, write_views_preview,
};
use super::workspace::{MapKind, Workspace};
use crate::error::Result;
use crate::geometry::Camera;
use crate::options::ViewFiles;
use crate::pipeline::ViewResult;
use crate::scene::Maps;
use std::path::PathBuf;

impl Workspace {
    /// The files of a view among those that [`Workspace::write_view_files`] writes.
    pub fn view_files(&self, name: &str, files: &ViewFiles) -> Vec<PathBuf> {
        let maps =
            [MapKind::Raw, MapKind::Validated].into_iter().flat_map(|kind| self.map_files(name, kind, files));
        let status = files.status.then(|| self.status_map(name));
        let previews = ["depth", "normal", "views", "confidence"].map(|what| self.preview(name, what));
        maps.chain(status).chain(previews.into_iter().filter(|_| files.previews)).collect()
    }

    /// The maps that the fusion reads, for each view.
    pub(crate) fn fused_files(&self, name: &str) -> Vec<PathBuf> {
        self.map_files(name, MapKind::Validated, &ViewFiles::FUSED)
    }

    fn map_files(&self, name: &str, kind: MapKind, files: &ViewFiles) -> Vec<PathBuf> {
        let maps = [
            ("depth_maps", files.depth),
            ("normal_maps", files.normals),
            ("confidence_maps", files.confidence),
            ("consistency_graphs", files.graphs),
        ];
        maps.into_iter().filter(|(_, is_on)| *is_on).map(|(what, _)| self.map(what, name, kind)).collect()
    }

    /// Writes the files of one view: depth, normal and confidence map and consistency graph of the raw
    /// estimate (photometric) and of the validated pixels (geometric), and previews of the latter. A
    /// confidence map has the layout of a depth map.
    ///
    /// # Errors
    /// A name that leads outside the folder; a file that cannot be written.
    pub fn write_view(&self, name: &str, camera: &Camera, result: &ViewResult) -> Result<()> {
        self.write_view_files(name, camera, result, &ViewFiles { status: false, ..ViewFiles::ALL })
    }

    /// The same for the files that are wanted; the status of each pixel is an 8-bit gray PNG of the numbers
    /// of
    /// [`PixelStatus`](crate::PixelStatus).
    ///
    /// # Errors
    /// The errors of [`Workspace::write_view`].
    pub fn write_view_files(
        &self,
        name: &str,
        camera: &Camera,
        result: &ViewResult,
        files: &ViewFiles,
    ) -> Result<()> {
        Workspace::check_name(name)?;
        let validated = result.validated();
        self.write_maps(name, MapKind::Raw, (camera, files), &result.raw, result)?;
        self.write_maps(name, MapKind::Validated, (camera, files), &validated, result)?;
        let (width, height) = (camera.width, camera.height);
        if files.status {
            write_numbers(&self.status_map(name), width, height, |pixel| result.status[pixel] as u8)?;
        }
        if !files.previews {
            return Ok(());
        }
        write_fraction_preview(&self.preview(name, "confidence"), width, height, |pixel| {
            if validated.depth[pixel] > 0.0 { result.confidence[pixel] } else { 0.0 }
        })?;
        write_depth_preview(&self.preview(name, "depth"), width, height, &validated.depth)?;
        write_normal_preview(&self.preview(name, "normal"), width, height, &validated.normal)?;
        write_views_preview(&self.preview(name, "views"), width, height, result.sources.len(), |pixel| {
            if validated.depth[pixel] > 0.0 { result.view_sets.count(pixel) } else { 0 }
        })
    }

    /// Writes the maps that the fusion reads.
    ///
    /// # Errors
    /// The errors of [`Workspace::write_view`].
    pub(crate) fn write_fused_maps(&self, name: &str, camera: &Camera, result: &ViewResult) -> Result<()> {
        Workspace::check_name(name)?;
        self.write_maps(name, MapKind::Validated, (camera, &ViewFiles::FUSED), &result.validated(), result)
    }

    fn write_maps(
        &self,
        name: &str,
        kind: MapKind,
        (camera, files): (&Camera, &ViewFiles),
        maps: &Maps,
        result: &ViewResult,
    ) -> Result<()> {
        let (width, height) = (camera.width, camera.height);
        if files.depth {
            write_depth_map(&self.depth_map(name, kind), width, height, &maps.depth)?;
        }
        if files.normals {
            write_normal_map(&self.normal_map(name, kind), width, height, &maps.normal)?;
        }
        if files.confidence {
            let is_estimated = maps.depth.iter().map(|&depth| depth > 0.0);
            let confidence: Vec<f32> = (result.confidence.iter().zip(is_estimated))
                .map(|(&confidence, is_estimated)| if is_estimated { confidence } else { 0.0 })
                .collect();
            write_depth_map(&self.confidence_map(name, kind), width, height, &confidence)?;
        }
        if !files.graphs {
            return Ok(());
        }
        write_consistency_graph(&self.consistency_graph(name, kind), width, height, |pixel| {
            let estimated = maps.depth[pixel] > 0.0;
            let sources = result.view_sets.iter(pixel).filter(move |_| estimated);
            sources.map(|source| result.sources[source])
        })
    }
}
