//! OpenMVS' depth maps, the layout `DR`:
//!
//! ```text
//! "DR"  u8 content (1 depth, 2 normals, 4 confidence)  u8 0
//! u32 width, height of the photograph; the same of the map  f32 smallest, largest depth
//! u16 length, path of the photograph  u32 count, numbers of the view and its neighbors
//! f64 K, R (row by row), center  f32 depth, normals (3 each), confidence, row by row
//! ```
//!
//! All little-endian. Pixel centers are whole numbers, as in the crate.

use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::io::colmap_maps::check_length;
use crate::io::files::write_file;
use crate::scene::Maps;
use std::io::{self, Write};
use std::path::Path;

const HAS_DEPTH: u8 = 1;
const HAS_NORMAL: u8 = 2;
const HAS_CONFIDENCE: u8 = 4;
/// Views in a file at most, with its own.
const MOST_VIEWS: usize = 255;

/// What a depth map of OpenMVS holds.
#[derive(Debug, Clone, Copy)]
pub struct DepthMapFile<'a> {
    /// Path of the photograph, absolute or relative to the folder of the file.
    pub photograph: &'a str,
    /// Its camera, and that of the maps.
    pub camera: &'a Camera,
    /// Number of the view.
    pub view: u32,
    /// Numbers of the views that see the same surfaces, the best first; 254 at most are written.
    pub neighbors: &'a [u32],
    /// Depths and normals.
    pub maps: &'a Maps,
    /// Confidences, if there are any.
    pub confidence: Option<&'a [f32]>,
}

/// Writes a depth map for OpenMVS.
///
/// # Errors
/// Maps that do not fill the camera's size; a path of more than 65535 bytes; a file that cannot be written.
pub fn write_dmap(path: &Path, content: &DepthMapFile) -> Result<()> {
    let DepthMapFile { photograph, camera, view, neighbors, maps, confidence } = *content;
    let (width, height) = (camera.width, camera.height);
    check_length("depth map", width, height, maps.depth.len())?;
    check_length("normal map", width, height, maps.normal.len())?;
    confidence.map_or(Ok(()), |values| check_length("confidence map", width, height, values.len()))?;
    let name_length = u16::try_from(photograph.len()).map_err(|_| {
        Error::argument(
            "photograph",
            format!("{} bytes long", photograph.len()),
            "a path of 65535 bytes at most",
        )
    })?;
    let neighbors = &neighbors[..neighbors.len().min(MOST_VIEWS - 1)];
    let depths = maps.depth.iter().copied().filter(|depth| *depth > 0.0);
    let (near, far) =
        depths.fold((f32::INFINITY, 0.0f32), |(near, far), depth| (near.min(depth), far.max(depth)));
    let has_confidence = if confidence.is_some() { HAS_CONFIDENCE } else { 0 };
    write_file(path, |out| {
        out.write_all(&[b'D', b'R', HAS_DEPTH | HAS_NORMAL | has_confidence, 0])?;
        u32s(out, &[width, height, width, height])?;
        f32s(out, &[near.min(far), far])?;
        out.write_all(&name_length.to_le_bytes())?;
        out.write_all(photograph.as_bytes())?;
        u32s(out, &[1 + neighbors.len() as u32, view])?;
        u32s(out, neighbors)?;
        // Row by row.
        f64s(out, &camera.calibration().transpose().to_cols_array())?;
        f64s(out, &camera.rotation.transpose().to_cols_array())?;
        f64s(out, &camera.center().to_array())?;
        f32s(out, &maps.depth)?;
        f32s(out, maps.normal.as_flattened())?;
        f32s(out, confidence.unwrap_or_default())
    })
}

fn u32s(out: &mut impl Write, numbers: &[u32]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

fn f32s(out: &mut impl Write, numbers: &[f32]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

fn f64s(out: &mut impl Write, numbers: &[f64]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}
