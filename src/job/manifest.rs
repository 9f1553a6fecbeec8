//! The manifest of a run: what it is made from. Two runs with equal manifests give the same bits.

use crate::error::{Error, Result};
use crate::geometry::DepthRange;
use crate::io::{ColmapModel, cannot_be_read, write_file};
use crate::io::{Fingerprint, text};
use crate::options::Options;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{ErrorKind, Write};
use std::path::Path;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// The options that do not change the result.
const WITHOUT_EFFECT: [&str; 3] = ["threads", "memory", "simd"];
/// The options on which only the cloud depends, but for the group [`FUSION`].
const OF_CLOUD: [&str; 2] = ["output.cloud_format", "output.splat"];
const FUSION: &str = "fusion.";

/// What a run is made from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// The program's version and a fingerprint of its source.
    pub version: String,
    /// The options that change the result, by name, as texts.
    pub options: BTreeMap<String, String>,
    /// The depth range of every view, if one was given.
    pub depth_range: Option<[f64; 2]>,
    /// Fingerprint of cameras, poses and points.
    pub model: String,
    /// In the order of the views.
    pub photographs: Vec<PhotographEntry>,
}

/// A photograph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PhotographEntry {
    pub name: String,
    pub content: Fingerprint,
    /// Its mask, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask: Option<Fingerprint>,
    /// Its depth range, if the scene says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_range: Option<[f64; 2]>,
    /// Its source views, if the scene says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sources: Option<Vec<u32>>,
    /// Whether it gets no maps.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_source_only: bool,
}

impl PhotographEntry {
    pub(super) fn depth_range(&self) -> Option<DepthRange> {
        self.depth_range.map(|[near, far]| DepthRange { near, far })
    }
}

impl Manifest {
    pub(super) fn new(
        model: &ColmapModel,
        photographs: Vec<PhotographEntry>,
        depth_range: Option<DepthRange>,
        options: &Options,
    ) -> Manifest {
        let has_effect = |(name, _): &(&str, _)| !WITHOUT_EFFECT.contains(name);
        let texts =
            options.values().filter(has_effect).map(|(name, value)| (name.to_owned(), value.to_string()));
        Manifest {
            version: concat!(env!("CARGO_PKG_VERSION"), "+", env!("SKEP_SOURCE_FINGERPRINT")).to_owned(),
            options: texts.collect(),
            depth_range: depth_range.map(|range| [range.near, range.far]),
            model: model_fingerprint(model),
            photographs,
        }
    }

    /// The name of the run in its files. Options on which only the cloud depends do not change it.
    pub(super) fn run(&self) -> u64 {
        let mut of_maps = self.clone();
        of_maps.options.retain(|name, _| !(OF_CLOUD.contains(&name.as_str()) || name.starts_with(FUSION)));
        xxh3_64(&serde_json::to_vec(&of_maps).unwrap_or_default())
    }

    /// The options of the run; those without effect on the result keep these values.
    ///
    /// # Errors
    /// An option of another version.
    pub(super) fn options(&self, others: &Options) -> Result<Options> {
        let mut options = others.clone();
        self.options.iter().try_for_each(|(name, value)| options.set(name, value))?;
        Ok(options)
    }

    /// Whether the run was made from this model.
    pub(super) fn is_of_model(&self, model: &ColmapModel) -> bool {
        self.model == model_fingerprint(model)
    }

    /// The depth range of every view, if one was given.
    pub(super) fn depth_range(&self) -> Option<DepthRange> {
        self.depth_range.map(|[near, far]| DepthRange { near, far })
    }

    /// Reads the file; `None` where there is none.
    ///
    /// # Errors
    /// A file that cannot be read or is damaged.
    pub(super) fn read(path: &Path) -> Result<Option<Manifest>> {
        let bytes = match std::fs::read(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            read => read.map_err(|error| cannot_be_read(path, error))?,
        };
        let read = serde_json::from_slice(&bytes);
        read.map(Some).map_err(|error| Error::file(path, format!("not a manifest of a run: {error}")))
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        write_file(path, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }

    /// What differs from an earlier run, in words.
    pub(super) fn differences(&self, earlier: &Manifest) -> Vec<String> {
        let mut found = Vec::new();
        if self.version != earlier.version {
            found.push(format!("the version of skep ({} to {})", earlier.version, self.version));
        }
        for (name, value) in &self.options {
            let before = earlier.options.get(name).map_or("none", String::as_str);
            if before != value {
                found.push(format!("option {name} ({before} to {value})"));
            }
        }
        if self.depth_range != earlier.depth_range {
            found.push("the depth range".to_owned());
        }
        if self.model != earlier.model {
            found.push("the model (cameras, poses or points)".to_owned());
        }
        let named = |manifest: &Manifest| -> BTreeMap<String, PhotographEntry> {
            let entry = |entry: &PhotographEntry| (entry.name.clone(), entry.clone());
            manifest.photographs.iter().map(entry).collect()
        };
        let (before, after) = (named(earlier), named(self));
        let changed =
            after.iter().filter(|(name, content)| before.get(*name).is_some_and(|old| old != *content));
        let changed = changed.map(|(name, entry)| {
            let is_other = before.get(name).is_some_and(|old| old.content != entry.content);
            format!("{} {name}", if is_other { "photograph" } else { "mask, depth range, sources or use of" })
        });
        let added = after
            .keys()
            .filter(|name| !before.contains_key(*name))
            .map(|name| format!("photograph {name} (new)"));
        let gone = before
            .keys()
            .filter(|name| !after.contains_key(*name))
            .map(|name| format!("photograph {name} (gone)"));
        found.extend(changed.chain(added).chain(gone));
        found
    }
}

/// The fingerprint of everything in a model that a run reads.
fn model_fingerprint(model: &ColmapModel) -> String {
    let mut hash = Xxh3::new();
    for image in &model.images {
        let camera = &image.camera;
        hash.update(image.name.as_bytes());
        hash.update(&[0]);
        for side in [camera.width, camera.height] {
            hash.update(&side.to_le_bytes());
        }
        let rotation = camera.rotation.to_cols_array();
        let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy];
        for number in intrinsics.into_iter().chain(rotation).chain(camera.translation.to_array()) {
            hash.update(&number.to_bits().to_le_bytes());
        }
    }
    for point in &model.points {
        for number in point.position.to_array() {
            hash.update(&number.to_bits().to_le_bytes());
        }
        for view in &point.views {
            hash.update(&view.to_le_bytes());
        }
        hash.update(&u32::MAX.to_le_bytes());
    }
    text(hash.digest())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::fingerprint;

    fn manifest() -> Manifest {
        let photograph = |name: &str| {
            let content = fingerprint(name.as_bytes());
            PhotographEntry {
                name: name.to_owned(),
                content,
                mask: None,
                depth_range: None,
                sources: None,
                is_source_only: false,
            }
        };
        let photographs = ["a.png", "b.png"].map(photograph).to_vec();
        Manifest::new(&ColmapModel::default(), photographs, None, &Options::default())
    }

    #[test]
    fn equal_inputs_are_one_run_and_options_without_effect_do_not_change_it() {
        let options = Options { threads: 7, memory: 1 << 30, ..Options::default() };
        let again = Manifest::new(&ColmapModel::default(), manifest().photographs, None, &options);
        assert_eq!((again.run(), again.differences(&manifest())), (manifest().run(), Vec::<String>::new()));
        let read = again.options(&options).unwrap();
        assert_eq!(read, options);
    }

    #[test]
    fn options_of_the_cloud_alone_do_not_make_another_run() {
        let mut options = Options::default();
        options.set("fusion.voxel_size", "0.5").unwrap();
        options.set("output.splat", "true").unwrap();
        let changed = Manifest::new(&ColmapModel::default(), manifest().photographs, None, &options);
        assert_eq!(changed.run(), manifest().run());
        assert_eq!(
            changed.differences(&manifest()),
            ["option fusion.voxel_size (0 to 0.5)", "option output.splat (false to true)"]
        );
        options.set("output.write", "+graphs").unwrap();
        let files = Manifest::new(&ColmapModel::default(), manifest().photographs, None, &options);
        assert_ne!(files.run(), manifest().run());
    }

    #[test]
    fn each_difference_is_named() {
        let mut changed = manifest();
        changed.version = "9.9".to_owned();
        changed.options.insert("seed".to_owned(), "3".to_owned());
        changed.depth_range = Some([1.0, 2.0]);
        changed.model = "other".to_owned();
        changed.photographs[0].content = fingerprint(b"other");
        changed.photographs[1].name = "c.png".to_owned();
        let found = changed.differences(&manifest());
        let expected = [
            "9.9",
            "option seed (0 to 3)",
            "depth range",
            "model",
            "photograph a.png",
            "photograph c.png (new)",
            "photograph b.png (gone)",
        ];
        assert_eq!(found.len(), expected.len(), "{found:?}");
        assert!(expected.iter().zip(&found).all(|(expected, found)| found.contains(expected)), "{found:?}");
        assert_ne!(changed.run(), manifest().run());
    }
}
