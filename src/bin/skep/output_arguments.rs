//! The arguments on what a command writes.

use clap::{Args, ValueEnum};
use skep::{CloudFormat, Error, Options, Result, ViewFiles};
use std::path::{Path, PathBuf};

/// The numbers of a box.
pub const CORNERS: [&str; 6] = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"];

/// The part of the world that is wanted.
#[derive(Args)]
pub struct BoundsArguments {
    /// Box of the world in which surfaces are reconstructed, along the axes of the model
    #[arg(long, num_args = 6, value_names = CORNERS, allow_negative_numbers = true)]
    bounds: Option<Vec<f64>>,
    /// The same, from a file with the six numbers; lines that begin with # are comments
    #[arg(long, value_name = "FILE", conflicts_with = "bounds")]
    bounds_file: Option<PathBuf>,
}

impl BoundsArguments {
    /// Whether none of them is given.
    pub fn are_default(&self) -> bool {
        self.bounds.is_none() && self.bounds_file.is_none()
    }

    /// Sets the option, if it is given.
    ///
    /// # Errors
    /// A file that cannot be read; other than six numbers, or no box.
    pub fn apply(&self, options: &mut Options) -> Result<()> {
        const NAME: &str = "input.bounds";
        if let Some(numbers) = &self.bounds {
            let text: Vec<String> = numbers.iter().map(f64::to_string).collect();
            options.set(NAME, &text.join(" "))?;
        }
        if let Some(file) = &self.bounds_file {
            let text = skep::io::read_text(file)?;
            let lines: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with('#')).collect();
            let numbers = lines.join(" ");
            if numbers.trim().is_empty() {
                let expected = format!("it has no numbers; expected the six of options.{NAME}");
                return Err(Error::file(file, expected));
            }
            options.set(NAME, &numbers).map_err(|error| Error::file(file, error.to_string()))?;
        }
        Ok(())
    }
}

/// The cloud.
#[derive(Args)]
pub struct CloudArguments {
    /// Thin the cloud to one point in each cube with sides of SIZE, in units of the model
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    voxel: Option<f64>,
    /// Thin the cloud to N points at most, drawn at random
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_points: Option<u32>,
    /// Format of the cloud: ply, las or laz [default: ply]
    #[arg(long, value_name = "FORMAT", value_parser = CloudFormat::from_name)]
    cloud_format: Option<CloudFormat>,
    /// Also write a scene for Gaussian splatting beside the cloud: splat/images, and splat/sparse/0 with the
    /// cameras and the cloud as the points to start from
    #[arg(long)]
    splat: bool,
}

impl CloudArguments {
    /// Whether none of them is given.
    pub fn are_default(&self) -> bool {
        let CloudArguments { voxel, max_points, cloud_format, splat } = self;
        voxel.is_none() && max_points.is_none() && cloud_format.is_none() && !splat
    }

    /// Sets the options that are given.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn apply(&self, options: &mut Options) -> Result<()> {
        if let Some(size) = self.voxel {
            options.set_number("fusion.voxel_size", size)?;
        }
        if let Some(most) = self.max_points {
            options.fusion.max_points = most;
        }
        if let Some(format) = self.cloud_format {
            options.output.cloud_format = format;
        }
        options.output.splat |= self.splat;
        Ok(())
    }

    /// The file of the cloud: `output`, whose ending must be that of the format if both are given, else
    /// `fused.FORMAT` in the folder.
    ///
    /// # Errors
    /// Another ending.
    pub fn file(&self, output: Option<&Path>, folder: &Path, options: &Options) -> Result<PathBuf> {
        let Some(output) = output else {
            return Ok(folder.join(format!("fused.{}", options.output.cloud_format.name())));
        };
        let found = CloudFormat::of_file(output)?;
        match self.cloud_format {
            Some(format) if format != found => Err(skep::Error::argument(
                "--output",
                output.display(),
                format!("a name that ends in .{}, as --cloud-format says", format.name()),
            )),
            _ => Ok(output.to_owned()),
        }
    }
}

/// The files of a run.
#[derive(Args)]
pub struct OutputArguments {
    /// Files to write: for each view some of depth, normals, confidence, status, graphs, previews, and
    /// report, the page report.html; with + or - before each they are added to the default or left out
    /// [default: depth,normals,confidence,status,previews,report]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    write: Option<WrittenFiles>,
    #[command(flatten)]
    cloud: CloudArguments,
}

impl OutputArguments {
    /// Sets the options that are given.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn apply(&self, options: &mut Options) -> Result<()> {
        if let Some(files) = self.write {
            options.output.write = files.of_views;
        }
        self.cloud.apply(options)
    }

    /// Whether the page is wanted.
    pub fn has_page(&self) -> bool {
        self.write.is_none_or(|files| files.page)
    }
}

/// The files of a run that are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WrittenFiles {
    of_views: ViewFiles,
    /// `report.html`, which the library does not know.
    page: bool,
}

impl std::str::FromStr for WrittenFiles {
    type Err = skep::Error;

    fn from_str(text: &str) -> Result<WrittenFiles> {
        const PAGE: &str = "report";
        let is_page = |entry: &&str| entry.trim().trim_start_matches(['+', '-']) == PAGE;
        let (pages, others): (Vec<&str>, Vec<&str>) = text.split(',').partition(is_page);
        let is_change = |entry: &&str| entry.trim().starts_with(['+', '-']);
        let changes = text.split(',').all(|entry| is_change(&entry));
        if !changes && text.split(',').any(|entry| is_change(&entry)) {
            let expected = "all names with + or - before them, or none";
            return Err(skep::Error::argument("--write", format!("`{text}`"), expected));
        }
        let of_views = match (others.is_empty(), changes) {
            (true, true) => ViewFiles::default(),
            (true, false) => ViewFiles::NONE,
            _ => others.join(",").parse()?,
        };
        let page = pages.last().map_or(changes, |entry| !entry.trim().starts_with('-'));
        Ok(WrittenFiles { of_views, page })
    }
}

/// A format of maps.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ConvertFormat {
    /// Portable float maps, rows from the bottom to the top
    Pfm,
    /// Arrays of NumPy
    Npy,
    /// TIFF of 32-bit floats
    Tiff,
    /// Depth maps of OpenMVS, with normals and confidence
    Dmap,
}

#[derive(Args)]
pub struct Convert {
    /// Folder that holds stereo/depth_maps, of skep or of COLMAP
    pub workspace: PathBuf,
    /// Format of the maps
    #[arg(long, value_name = "FORMAT")]
    pub to: ConvertFormat,
    /// Folder for them: depth_maps/NAME.FORMAT, normal_maps and confidence_maps; dmap: depth0000.dmap and so
    /// on
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Folder with sparse/ that the maps belong to [default: WORKSPACE or the folder above it]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Take the photometric (raw) maps instead of the geometric (validated) ones
    #[arg(long)]
    pub raw: bool,
    /// Print warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_read_from_a_file_and_errors_name_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("box.txt");
        let read = |text: &str| {
            std::fs::write(&file, text).unwrap();
            let mut options = Options::default();
            let arguments = BoundsArguments { bounds: None, bounds_file: Some(file.clone()) };
            arguments.apply(&mut options).map(|()| options).map_err(|error| error.to_string())
        };
        let mut expected = Options::default();
        expected.set("input.bounds", "-1 -2 0 3 4 5.5").unwrap();
        let found = read("# least, most\n-1, -2, 0\n3\t4 5.5\n").unwrap().input.bounds();
        assert_eq!(found, expected.input.bounds());
        for wrong in ["", "1 2 3", "1 2 3 0 0 0", "a b c d e f"] {
            let error = read(wrong).unwrap_err();
            assert!(error.contains("box.txt") && error.contains("input.bounds"), "{wrong}: {error}");
        }
    }

    #[test]
    fn the_page_is_one_of_the_files() {
        let parsed = |text: &str| {
            let files = text.parse::<WrittenFiles>().map_err(|error| error.to_string())?;
            Ok::<_, String>((files.of_views.to_string(), files.page))
        };
        let default = ViewFiles::default().to_string();
        assert_eq!(parsed("-report"), Ok((default.clone(), false)));
        assert_eq!(parsed("+report"), Ok((default, true)));
        assert_eq!(
            parsed("+graphs, -report").map(|(files, page)| (files.contains("graphs"), page)),
            Ok((true, false))
        );
        assert_eq!(parsed("depth"), Ok(("depth".to_owned(), false)));
        assert_eq!(parsed("depth,report"), Ok(("depth".to_owned(), true)));
        assert_eq!(parsed("report"), Ok((String::new(), true)));
        assert_eq!(parsed("+graphs").map(|(_, page)| page), Ok(true));
        assert!(
            parsed("depth,-report").is_err()
                && parsed("+depth,report").is_err()
                && parsed("reports").is_err()
        );
    }
}
