//! Options of what a run takes from a scene in files.

use super::Options;
use super::value::{Entry, Kind, OptionInfo};
use crate::error::{Error, Result};
use glam::DVec3;

/// What a run takes from a scene in files. Scenes in memory are taken as they are, but for the bounds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InputOptions {
    /// Largest side of the photographs; larger ones are reduced, and the maps have their reduced size. 0
    /// keeps all pixels.
    pub max_image_size: u32,
    /// The photographs to take, all if empty: names or patterns with `*` and `?`, separated by commas, or the
    /// path of a text file with one on each line.
    pub images: String,
    /// The photographs that get maps, all if empty, in the same form. Of the others a run takes only their
    /// source views, which the checks need, without writing their maps.
    pub reference: String,
    /// Folder of masks, none if empty: `NAME.png` or `NAME` with another ending for the photograph `NAME`; 0
    /// is ignored.
    pub masks: String,
    /// Whether pixels of alpha 0 are ignored like masked ones.
    pub alpha_mask: bool,
    /// File with the source views of each view, in the layout of COLMAP's `patch-match.cfg`; they are chosen
    /// by triangulation angle if empty.
    pub sources: String,
    /// File with depth ranges of views: lines `NAME NEAR FAR`; those of other views follow from the points.
    /// None if empty.
    pub depth_ranges: String,
    /// The box of the world in which surfaces are reconstructed: `x0 y0 z0 x1 y1 z1`; everything if empty.
    pub bounds: String,
}

/// An option that is a text.
pub(super) struct TextEntry {
    pub c_name: &'static std::ffi::CStr,
    pub explanation: &'static str,
    pub unit: &'static str,
    pub get: fn(&Options) -> String,
    /// Sets the text, or returns what was expected.
    pub set: fn(&mut Options, &str) -> Result<()>,
}

impl TextEntry {
    /// Its description.
    pub(super) fn info(&self) -> OptionInfo {
        let name = self.c_name.to_str().unwrap_or_default();
        OptionInfo { name, explanation: self.explanation, unit: self.unit, kind: Kind::Text }
    }
}

/// The options of the group that are numbers.
pub(super) const NUMBERS: &[Entry] = &[
    Entry {
        c_name: c"input.max_image_size",
        explanation: "Largest side of the photographs of a scene in files: larger ones are reduced, and the \
                      maps have their reduced size. 0 keeps all pixels.",
        unit: "pixels",
        kind: Kind::Count { min: 0, max: 32_768 },
        get: |options| f64::from(options.input.max_image_size),
        set: |options, value| options.input.max_image_size = value as u32,
    },
    Entry {
        c_name: c"input.alpha_mask",
        explanation: "Pixels of alpha 0 are ignored like masked ones.",
        unit: "switch",
        kind: Kind::Switch,
        get: |options| f64::from(u8::from(options.input.alpha_mask)),
        set: |options, value| options.input.alpha_mask = value != 0.0,
    },
];

/// The options of the group that are texts.
pub(super) const TEXTS: &[TextEntry] = &[
    TextEntry {
        c_name: c"input.images",
        explanation: "The photographs to take: names or patterns with * and ?, separated by commas, or the \
                      path of a text file with one on each line; all if empty.",
        unit: "text",
        get: |options| options.input.images.clone(),
        set: |options, text| set(&mut options.input.images, text),
    },
    TextEntry {
        c_name: c"input.reference",
        explanation: "The photographs that get maps, in the form of input.images; all if empty. Of the others \
                      only their source views are taken, which get none.",
        unit: "text",
        get: |options| options.input.reference.clone(),
        set: |options, text| set(&mut options.input.reference, text),
    },
    TextEntry {
        c_name: c"input.masks",
        explanation: "Folder of masks: NAME.png for the photograph NAME; where it is 0 nothing is estimated. \
                      None if empty.",
        unit: "path",
        get: |options| options.input.masks.clone(),
        set: |options, text| set(&mut options.input.masks, text),
    },
    TextEntry {
        c_name: c"input.sources",
        explanation: "File with the source views of each view, in the layout of COLMAP's patch-match.cfg; \
                      chosen by triangulation angle if empty.",
        unit: "path",
        get: |options| options.input.sources.clone(),
        set: |options, text| set(&mut options.input.sources, text),
    },
    TextEntry {
        c_name: c"input.depth_ranges",
        explanation: "File with depth ranges of views, lines NAME NEAR FAR; the ranges of other views follow \
                      from the sparse points. None if empty.",
        unit: "path",
        get: |options| options.input.depth_ranges.clone(),
        set: |options, text| set(&mut options.input.depth_ranges, text),
    },
    TextEntry {
        c_name: c"input.bounds",
        explanation: "Box of the world in which surfaces are reconstructed, x0 y0 z0 x1 y1 z1; everything if \
                      empty.",
        unit: "text",
        get: |options| options.input.bounds.clone(),
        set: |options, text| {
            parse_bounds(text)?;
            set(&mut options.input.bounds, text)
        },
    },
];

fn set(field: &mut String, text: &str) -> Result<()> {
    text.clone_into(field);
    Ok(())
}

impl InputOptions {
    /// The corners of the box of the world, the smaller coordinates first; `None` where there is no box.
    ///
    /// # Errors
    /// A text that is not six finite numbers.
    pub fn bounds(&self) -> Result<Option<[DVec3; 2]>> {
        parse_bounds(&self.bounds)
    }
}

fn parse_bounds(text: &str) -> Result<Option<[DVec3; 2]>> {
    let fields: Vec<&str> =
        text.split(|c: char| c == ',' || c.is_whitespace()).filter(|field| !field.is_empty()).collect();
    if fields.is_empty() {
        return Ok(None);
    }
    let numbers: Vec<f64> = fields
        .iter()
        .filter_map(|field| field.parse().ok())
        .filter(|number: &f64| number.is_finite())
        .collect();
    match numbers[..] {
        [x0, y0, z0, x1, y1, z1] if fields.len() == 6 && x0 < x1 && y0 < y1 && z0 < z1 => {
            Ok(Some([DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)]))
        }
        _ => {
            let expected = "six numbers x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1";
            Err(Error::argument("options.input.bounds", format!("`{text}`"), expected))
        }
    }
}
