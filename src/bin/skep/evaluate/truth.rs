//! Folders of true depth and normal maps.

use super::float_maps::{read_npy, read_pfm};
use image::DynamicImage;
use skep::io::{Grid, read_depth_map, read_normal_map};
use skep::{Error, Result};
use std::path::{Path, PathBuf};

/// Endings of true maps, in the order of preference.
const ENDINGS: [&str; 7] = ["png", "pgm", "bin", "geometric.bin", "photometric.bin", "pfm", "npy"];

/// A folder of true maps.
pub struct Truth {
    depth: PathBuf,
    normal: Option<PathBuf>,
    /// Depth of the value 1 in pictures of integers, and where that was found.
    scale: Option<f64>,
}

impl Truth {
    /// Finds the maps: `folder` itself or `folder/depth`, and `normal` in or beside it. `scale` is the depth
    /// of the value 1 of integers; without one it is `depth_scale` of a `scene.json`.
    ///
    /// # Errors
    /// No such folder; a scale that is not above 0; a `scene.json` that cannot be read.
    pub fn find(folder: &Path, normals: Option<&Path>, scale: Option<f64>) -> Result<Truth> {
        if !folder.is_dir() {
            return Err(Error::argument("--truth", folder.display(), "a folder of depth maps"));
        }
        if let Some(normals) = normals
            && !normals.is_dir()
        {
            return Err(Error::argument("--truth-normals", normals.display(), "a folder of normal maps"));
        }
        let inner = folder.join("depth");
        let depth = if inner.is_dir() { inner } else { folder.to_owned() };
        let above = depth.join("..");
        let normal = normals.map(Path::to_owned).or_else(|| {
            [folder.join("normal"), above.join("normal")].into_iter().find(|folder| folder.is_dir())
        });
        let scale = match scale {
            Some(scale) if scale.is_finite() && scale > 0.0 => Some(scale),
            Some(scale) => return Err(Error::argument("--depth-scale", scale, "a number above 0")),
            None => {
                let files = [folder.join("scene.json"), above.join("scene.json")];
                files.iter().find(|file| file.is_file()).map(|file| scale_of(file)).transpose()?
            }
        };
        Ok(Truth { depth, normal, scale })
    }

    /// The folder of the depth maps.
    pub fn folder(&self) -> &Path {
        &self.depth
    }

    /// The true depths of a view, 0 where there is no surface; `None` if it has no map.
    ///
    /// # Errors
    /// A damaged map; one of integers whose scale is not known.
    pub fn depth(&self, name: &str) -> Result<Option<Grid<f32>>> {
        let Some(path) = find(&self.depth, name) else { return Ok(None) };
        let mut map = match ending(&path) {
            "bin" => read_depth_map(&path)?,
            "pfm" => single(read_pfm::<1>(&path)?),
            "npy" => single(read_npy::<1>(&path)?),
            _ => self.picture(&path)?,
        };
        for depth in &mut map.values {
            if !(depth.is_finite() && *depth > 0.0) {
                *depth = 0.0;
            }
        }
        Ok(Some(map))
    }

    /// The true normals of a view in the camera's axes; `None` if it has no map.
    ///
    /// # Errors
    /// A damaged map.
    pub fn normals(&self, name: &str) -> Result<Option<Grid<[f32; 3]>>> {
        let Some(folder) = &self.normal else { return Ok(None) };
        let Some(path) = find(folder, name) else { return Ok(None) };
        match ending(&path) {
            "bin" => read_normal_map(&path).map(Some),
            "pfm" => read_pfm::<3>(&path).map(Some),
            "npy" => read_npy::<3>(&path).map(Some),
            _ => {
                let picture = open(&path)?;
                let (width, height) = (picture.width(), picture.height());
                // 0 is -1, white 1.
                let pixels = picture.into_rgb32f();
                let values =
                    pixels.pixels().map(|pixel| pixel.0.map(|channel| channel * 2.0 - 1.0)).collect();
                Ok(Some(Grid { width, height, values }))
            }
        }
    }

    /// A picture of integers that are multiplied by the scale.
    fn picture(&self, path: &Path) -> Result<Grid<f32>> {
        let Some(scale) = self.scale else {
            let problem = "its integers are depths in an unknown unit; expected --depth-scale S, the \
                           depth of the value 1, or a scene.json with depth_scale";
            return Err(Error::file(path, problem));
        };
        let scaled = |value: f64| (value * scale) as f32;
        let picture = open(path)?;
        let (width, height) = (picture.width(), picture.height());
        let values = match picture {
            DynamicImage::ImageLuma8(pixels) => pixels.iter().map(|value| scaled((*value).into())).collect(),
            DynamicImage::ImageLuma16(pixels) => pixels.iter().map(|value| scaled((*value).into())).collect(),
            other => {
                let problem = format!("the picture is {:?}; expected one channel of integers", other.color());
                return Err(Error::file(path, problem));
            }
        };
        Ok(Grid { width, height, values })
    }
}

fn open(path: &Path) -> Result<DynamicImage> {
    let opened = image::ImageReader::open(path).and_then(image::ImageReader::with_guessed_format);
    let reader = opened.map_err(|error| Error::file(path, format!("cannot be read: {error}")))?;
    reader.decode().map_err(|error| Error::file(path, format!("cannot be read: {error}")))
}

/// The map of the view `name`: its name or its name without ending, with one of the known endings.
fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let stem = Path::new(name).with_extension("");
    let stems = [name.to_owned(), stem.to_string_lossy().into_owned()];
    let with = |stem: &String| ENDINGS.map(|ending| folder.join(format!("{stem}.{ending}")));
    stems.iter().flat_map(with).find(|path| path.is_file())
}

fn ending(path: &Path) -> &str {
    path.extension().and_then(|ending| ending.to_str()).unwrap_or_default()
}

fn single(map: Grid<[f32; 1]>) -> Grid<f32> {
    Grid { width: map.width, height: map.height, values: map.values.as_flattened().to_vec() }
}

fn scale_of(file: &Path) -> Result<f64> {
    let text = skep::io::read_text(file)?;
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|error| Error::file(file, error))?;
    let scale = json["depth_scale"].as_f64().filter(|scale| *scale > 0.0);
    scale.ok_or_else(|| {
        Error::file(file, format!("depth_scale is {}; expected a number above 0", json["depth_scale"]))
    })
}
