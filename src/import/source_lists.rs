//! Lists of source views in a file, in the layout of COLMAP's `patch-match.cfg`.

use super::SourceScene;
use crate::error::{Error, Result};
use crate::io::read_text;
use std::collections::HashMap;
use std::path::Path;

/// Takes the source views of a file: for each photograph a line with its name and one with the names of its
/// sources, separated by commas, the best first; or `__all__`, or `__auto__, N`, which leaves the choice to
/// the triangulation angles. Photographs that the file does not name keep what they have.
///
/// # Errors
/// A file that cannot be read; a name that the scene does not have; a photograph that is its own source.
pub(super) fn read_source_lists(scene: &mut SourceScene, path: &Path) -> Result<()> {
    let text = read_text(path)?;
    let indices: HashMap<String, u32> = (0u32..)
        .zip(&scene.photographs)
        .map(|(index, photograph)| (photograph.name.clone(), index))
        .collect();
    let index = |name: &str, line: usize| {
        indices.get(name).copied().ok_or_else(|| {
            Error::line(path, line, format!("{name:?} is no photograph of the scene; expected a name"))
        })
    };
    let is_data = |line: &(usize, &str)| !line.1.is_empty() && !line.1.starts_with('#');
    let mut lines = (1..).zip(text.lines().map(str::trim)).filter(is_data);
    while let Some((line, name)) = lines.next() {
        let view = index(name, line)?;
        let Some((line, list)) = lines.next() else {
            return Err(Error::line(path, line, format!("the sources of {name} are missing after it")));
        };
        let names: Vec<&str> = list.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
        let sources = match names.first() {
            Some(&"__auto__") => None,
            Some(&"__all__") => {
                Some((0..scene.photographs.len() as u32).filter(|&other| other != view).collect())
            }
            _ => {
                let mut sources = Vec::new();
                for name in names {
                    let source = index(name, line)?;
                    if source == view {
                        return Err(Error::line(path, line, format!("{name} is its own source")));
                    }
                    if !sources.contains(&source) {
                        sources.push(source);
                    }
                }
                Some(sources)
            }
        };
        scene.photographs[view as usize].sources = sources;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn read(text: &str) -> Result<Vec<Option<Vec<u32>>>> {
        let mut scene = testing::source_scene(&["a b.jpg", "c.jpg", "d.jpg"]);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_source_lists(&mut scene, file.path())?;
        Ok(scene.photographs.into_iter().map(|photograph| photograph.sources).collect())
    }

    #[test]
    fn names_all_and_automatic_lists_are_read() {
        let text = "# comment\na b.jpg\nd.jpg, c.jpg\nc.jpg\n__all__\n\nd.jpg\n__auto__, 20\n";
        assert_eq!(read(text).unwrap(), [Some(vec![2, 1]), Some(vec![0, 2]), None]);
        assert_eq!(read("c.jpg\nd.jpg").unwrap(), [None, Some(vec![2]), None]);
    }

    #[test]
    fn what_does_not_belong_is_refused_with_its_line() {
        for (text, part) in [
            ("x.jpg\nc.jpg", "line 1: \"x.jpg\""),
            ("c.jpg\nd.jpg, e", "line 2: \"e\""),
            ("c.jpg\nc.jpg", "line 2: c.jpg is its own"),
            ("c.jpg", "line 1: the sources of c.jpg"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
