//! OpenMVS: a file `*.mvs` of its interface archive, as `InterfaceCOLMAP` and other programs write it.
//!
//! The archive is a tree of records, little-endian; lists and texts are a u64 count and their entries. It
//! starts with `MVSI`, a u32 version and four unused bytes; files of version 0 have no such header. Pixel
//! centers are integers. Depth ranges and neighbors of images are not taken over: they come from the same
//! points that are read.

use super::calibration::{CALIBRATION, pinhole};
use super::photographs;
use super::poses::{ROTATION, from_rows, rotation};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Lens};
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::{FileReader, picture_size};
use crate::memory::require_memory;
use crate::scene::SparsePoint;
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

const MAGIC: [u8; 4] = *b"MVSI";
/// How files start that OpenMVS serializes for itself, compressed or not.
const OWN_MAGIC: [u8; 4] = *b"MVS\0";
const LATEST_VERSION: u32 = 7;
/// The index that stands for none.
const NONE: u32 = u32::MAX;
/// A normalized principal point is below this; others are in pixels.
const MAX_NORMALIZED: f64 = 3.0;
/// Memory for a byte of the file, mostly points with short lists of views.
const MEMORY_PER_BYTE: u64 = 4;

pub(super) fn is_at(path: &Path) -> bool {
    file(path).is_file()
}

/// A path that is a file, or `scene.mvs` in it.
fn file(path: &Path) -> PathBuf {
    if path.is_file() && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mvs")) {
        return path.to_owned();
    }
    path.join("scene.mvs")
}

/// Reads the archive; paths of images are relative to its folder.
///
/// # Errors
/// A project in OpenMVS's own serialization; a later version; a file that is truncated or longer than its
/// records; indices that do not exist; missing photographs.
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let path = file(path);
    let mut archive = Archive::open(&path)?;
    let platforms = archive.list(24, "platforms", Archive::platform)?;
    let images = archive.list(20, "images", Archive::image)?;
    let vertices = archive.list(20, "points", Archive::vertex)?;
    archive.finish()?;
    resolve(&path, &platforms, images, vertices)
}

struct Platform {
    cameras: Vec<PlatformCamera>,
    /// Rotations from the world to the platform, and the centers of the platform.
    poses: Vec<(DMat3, DVec3)>,
}

struct PlatformCamera {
    /// 0 where it is not known.
    size: (u32, u32),
    /// K, row by row.
    calibration: [f64; 9],
    rotation: DMat3,
    center: DVec3,
}

struct Image {
    name: String,
    mask: String,
    platform: u32,
    camera: u32,
    pose: u32,
}

struct Archive {
    reader: FileReader,
    version: u32,
}

impl Archive {
    /// Reads the header.
    fn open(path: &Path) -> Result<Archive> {
        let mut reader = FileReader::open(path)?;
        let bytes = reader.remaining();
        require_memory(bytes.saturating_mul(MEMORY_PER_BYTE), format!("the scene in {}", path.display()))?;
        match reader.bytes("the header")? {
            MAGIC => {
                let version = reader.u32("the version")?;
                if !(1..=LATEST_VERSION).contains(&version) {
                    let expected = format!("expected 1 to {LATEST_VERSION}");
                    return Err(reader.error(format!("the version of the archive is {version}; {expected}")));
                }
                reader.u32("the header")?;
                Ok(Archive { reader, version })
            }
            OWN_MAGIC => Err(reader.error(
                "is a project in OpenMVS's own serialization; expected the interface archive (MVSI), which \
                 OpenMVS's programs write with --archive-type -1",
            )),
            // Version 0 starts with its records.
            _ => Ok(Archive { reader: FileReader::open(path)?, version: 0 }),
        }
    }

    /// A list of records of so many bytes at least.
    fn list<T>(&mut self, bytes: u64, what: &str, record: fn(&mut Archive) -> Result<T>) -> Result<Vec<T>> {
        let count = self.reader.u64(what)?;
        self.reader.require(count, bytes, what)?;
        (0..count).map(|_| record(self)).collect()
    }

    fn text(&mut self, what: &str) -> Result<String> {
        let length = self.reader.u64(what)?;
        self.reader.require(length, 1, what)?;
        let mut bytes = vec![0; length as usize];
        self.reader.fill(&mut bytes, what)?;
        String::from_utf8(bytes).map_err(|error| self.reader.error(format!("{what} is not UTF-8: {error}")))
    }

    /// A rotation and a center.
    fn pose(&mut self) -> Result<(DMat3, DVec3)> {
        let r = self.reader.f64s::<9>("a rotation")?;
        let matrix = from_rows([[r[0], r[1], r[2]], [r[3], r[4], r[5]], [r[6], r[7], r[8]]]);
        let rotation = rotation(matrix)
            .ok_or_else(|| self.reader.error(format!("a rotation is {r:?}; expected {ROTATION}")))?;
        Ok((rotation, DVec3::from(self.reader.f64s::<3>("a position")?)))
    }

    fn platform(&mut self) -> Result<Platform> {
        self.text("a platform's name")?;
        let cameras = self.list(8 + 21 * 8, "a platform's cameras", Archive::camera)?;
        let poses = self.list(12 * 8, "a platform's poses", Archive::pose)?;
        Ok(Platform { cameras, poses })
    }

    fn camera(&mut self) -> Result<PlatformCamera> {
        self.text("a camera's name")?;
        if self.version > 3 {
            self.text("a camera's band")?;
        }
        let size = match self.version {
            0 => (0, 0),
            _ => (self.reader.u32("a camera's width")?, self.reader.u32("a camera's height")?),
        };
        let calibration = self.reader.f64s("a camera's calibration")?;
        let (rotation, center) = self.pose()?;
        Ok(PlatformCamera { size, calibration, rotation, center })
    }

    fn image(&mut self) -> Result<Image> {
        let name = self.text("an image's name")?;
        let mask = if self.version > 4 { self.text("an image's mask")? } else { String::new() };
        let [platform, camera, pose] = [
            self.reader.u32("an image's platform")?,
            self.reader.u32("an image's camera")?,
            self.reader.u32("an image's pose")?,
        ];
        if self.version > 2 {
            self.reader.u32("an image's number")?;
        }
        if self.version > 6 {
            self.reader.skip(3, 4, "an image's depths")?;
            self.skip_list(24, "an image's neighbors")?;
        }
        Ok(Image { name, mask, platform, camera, pose })
    }

    fn vertex(&mut self) -> Result<(DVec3, Vec<u32>)> {
        let mut position = [0.0; 3];
        for value in &mut position {
            *value = f64::from(f32::from_le_bytes(self.reader.bytes("a point")?));
        }
        let position = DVec3::from(position);
        if !position.is_finite() {
            return Err(self.reader.error(format!("a point is {position}; expected finite numbers")));
        }
        let view = |archive: &mut Archive| {
            let image = archive.reader.u32("a point's image")?;
            archive.reader.bytes::<4>("a point's confidence")?;
            Ok(image)
        };
        Ok((position, self.list(8, "a point's views", view)?))
    }

    fn skip_list(&mut self, bytes: u64, what: &str) -> Result<()> {
        let count = self.reader.u64(what)?;
        self.reader.skip(count, bytes, what)
    }

    /// Passes over what follows the points; nothing may follow that.
    fn finish(mut self) -> Result<()> {
        self.skip_list(12, "normals of points")?;
        self.skip_list(3, "colors of points")?;
        if self.version > 0 {
            let line = |archive: &mut Archive| {
                archive.reader.skip(6, 4, "a line")?;
                archive.skip_list(8, "a line's views")
            };
            self.list(32, "lines", line)?;
            self.skip_list(12, "normals of lines")?;
            self.skip_list(3, "colors of lines")?;
        }
        if self.version > 1 {
            self.reader.skip(16, 8, "the transform")?;
        }
        if self.version > 5 {
            self.reader.skip(15, 8, "the bounding box")?;
        }
        self.reader.finish()
    }
}

fn resolve(
    path: &Path,
    platforms: &[Platform],
    images: Vec<Image>,
    vertices: Vec<(DVec3, Vec<u32>)>,
) -> Result<SourceScene> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut paths, mut lenses, mut masks) = (Vec::new(), Vec::new(), Vec::new());
    // The photograph of each image, of those that have a pose.
    let mut indices = Vec::new();
    for (index, image) in images.iter().enumerate() {
        if image.pose == NONE {
            indices.push(None);
            continue;
        }
        let entry = format!("image {index} of {}", path.display());
        let file = photographs::find(folder.join(local(&image.name)), &entry)?;
        let size = picture_size(&file)?;
        lenses.push(
            lens(platforms, image, size).map_err(|problem| {
                Error::file(path, format!("image {index}, {:?}: {problem}", image.name))
            })?,
        );
        masks.push(match image.mask.is_empty() {
            true => None,
            false => {
                Some(photographs::find(folder.join(local(&image.mask)), &format!("the mask of {entry}"))?)
            }
        });
        indices.push(Some(paths.len() as u32));
        paths.push(file);
    }
    let mut points = Vec::with_capacity(vertices.len());
    for (index, (position, images)) in vertices.into_iter().enumerate() {
        let mut views = Vec::with_capacity(images.len());
        for image in images {
            let known = indices.get(image as usize).ok_or_else(|| {
                let count = indices.len();
                Error::file(path, format!("point {index} has the image {image}; expected one below {count}"))
            })?;
            views.extend(*known);
        }
        views.sort_unstable();
        views.dedup();
        points.push(SparsePoint { position, views });
    }
    let mut warnings = Vec::new();
    if paths.len() < images.len() {
        let count = images.len() - paths.len();
        warnings.push(format!("{count} of {} images have no pose and are left out", images.len()));
    }
    if masks.iter().any(Option::is_some) {
        let warning = "the images of labels are read as masks: nothing is estimated where the label is 0";
        warnings.push(warning.to_owned());
    }
    let names = photographs::names(&paths)?;
    let parts = names.into_iter().zip(paths).zip(lenses.into_iter().zip(masks));
    let photograph =
        |((name, path), (lens, mask))| SourcePhotograph { mask, ..SourcePhotograph::new(name, path, lens) };
    let origin = format!("the OpenMVS scene in {}", path.display());
    Ok(SourceScene {
        origin,
        photographs: parts.map(photograph).collect(),
        points,
        workspace: None,
        warnings,
    })
}

/// A path with this system's separators: archives that were written on Windows have the others.
fn local(path: &str) -> String {
    if path.contains('/') { path.to_owned() } else { path.replace('\\', "/") }
}

/// The camera of an image of this size; else what is wrong.
fn lens(
    platforms: &[Platform],
    image: &Image,
    (width, height): (u32, u32),
) -> std::result::Result<Lens, String> {
    fn at<'a, T>(list: &'a [T], index: u32, what: &str) -> std::result::Result<&'a T, String> {
        let count = list.len();
        list.get(index as usize).ok_or_else(|| format!("its {what} is {index}; expected one below {count}"))
    }
    let platform = at(platforms, image.platform, "platform")?;
    let camera = at(&platform.cameras, image.camera, "camera")?;
    let (rotation, center) = at(&platform.poses, image.pose, "pose")?;
    let side = f64::from(width.max(height));
    let is_normalized = camera.size.0 == 0 || camera.size.1 == 0;
    let scale = match camera.size {
        _ if is_normalized => side,
        size => side / f64::from(size.0.max(size.1)),
    };
    let [fx, fy, cx, cy] = pinhole(camera.calibration, scale)
        .ok_or_else(|| format!("its calibration is {:?}; expected {CALIBRATION}", camera.calibration))?;
    if is_normalized && !(cx < MAX_NORMALIZED && cy < MAX_NORMALIZED) {
        return Err(format!(
            "its principal point is {cx}, {cy} and its camera has no resolution; expected one divided by the \
             larger side of the image"
        ));
    }
    // Normalized principal points are just divided; those in pixels of another size keep the pixels' borders.
    let half = if is_normalized { 0.0 } else { 0.5 };
    let place = |place: f64| (place + half) * scale - half;
    let rotation_all = camera.rotation * *rotation;
    let center_all = rotation.transpose() * camera.center + *center;
    let camera = Camera {
        width,
        height,
        fx: fx * scale,
        fy: fy * scale,
        cx: place(cx),
        cy: place(cy),
        rotation: rotation_all,
        translation: -(rotation_all * center_all),
    };
    let lens = Lens { camera, distortion: None };
    lens.check("its camera").map_err(|error| error.to_string())?;
    Ok(lens)
}
