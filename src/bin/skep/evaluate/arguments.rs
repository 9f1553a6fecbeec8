//! The arguments of `skep evaluate`, and their help.

use crate::arguments::Resources;
use crate::progress::Messages;
use clap::{Args, ValueEnum};
use skep::io::MapKind;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Evaluate {
    /// Workspace whose depth maps are scored (--truth), or the scene whose photographs judge a cloud
    /// (--hold-out, --views); not needed to compare two clouds
    pub path: Option<PathBuf>,
    /// Cloud to score, a .ply, .las or .laz file
    #[arg(long, value_name = "FILE")]
    pub cloud: Option<PathBuf>,
    /// Folder of true depth maps named after the photographs, or with depth/ and normal/ in it. With --cloud
    /// the surface that they show is the truth for the cloud
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    #[command(flatten)]
    pub maps: MapArguments,
    /// True cloud to compare with, such as a laser scan
    #[arg(long, value_name = "FILE", requires = "cloud", conflicts_with = "truth")]
    pub truth_cloud: Option<PathBuf>,
    #[command(flatten)]
    pub distances: DistanceArguments,
    #[command(flatten)]
    pub region: RegionArguments,
    #[command(flatten)]
    pub held_out: HeldOutArguments,
    /// Write all scores into FILE as JSON, also those of single views
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write plots (SVG) and pictures of photographs that were left out (PNG) into DIR
    #[arg(long, value_name = "DIR")]
    pub plots: Option<PathBuf>,
    #[command(flatten)]
    pub resources: Resources,
    #[command(flatten)]
    pub messages: Messages,
}

impl Evaluate {
    /// The files and folders that it reads and that must be there.
    pub fn inputs(&self) -> Vec<&Path> {
        let Evaluate { path, cloud, truth, truth_cloud, maps, region, .. } = self;
        let RegionArguments { transform, crop, dtu_mask, dtu_plane, .. } = region;
        let of_maps = [path, truth, &maps.scene, &maps.truth_normals];
        let of_clouds = [cloud, truth_cloud, transform, crop, dtu_mask, dtu_plane];
        of_maps.into_iter().chain(of_clouds).flatten().map(PathBuf::as_path).collect()
    }
}

/// How depth maps are compared.
#[derive(Args)]
#[command(next_help_heading = "Depth maps (--truth)")]
pub struct MapArguments {
    /// Maps to score
    #[arg(long, value_name = "KIND", default_value = "validated")]
    pub kind: Kind,
    /// Folder with sparse/ that the maps belong to [default: PATH or the folder above it]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Depth of the value 1 in true maps that are pictures of 8 or 16 bits [default: depth_scale of a
    /// scene.json in DIR or above it]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub depth_scale: Option<f64>,
    /// Folder of true normal maps [default: DIR/normal, or normal beside DIR]
    #[arg(long, value_name = "DIR")]
    pub truth_normals: Option<PathBuf>,
    /// Relative errors of the depth below which it is right
    #[arg(
        long,
        value_name = "T,...",
        value_delimiter = ',',
        default_value = "0.001,0.002,0.005,0.01,0.02",
        allow_negative_numbers = true
    )]
    pub thresholds: Vec<f64>,
    /// Views that must see a point of the true surface for the completeness of a cloud, with its own
    #[arg(long, value_name = "N", default_value_t = 3, allow_negative_numbers = true)]
    pub min_views: usize,
}

/// How clouds are compared.
#[derive(Args)]
#[command(next_help_heading = "Clouds (--cloud with --truth-cloud or --truth)")]
pub struct DistanceArguments {
    /// Distances below which a point is right, in units of the clouds, for precision, recall and F
    #[arg(long, value_name = "D,...", value_delimiter = ',', allow_negative_numbers = true)]
    pub distances: Vec<f64>,
    /// Largest distance for the means [default: none; with --dtu-mask 20]
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    pub max_distance: Option<f64>,
    /// What becomes of larger distances in the means [default: clamp; with --dtu-mask drop]
    #[arg(long, value_name = "WHAT")]
    pub outliers: Option<Outliers>,
    /// Thin the cloud to this spacing before it is compared [default: none; with --dtu-mask 0.2]
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    pub voxel: Option<f64>,
    /// Thin the true cloud or surface to this spacing [default: as --voxel; with --dtu-mask none]
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    pub truth_voxel: Option<f64>,
    /// How clouds are thinned [default: mean; with --truth first, with --dtu-mask radius]
    #[arg(long, value_name = "HOW")]
    pub thinning: Option<Thinning>,
}

/// Which points count.
#[derive(Args)]
#[command(next_help_heading = "Regions of clouds")]
pub struct RegionArguments {
    /// Text file with the 4x4 matrix that moves the cloud into the frame of the true one
    #[arg(long, value_name = "FILE")]
    pub transform: Option<PathBuf>,
    /// Box in the frame of the truth outside of which no point counts
    #[arg(long, num_args = 6, value_names = crate::output_arguments::CORNERS, allow_negative_numbers = true)]
    pub crop_box: Option<Vec<f64>>,
    /// The same with the polygon of a JSON file, as Tanks and Temples has them
    #[arg(long, value_name = "FILE")]
    pub crop: Option<PathBuf>,
    /// Observation mask of DTU: a MATLAB file with ObsMask, BB and Res
    #[arg(long, value_name = "FILE", requires = "truth_cloud")]
    pub dtu_mask: Option<PathBuf>,
    /// Ground plane of DTU: a MATLAB file with P
    #[arg(long, value_name = "FILE", requires = "dtu_mask")]
    pub dtu_plane: Option<PathBuf>,
}

/// How photographs judge a cloud.
#[derive(Args)]
#[command(next_help_heading = "Photographs (without truth)")]
pub struct HeldOutArguments {
    /// Leave out every Nth photograph in the order of their names, reconstruct from the others into --output,
    /// and compare the cloud with those left out
    #[arg(long, value_name = "N", conflicts_with_all = ["truth", "truth_cloud", "cloud", "views"])]
    pub hold_out: Option<usize>,
    /// The first photograph that is left out, counted from 0
    #[arg(long, value_name = "K", default_value_t = 0, requires = "hold_out", allow_negative_numbers = true)]
    pub first: usize,
    /// Folder of the reconstruction [default: SCENE/held-out]
    #[arg(short, long, value_name = "DIR", requires = "hold_out")]
    pub output: Option<PathBuf>,
    /// Preset of the reconstruction
    #[arg(long, value_name = "PRESET", requires = "hold_out")]
    pub preset: Option<String>,
    /// Further arguments of `skep reconstruct`
    #[arg(last = true, value_name = "ARGUMENTS", requires = "hold_out")]
    pub reconstruct: Vec<String>,
    /// Photographs to compare --cloud with, which must not have been used for it: names separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "cloud")]
    pub views: Vec<String>,
}

/// A kind of depth maps.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Pixels that other views confirm
    Validated,
    /// The estimate of every pixel
    Raw,
}

impl From<Kind> for MapKind {
    fn from(kind: Kind) -> MapKind {
        match kind {
            Kind::Validated => MapKind::Validated,
            Kind::Raw => MapKind::Raw,
        }
    }
}

/// What becomes of distances beyond the largest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Outliers {
    /// They count as the largest one
    Clamp,
    /// They do not count in the means
    Drop,
}

/// How a cloud is thinned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Thinning {
    /// The mean of the points in each cube
    Mean,
    /// The first point in each cube
    First,
    /// Points in random order, each unless one that is kept lies within SIZE
    Radius,
}
