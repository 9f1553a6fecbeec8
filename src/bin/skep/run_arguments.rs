//! The arguments of a whole run, for `skep reconstruct` and `skep plan`.

use crate::arguments::{bytes, setting};
use crate::options_file;
use crate::output_arguments::{BoundsArguments, OutputArguments};
use crate::progress::Messages;
use clap::{Args, ValueEnum};
use skep::{DepthRange, Error, Options, Result};
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Run {
    /// Folder with images/ and a COLMAP model in sparse/ or sparse/0/, of any camera model; or a scene of
    /// another program (`skep help reconstruct` lists them)
    pub scene: PathBuf,
    /// Folder of the results [default: SCENE/dense; of a scene that is a file, dense beside it]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Set of option values to start from: default has the best quality; fast takes less than half of its
    /// time; paper follows the paper literally and is slow
    #[arg(long, default_value = "default", value_parser = Options::PRESETS)]
    pub preset: String,
    /// Start from the options in FILE instead of a preset: a report.json, for the options of its run, or an
    /// object with options by name and, as `preset`, the preset that they change. Threads, memory and the
    /// instruction set are not taken
    #[arg(long, value_name = "FILE", conflicts_with = "preset")]
    options: Option<PathBuf>,
    /// Worker threads at most; 0 uses one for each core. At most four for each core are started, and no more
    /// than the images keep busy. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    threads: usize,
    /// Seed of the random generator; the same seed gives the same result [default: 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Depth range to search in every view, in units of the model, instead of that of the sparse points
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], allow_negative_numbers = true)]
    depth_range: Option<Vec<f64>>,
    #[command(flatten)]
    input: Input,
    /// Parts of the method to leave out, separated by commas
    #[arg(long, value_name = "PARTS", value_delimiter = ',')]
    without: Vec<Part>,
    /// Set an option; `skep info` lists names and values, `skep info NAME` explains one. May be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Leave pixels of a smaller confidence, 0 to 1, out of the cloud
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    min_confidence: Option<f64>,
    /// Scales to search instead of the preset's, from coarse to fine, the last at full size, such as
    /// 'downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1': half size
    /// with 3 food sources a pixel, 5 iterations in the first cycle and 4 more cycles of 1, then full size
    #[arg(long, value_name = "SCALES")]
    schedule: Option<String>,
    /// Memory to keep to, such as 8GiB; the result does not depend on it [default: three quarters of what
    /// the machine or its control group allows]
    #[arg(long, value_name = "SIZE", value_parser = bytes, allow_hyphen_values = true)]
    memory: Option<u64>,
    #[command(flatten)]
    pub files: OutputArguments,
    /// Begin anew where a run in the folder would go on
    #[arg(long)]
    pub fresh: bool,
    #[command(flatten)]
    pub messages: Messages,
}

/// What is taken from the scene.
#[derive(Args)]
pub struct Input {
    /// Reduce photographs whose longer side has more pixels; the maps have the reduced size
    #[arg(long, value_name = "PIXELS", allow_negative_numbers = true)]
    max_image_size: Option<u32>,
    /// Photographs to take: names or patterns with * and ?, separated by commas, or a file with one on each
    /// line
    #[arg(long, value_name = "NAMES|FILE")]
    images: Option<String>,
    /// Photographs that get maps, in the same form; of the others only the source views of these are taken
    #[arg(long, value_name = "NAMES|FILE")]
    reference: Option<String>,
    /// Folder of masks, NAME.png for the photograph NAME: where a mask is 0, nothing is estimated
    #[arg(long, value_name = "DIR")]
    masks: Option<String>,
    /// Ignore pixels of alpha 0 like masked ones
    #[arg(long)]
    alpha_mask: bool,
    /// File with the source views of each view, in the layout of COLMAP's patch-match.cfg
    #[arg(long, value_name = "FILE")]
    sources: Option<String>,
    /// File with depth ranges of views, lines NAME NEAR FAR; other views have that of the sparse points
    #[arg(long, value_name = "FILE")]
    depth_ranges: Option<String>,
    #[command(flatten)]
    bounds: BoundsArguments,
}

impl Input {
    fn set(&self, options: &mut Options) -> Result<()> {
        self.bounds.apply(options)?;
        let texts = [
            ("input.max_image_size", self.max_image_size.map(|size| size.to_string())),
            ("input.images", self.images.clone()),
            ("input.reference", self.reference.clone()),
            ("input.masks", self.masks.clone()),
            ("input.alpha_mask", self.alpha_mask.then(|| true.to_string())),
            ("input.sources", self.sources.clone()),
            ("input.depth_ranges", self.depth_ranges.clone()),
        ];
        texts.iter().try_for_each(|(name, text)| text.iter().try_for_each(|text| options.set(name, text)))
    }
}

/// A part of the method that can be left out.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Refinement of the view set of each pixel by incident angle and visibility
    ViewSelection,
    /// Reward of planes that come from validated neighbors
    Reward,
    /// Propagation of consistent planes to other views
    Propagation,
}

impl Run {
    /// The folder of the results.
    pub fn output(&self) -> PathBuf {
        let beside = || match self.scene.is_file() {
            true => self.scene.with_file_name("dense"),
            false => self.scene.join("dense"),
        };
        self.output.clone().unwrap_or_else(beside)
    }

    /// Files and folders that must be there.
    pub fn inputs(&self) -> Vec<&Path> {
        let Input { masks, sources, depth_ranges, .. } = &self.input;
        let named = [masks, sources, depth_ranges].into_iter().flatten().map(Path::new);
        std::iter::once(self.scene.as_path()).chain(named).chain(self.options.as_deref()).collect()
    }

    /// The preset, as changed by the other arguments.
    pub fn options(&self) -> Result<Options> {
        let mut options = Options::preset(&self.preset)?;
        if let Some(file) = &self.options {
            options_file::apply(file, &mut options)?;
        }
        options.threads = self.threads;
        options.seed = self.seed.unwrap_or(options.seed);
        options.memory = self.memory.unwrap_or(0);
        self.input.set(&mut options)?;
        for part in &self.without {
            match part {
                Part::ViewSelection => options.view_selection.pixelwise_view_selection = false,
                Part::Reward => options.search.smoothness_reward = 0.0,
                Part::Propagation => options.search.view_propagation = false,
            }
        }
        for (name, value) in &self.set {
            options.set(name, value)?;
        }
        if let Some(least) = self.min_confidence {
            options.fusion.min_confidence = least;
        }
        if let Some(scales) = &self.schedule {
            options.set("schedule.scales", scales)?;
        }
        self.files.apply(&mut options)?;
        Ok(options)
    }

    /// Returns an error if the folder of the masks is that of the photographs and has no masks beside them:
    /// photographs in PNG would be taken for masks, and others leave to guess what is wrong.
    pub fn check_masks(&self, options: &Options) -> Result<()> {
        let folder = options.input.masks.as_str();
        let images = match self.scene.is_file() {
            true => self.scene.with_file_name("images"),
            false => self.scene.join("images"),
        };
        let is_same =
            |other: &Path| matches!((images.canonicalize(), other.canonicalize()), (Ok(a), Ok(b)) if a == b);
        let is_mask = |entry: std::fs::DirEntry| {
            let name = entry.file_name();
            name.to_str()
                .and_then(|name| name.strip_suffix(".png"))
                .is_some_and(|name| images.join(name).is_file())
        };
        let has_masks = || std::fs::read_dir(&images).is_ok_and(|entries| entries.flatten().any(is_mask));
        if !folder.is_empty() && is_same(folder.as_ref()) && !has_masks() {
            let expected = "a folder of masks, NAME.png for the photograph NAME; this one is that of the \
                            photographs";
            return Err(Error::argument("options.input.masks", folder, expected));
        }
        Ok(())
    }

    /// The depth range of `--depth-range`, checked.
    pub fn depth_range(&self) -> Result<Option<DepthRange>> {
        let Some(&[near, far]) = self.depth_range.as_deref() else { return Ok(None) };
        let range = DepthRange { near, far };
        range.check("--depth-range")?;
        Ok(Some(range))
    }
}
