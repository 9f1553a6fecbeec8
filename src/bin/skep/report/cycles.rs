//! The section on the pictures of every cycle, which `--dump` wrote.

use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{ExtendedColorType, ImageEncoder};
use serde_json::{Value, json};
use std::path::Path;

/// The pictures of each view and cycle.
const KINDS: [&str; 3] = ["depth", "normal", "validated"];
/// Width of the pictures in pixels.
const WIDTH: u32 = 240;
const QUALITY: u8 = 75;
/// Bytes of a picture, about, by which the number of views is chosen.
const TYPICAL_BYTES: usize = 7000;

/// Pictures of the cycles in a folder, and what the page needs to know of them; of as many views as fit into
/// `budget` bytes.
pub fn read(folder: &Path, names: &[&str], budget: usize) -> (Value, Vec<(String, Vec<u8>)>) {
    let mut cycles: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| label(name).is_some())
        .collect();
    cycles.sort();
    let views = (budget / (cycles.len().max(1) * KINDS.len() * TYPICAL_BYTES)).clamp(1, names.len().max(1));
    // Spread over the views.
    let chosen: Vec<usize> = (0..views).map(|place| place * names.len() / views).collect();
    let (mut pictures, mut bytes) = (Vec::new(), 0);
    for (number, cycle) in cycles.iter().enumerate() {
        for &view in &chosen {
            for kind in KINDS {
                let path = folder.join(cycle).join(format!("{}.{kind}.png", names[view]));
                let Some(picture) = thumbnail(&path).filter(|picture| bytes + picture.len() <= budget) else {
                    continue;
                };
                bytes += picture.len();
                pictures.push((format!("cycle-{number}-{view}-{kind}"), picture));
            }
        }
    }
    let labels: Vec<String> = cycles.iter().filter_map(|cycle| label(cycle)).collect();
    (json!({ "cycles": labels, "views": chosen, "kinds": KINDS }), pictures)
}

/// What a cycle's folder, such as `03-size2-cycle4`, is called in the page.
fn label(name: &str) -> Option<String> {
    let mut parts = name.split('-');
    parts.next()?.parse::<u32>().ok()?;
    let size: u32 = parts.next()?.strip_prefix("size")?.parse().ok()?;
    let cycle: u32 = parts.next()?.strip_prefix("cycle")?.parse().ok()?;
    let size = if size == 1 { "full size".to_owned() } else { format!("1/{size} size") };
    parts.next().is_none().then(|| format!("{size}, cycle {cycle}"))
}

fn thumbnail(path: &Path) -> Option<Vec<u8>> {
    let picture = image::open(path).ok()?;
    let width = WIDTH.min(picture.width());
    let height = (u64::from(width) * u64::from(picture.height()) / u64::from(picture.width())).max(1) as u32;
    let small = picture.resize_exact(width, height, FilterType::Nearest).into_rgb8();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .write_image(&small, width, height, ExtendedColorType::Rgb8)
        .ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_cycles_are_read_in_words() {
        assert_eq!(label("03-size2-cycle4").as_deref(), Some("1/2 size, cycle 4"));
        assert_eq!(label("10-size1-cycle1").as_deref(), Some("full size, cycle 1"));
        assert_eq!(
            (label("preview"), label("03-size2-cycle4-x"), label("a-size2-cycle4")),
            (None, None, None)
        );
    }
}
