//! Depth ranges of views in a file.

use super::SourceScene;
use crate::error::{Error, Result};
use crate::geometry::DepthRange;
use crate::io::read_text;
use std::collections::HashMap;
use std::path::Path;

/// Takes the depth ranges of a file: lines with the name of a photograph, the smallest and the largest depth
/// of its surfaces in world units. Photographs that it does not name keep what they have.
///
/// # Errors
/// A file that cannot be read; a line that is not of that form; a name that the scene does not have, or that
/// the file has twice; a range that is not 0 < near < far.
pub(super) fn read_depth_ranges(scene: &mut SourceScene, path: &Path) -> Result<()> {
    let text = read_text(path)?;
    let mut ranges: HashMap<&str, DepthRange> = HashMap::new();
    let names: HashMap<String, usize> =
        (0..).zip(&scene.photographs).map(|(index, photograph)| (photograph.name.clone(), index)).collect();
    for (number, line) in (1..).zip(text.lines().map(str::trim)) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let refused = |problem: String| Error::line(path, number, problem);
        let not_a_range = || refused(format!("{line:?} is no depth range; expected NAME NEAR FAR"));
        // The name may have spaces.
        let mut fields = line.rsplitn(3, char::is_whitespace);
        let mut depth = || fields.next().and_then(|field| field.parse::<f64>().ok()).ok_or_else(not_a_range);
        let (far, near) = (depth()?, depth()?);
        let name = fields.next().map(str::trim).ok_or_else(not_a_range)?;
        let Some(&photograph) = names.get(name) else {
            return Err(refused(format!("{name:?} is no photograph of the scene; expected a name")));
        };
        let range = DepthRange { near, far };
        range.check("depth range").map_err(|error| refused(error.to_string()))?;
        if ranges.insert(name, range).is_some() {
            return Err(refused(format!("{name} has a depth range already")));
        }
        scene.photographs[photograph].depth_range = Some(range);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn read(text: &str) -> Result<Vec<Option<DepthRange>>> {
        let mut scene = testing::source_scene(&["a b.jpg", "c.jpg"]);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_depth_ranges(&mut scene, file.path())?;
        Ok(scene.photographs.into_iter().map(|photograph| photograph.depth_range).collect())
    }

    #[test]
    fn ranges_are_read_by_name() {
        let range = Some(DepthRange { near: 1.5, far: 9.0 });
        assert_eq!(read("# of the first\na b.jpg 1.5 9\n").unwrap(), [range, None]);
        assert_eq!(read("c.jpg\t1.5\t9\na b.jpg  1.5 9").unwrap(), [range, range]);
    }

    #[test]
    fn what_is_no_range_is_refused_with_its_line() {
        for (text, part) in [
            ("\nx.jpg 1 2", "line 2: \"x.jpg\""),
            ("c.jpg 1", "line 1: \"c.jpg 1\" is no depth range; expected NAME NEAR FAR"),
            ("c.jpg near far", "line 1: \"c.jpg near far\""),
            ("c.jpg 2 1", "line 1: "),
            ("c.jpg 1 2\nc.jpg 1 3", "line 2: c.jpg has a depth range already"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
