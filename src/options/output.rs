//! What a run in a folder writes.

use crate::error::{Error, Result};
use std::fmt;
use std::path::Path;

/// What a run in a folder writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OutputOptions {
    /// The files of each view.
    pub write: ViewFiles,
    /// The format of the cloud.
    pub cloud_format: CloudFormat,
    /// Write a scene for Gaussian splatting too, in `splat/`.
    pub splat: bool,
}

/// A format of clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CloudFormat {
    /// PLY, as COLMAP writes it.
    #[default]
    Ply,
    /// LAS 1.4.
    Las,
    /// The same, compressed.
    Laz,
}

impl CloudFormat {
    /// All formats.
    pub const ALL: [CloudFormat; 3] = [CloudFormat::Ply, CloudFormat::Las, CloudFormat::Laz];

    /// Its name, the ending of files.
    pub fn name(self) -> &'static str {
        match self {
            CloudFormat::Ply => "ply",
            CloudFormat::Las => "las",
            CloudFormat::Laz => "laz",
        }
    }

    /// The format of this name.
    ///
    /// # Errors
    /// No such format, or one that this build does not have.
    pub fn from_name(name: &str) -> Result<CloudFormat> {
        CloudFormat::find(name, "cloud format")
    }

    /// The format of a file by its ending.
    ///
    /// # Errors
    /// Another ending, or none; a format that this build does not have.
    pub fn of_file(path: &Path) -> Result<CloudFormat> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        CloudFormat::find(&ending.to_lowercase(), &format!("ending of {}", path.display()))
    }

    fn find(name: &str, what: &str) -> Result<CloudFormat> {
        let found = CloudFormat::ALL.into_iter().find(|format| format.name() == name);
        let found = found.ok_or_else(|| {
            Error::argument(what, format!("`{name}`"), format!("one of {}", CloudFormat::names()))
        })?;
        found.check()?;
        Ok(found)
    }

    fn names() -> String {
        CloudFormat::ALL.map(CloudFormat::name).join(", ")
    }

    /// Returns an error for a format that this build does not have.
    pub(crate) fn check(self) -> Result<()> {
        if self == CloudFormat::Ply || cfg!(feature = "las") {
            return Ok(());
        }
        Err(Error::argument("cloud format", self.name(), "ply, or a build with the feature `las`"))
    }
}

/// The files that a run writes for each view, besides those that it needs until the cloud is written.
///
/// # Examples
/// ```
/// use skep::ViewFiles;
///
/// let more: ViewFiles = "+graphs".parse()?;
/// assert_eq!(more.to_string(), "depth,normals,confidence,status,graphs,previews");
/// let only: ViewFiles = "depth,status".parse()?;
/// assert!(only.depth && only.status && !only.normals);
/// # Ok::<(), skep::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewFiles {
    /// Depth maps.
    pub depth: bool,
    /// Normal maps.
    pub normals: bool,
    /// Confidence maps.
    pub confidence: bool,
    /// The status of each pixel.
    pub status: bool,
    /// Consistency graphs: the view set of each pixel.
    pub graphs: bool,
    /// Previews.
    pub previews: bool,
}

impl Default for ViewFiles {
    fn default() -> ViewFiles {
        let graphs = false;
        ViewFiles { depth: true, normals: true, confidence: true, status: true, graphs, previews: true }
    }
}

impl ViewFiles {
    /// All files.
    pub const ALL: ViewFiles = ViewFiles {
        depth: true,
        normals: true,
        confidence: true,
        status: true,
        graphs: true,
        previews: true,
    };

    /// No files.
    pub const NONE: ViewFiles = ViewFiles {
        depth: false,
        normals: false,
        confidence: false,
        status: false,
        graphs: false,
        previews: false,
    };

    /// The maps that the fusion reads; of the validated pixels alone.
    #[cfg(feature = "io")]
    pub(crate) const FUSED: ViewFiles =
        ViewFiles { status: false, graphs: false, previews: false, ..ViewFiles::ALL };

    const NAMES: [&'static str; 6] = ["depth", "normals", "confidence", "status", "graphs", "previews"];

    fn switches(&self) -> [bool; 6] {
        [self.depth, self.normals, self.confidence, self.status, self.graphs, self.previews]
    }

    fn from_switches([depth, normals, confidence, status, graphs, previews]: [bool; 6]) -> ViewFiles {
        ViewFiles { depth, normals, confidence, status, graphs, previews }
    }

    /// Whether all maps that the fusion reads are among them.
    pub fn has_fused_maps(&self) -> bool {
        self.depth && self.normals && self.confidence
    }
}

impl fmt::Display for ViewFiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = ViewFiles::NAMES.into_iter().zip(self.switches());
        let names: Vec<&str> = named.filter(|(_, is_on)| *is_on).map(|(name, _)| name).collect();
        f.write_str(&names.join(","))
    }
}

impl std::str::FromStr for ViewFiles {
    type Err = Error;

    fn from_str(text: &str) -> Result<ViewFiles> {
        let error = || {
            let names = ViewFiles::NAMES.join(", ");
            let expected = format!(
                "a list of {names}, separated by commas, or with + or - before each name of the list to \
                 change the default"
            );
            Error::argument("options.output.write", format!("`{text}`"), expected)
        };
        let entries: Vec<&str> = text.split(',').map(str::trim).collect();
        let changes = |entry: &&str| entry.starts_with(['+', '-']);
        let is_change = entries.iter().any(changes);
        if is_change && !entries.iter().all(changes) {
            return Err(error());
        }
        let mut switches = if is_change { ViewFiles::default().switches() } else { [false; 6] };
        for entry in entries {
            let name = entry.trim_start_matches(['+', '-']);
            let place = ViewFiles::NAMES.iter().position(|known| *known == name).ok_or_else(error)?;
            switches[place] = !entry.starts_with('-');
        }
        Ok(ViewFiles::from_switches(switches))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_files_replace_or_change_the_default_and_are_read_as_they_are_displayed() {
        let parsed = |text: &str| text.parse::<ViewFiles>().map(|files| files.to_string());
        assert_eq!(ViewFiles::default().to_string(), "depth,normals,confidence,status,previews");
        assert_eq!(parsed("+graphs, -previews"), Ok("depth,normals,confidence,status,graphs".to_owned()));
        assert_eq!(parsed("previews,depth"), Ok("depth,previews".to_owned()));
        assert_eq!(ViewFiles::ALL.to_string().parse(), Ok(ViewFiles::ALL));
        for wrong in ["", "depths", "depth,+graphs", "+", "depth,,previews"] {
            let text = parsed(wrong).unwrap_err().to_string();
            assert!(text.contains("depth, normals, confidence, status, graphs, previews"), "{text}");
        }
    }

    #[test]
    fn the_ending_of_a_file_names_the_format_of_the_cloud() {
        assert_eq!(CloudFormat::of_file(Path::new("a/b.PLY")), Ok(CloudFormat::Ply));
        let text = CloudFormat::of_file(Path::new("cloud.xyz")).unwrap_err().to_string();
        assert_eq!(text, "ending of cloud.xyz is `xyz`; expected one of ply, las, laz");
        assert_eq!(CloudFormat::of_file(Path::new("c.laz")).is_ok(), cfg!(feature = "las"));
        assert!(CloudFormat::of_file(Path::new("ply")).is_err());
    }
}
