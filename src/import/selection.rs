//! The choice of photographs.

use super::{SourcePhotograph, SourceScene};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::{Photograph, Picture, PictureSource};
use crate::io::read_text;
use crate::options::Options;
use crate::scene::{Scene, View};
use crate::view_selection::source_lists;
use std::path::Path;
use std::sync::Arc;

/// Keeps the photographs that a text chooses: names or patterns with `*` (any letters) and `?` (one letter),
/// separated by commas, or the path of a file with one on each line. Points lose their views that are left
/// out; those that no chosen photograph saw are dropped where points have tracks.
///
/// # Errors
/// An entry that no photograph matches; fewer than two photographs.
pub(super) fn select(scene: &mut SourceScene, chosen: &str) -> Result<()> {
    const NAME: &str = "options.input.images";
    let Some(is_chosen) = chosen_by(scene, chosen, NAME)? else { return Ok(()) };
    let count = is_chosen.iter().filter(|&&is_chosen| is_chosen).count();
    if count < 2 {
        let value = format!("`{chosen}`, which is {count}");
        return Err(Error::argument(NAME, value, "at least 2 photographs"));
    }
    keep(scene, &is_chosen);
    Ok(())
}

/// Keeps the photographs that get maps, which a text chooses like that of [`select`], and their source views.
///
/// # Errors
/// An entry that no photograph matches; a scene that [`Scene::new`] refuses.
pub(super) fn select_references(scene: &mut SourceScene, options: &Options) -> Result<()> {
    let chosen = chosen_by(scene, &options.input.reference, "options.input.reference")?;
    let Some(is_reference) = chosen else { return Ok(()) };
    let lists = source_lists(&without_pixels(scene)?, options).lists;
    let mut is_kept = is_reference.clone();
    for (list, _) in lists.iter().zip(&is_reference).filter(|(_, is_reference)| **is_reference) {
        list.iter().for_each(|&source| is_kept[source as usize] = true);
    }
    for (photograph, is_reference) in scene.photographs.iter_mut().zip(is_reference) {
        photograph.is_reference = is_reference;
    }
    keep(scene, &is_kept);
    Ok(())
}

/// The photographs that a text chooses; `None` for all.
fn chosen_by(scene: &SourceScene, chosen: &str, name: &'static str) -> Result<Option<Vec<bool>>> {
    if chosen.trim().is_empty() {
        return Ok(None);
    }
    let mut is_chosen = vec![false; scene.photographs.len()];
    for entry in &entries(chosen)? {
        let mut is_used = false;
        for (photograph, is_chosen) in scene.photographs.iter().zip(&mut is_chosen) {
            if matches(entry.as_bytes(), photograph.name.as_bytes()) {
                (is_used, *is_chosen) = (true, true);
            }
        }
        if !is_used {
            let expected = match scene.photographs.first() {
                Some(first) => {
                    format!("the names of photographs, such as {}, or patterns of them", first.name)
                }
                None => "names of photographs".to_owned(),
            };
            return Err(Error::argument(name, format!("`{entry}`"), expected));
        }
    }
    Ok(Some(is_chosen))
}

/// Leaves out the other photographs.
fn keep(scene: &mut SourceScene, is_kept: &[bool]) {
    let mut index = 0;
    let new_index: Vec<Option<u32>> =
        is_kept.iter().map(|&is_kept| is_kept.then(|| (index, index += 1).0)).collect();
    let renumbered =
        |views: &[u32]| -> Vec<u32> { views.iter().filter_map(|&view| new_index[view as usize]).collect() };
    for point in &mut scene.points {
        let had_track = !point.views.is_empty();
        point.views = renumbered(&point.views);
        if had_track && point.views.is_empty() {
            point.position = glam::DVec3::NAN;
        }
    }
    scene.points.retain(|point| !point.position.is_nan());
    let mut place = 0..;
    scene.photographs.retain(|_| place.next().is_some_and(|place| is_kept[place]));
    for photograph in &mut scene.photographs {
        let had_sources = photograph.sources.as_ref().is_some_and(|sources| !sources.is_empty());
        photograph.sources = photograph.sources.as_deref().map(renumbered);
        // Whose sources are all left out takes others, as if none had been named.
        photograph.sources.take_if(|sources| had_sources && sources.is_empty());
    }
}

/// The scene for questions about poses and points alone. The distortion of lenses is left out.
fn without_pixels(scene: &SourceScene) -> Result<Scene> {
    let view = |photograph: &SourcePhotograph| View {
        name: photograph.name.clone(),
        picture: Photograph::Deferred(Arc::new(NoPixels(photograph.lens.camera))),
        camera: photograph.lens.camera,
        mask: None,
        depth_range: photograph.depth_range,
        sources: photograph.sources.clone(),
    };
    Scene::new(scene.photographs.iter().map(view).collect(), scene.points.clone())
}

/// Stands for a photograph that nobody loads.
#[derive(Debug)]
struct NoPixels(Camera);

impl PictureSource for NoPixels {
    fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    fn load(&self) -> Result<Picture> {
        Err(Error::argument("photograph", "none", "one that is loaded"))
    }
}

/// The names and patterns of a text or of the file at that path.
fn entries(chosen: &str) -> Result<Vec<String>> {
    let path = Path::new(chosen.trim());
    let list = match path.is_file() {
        true => read_text(path)?,
        false => chosen.replace(',', "\n"),
    };
    let lines = list.lines().map(str::trim);
    Ok(lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect())
}

/// Whether a name is of a pattern. Takes at most the product of their lengths in steps: only the last `*` is
/// ever tried again, as an earlier one could not make up for what follows the last.
fn matches(pattern: &[u8], name: &[u8]) -> bool {
    let (mut in_pattern, mut in_name) = (0, 0);
    // Behind the last `*`, and the end of what it stands for.
    let mut last_star: Option<(usize, usize)> = None;
    while let Some(&letter) = name.get(in_name) {
        match (pattern.get(in_pattern), last_star) {
            (Some(b'*'), _) => {
                in_pattern += 1;
                last_star = Some((in_pattern, in_name));
            }
            (Some(&wanted), _) if wanted == b'?' || wanted == letter => {
                in_pattern += 1;
                in_name += 1;
            }
            (_, Some((behind, end))) => {
                last_star = Some((behind, end + 1));
                (in_pattern, in_name) = (behind, end + 1);
            }
            (_, None) => return false,
        }
    }
    pattern[in_pattern..].iter().all(|&letter| letter == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DepthRange;
    use crate::scene::SparsePoint;
    use crate::testing;
    use glam::DVec3;

    fn scene() -> SourceScene {
        let mut scene = testing::source_scene(&["a/1.jpg", "a/2.jpg", "b/1.jpg", "b/10.jpg"]);
        scene.photographs.iter_mut().for_each(|photograph| photograph.sources = Some(vec![0, 1, 2]));
        let point = |views: &[u32]| SparsePoint { position: DVec3::ONE, views: views.to_vec() };
        scene.points = vec![point(&[0, 2, 3]), point(&[0, 1]), point(&[])];
        scene
    }

    fn chosen(text: &str) -> Vec<String> {
        let mut scene = scene();
        select(&mut scene, text).unwrap();
        scene.photographs.into_iter().map(|photograph| photograph.name).collect()
    }

    #[test]
    fn names_and_patterns_choose_photographs_in_the_order_of_the_scene() {
        assert_eq!(chosen(""), ["a/1.jpg", "a/2.jpg", "b/1.jpg", "b/10.jpg"]);
        assert_eq!(chosen("b/10.jpg, a/1.jpg"), ["a/1.jpg", "b/10.jpg"]);
        assert_eq!(chosen("*/1.jpg"), ["a/1.jpg", "b/1.jpg"]);
        assert_eq!(chosen("b*"), ["b/1.jpg", "b/10.jpg"]);
        assert_eq!(chosen("?/?.jpg"), ["a/1.jpg", "a/2.jpg", "b/1.jpg"]);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "# the first folder\na/*\n").unwrap();
        assert_eq!(chosen(file.path().to_str().unwrap()), ["a/1.jpg", "a/2.jpg"]);
    }

    #[test]
    fn references_are_kept_with_their_sources() {
        let mut scene = scene();
        for (view, sources) in [[1, 3], [2, 3], [3, 0], [0, 1]].into_iter().enumerate() {
            scene.photographs[view].sources = Some(sources.to_vec());
            scene.photographs[view].depth_range = Some(DepthRange { near: 1.0, far: 2.0 });
        }
        let mut options = Options::default();
        options.set("input.reference", "b/1.jpg").unwrap();
        select_references(&mut scene, &options).unwrap();
        let kept: Vec<_> =
            scene.photographs.iter().map(|own| (own.name.as_str(), own.is_reference)).collect();
        assert_eq!(kept, [("a/1.jpg", false), ("b/1.jpg", true), ("b/10.jpg", false)]);
        assert_eq!(scene.photographs[1].sources, Some(vec![2, 0]));
        assert_eq!(scene.photographs[0].sources, Some(vec![2]), "of its sources one is left out");
        let mut without = self::scene();
        without.photographs[3].sources = Some(vec![0]);
        select(&mut without, "b*").unwrap();
        assert_eq!(without.photographs[1].sources, None, "its only source is left out");
        options.set("input.reference", "c*").unwrap();
        let error = select_references(&mut scene, &options).unwrap_err().to_string();
        assert!(error.contains("options.input.reference is `c*`"), "{error}");
    }

    #[test]
    fn a_pattern_of_many_stars_is_decided_at_once() {
        let name = "a".repeat(200);
        assert!(matches("a*".repeat(100).as_bytes(), name.as_bytes()));
        assert!(!matches(("a*".repeat(100) + "b").as_bytes(), name.as_bytes()));
        let cases = [("*", ""), ("*a*b", "xaab"), ("a**c", "ac"), ("?*", "x"), ("", "")];
        assert!(cases.iter().all(|(pattern, name)| matches(pattern.as_bytes(), name.as_bytes())));
        let others = [("?", ""), ("*a", "ab"), ("a*b*c", "acb"), ("", "a")];
        assert!(!others.iter().any(|(pattern, name)| matches(pattern.as_bytes(), name.as_bytes())));
    }

    #[test]
    fn points_and_sources_are_those_of_the_chosen_photographs() {
        let mut scene = scene();
        select(&mut scene, "b/*").unwrap();
        let views: Vec<&[u32]> = scene.points.iter().map(|point| &point.views[..]).collect();
        assert_eq!(views, [&[0, 1][..], &[]], "a point without a track stays");
        assert_eq!(scene.photographs[1].sources.as_deref(), Some(&[0][..]));
    }

    #[test]
    fn what_no_photograph_matches_is_refused() {
        for (text, part) in [("a/1.jpg,c*", "`c*`"), ("a/1.jpg", "at least 2")] {
            let error = select(&mut scene(), text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
