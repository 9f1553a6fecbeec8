//! Every number the method depends on: grouped options, presets, and the table of names, ranges and units.
//!
//! Fractions are fractions, angles are degrees. Numbers that are properties of an algorithm and not choices
//! of a user are named constants at the top of the files that use them.

mod groups;
mod input;
mod output;
mod presets;
mod schedule;
mod value;

use crate::error::{Error, Result};
use crate::memory::parse_bytes;
use crate::simd::SimdLevel;
use groups::GROUPED;
pub use groups::{
    CheckOptions, CostOptions, FusionOptions, RefineOptions, SearchOptions, ViewSelectionOptions,
    WindowOptions,
};
pub use input::InputOptions;
use input::TextEntry;
pub use output::{CloudFormat, OutputOptions, ViewFiles};
pub use schedule::{Scale, ScheduleOptions};
use schedule::{scales_from_text, scales_to_text};
#[cfg(feature = "capi")]
use std::ffi::CStr;
use value::Entry;
pub use value::{Kind, OptionInfo, OptionValue};

/// All options. Start from a preset; every field may be changed.
///
/// By name an option is a field with its group, such as `check.depth_tolerance`; where no other group has a
/// field of that name, the field's name alone does.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the random generator; the same seed gives the same bits.
    pub seed: u64,
    /// Worker threads at most, 0 to 4096; 0 takes one for each core. A run starts at most four for each core,
    /// and no more than its images keep busy ([`thread_count`](crate::thread_count)). The result does not
    /// depend on it.
    pub threads: usize,
    /// Bytes of memory that a run in a folder keeps to; 0 takes three quarters of what the machine or its
    /// control group allows. The result does not depend on it. Runs without a folder keep everything in
    /// memory.
    pub memory: u64,
    /// Instruction set of the kernels; `None` takes the best that the machine supports. The result does not
    /// depend on it.
    pub simd: Option<SimdLevel>,
    /// What is taken from a scene in files.
    pub input: InputOptions,
    /// The scales and their cycles.
    pub schedule: ScheduleOptions,
    /// The patches.
    pub window: WindowOptions,
    /// The cost of a plane.
    pub cost: CostOptions,
    /// The search of each pixel.
    pub search: SearchOptions,
    /// The source views.
    pub view_selection: ViewSelectionOptions,
    /// The geometric consistency check.
    pub check: CheckOptions,
    /// Filters of the planes.
    pub refine: RefineOptions,
    /// Fusion into points.
    pub fusion: FusionOptions,
    /// What a run in a folder writes; nothing else depends on it.
    pub output: OutputOptions,
}

/// The name of the best instruction set that the machine supports.
const BEST: &str = "best";

const SEED: OptionInfo = OptionInfo {
    name: "seed",
    explanation: "Seed of the random generator; the same seed gives the same bits.",
    unit: "any",
    kind: Kind::Count { min: 0, max: u64::MAX },
};

const SIMD: TextEntry = TextEntry {
    c_name: c"simd",
    explanation: "Instruction set: scalar, baseline, v3, or best for the best the machine has; the result \
                  does not depend on it.",
    unit: "name",
    get: |options| options.simd.map_or(BEST, SimdLevel::name).to_owned(),
    set: |options, text| {
        let level = SimdLevel::ALL.into_iter().find(|level| level.name() == text);
        if level.is_none() && text != BEST {
            let names = SimdLevel::ALL.map(SimdLevel::name).join(", ");
            return Err(Error::argument(
                "options.simd",
                format!("`{text}`"),
                format!("one of {names}, {BEST}"),
            ));
        }
        options.simd = level;
        Ok(())
    },
};

const SCALES: TextEntry = TextEntry {
    c_name: c"schedule.scales",
    explanation: "Scales from coarse to fine, each twice as large as the one before, the last at full size: \
                  `downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 \
                  iterations=1+2x1` is half size with 3 food sources a pixel, 5 iterations in the first \
                  cycle and 4 more cycles of 1, then full size.",
    unit: "text",
    get: |options| scales_to_text(&options.schedule.scales),
    set: |options, text| {
        let before = std::mem::replace(&mut options.schedule.scales, scales_from_text(text)?);
        options.check_scales().inspect_err(|_| options.schedule.scales = before)
    },
};

fn texts() -> impl Iterator<Item = &'static TextEntry> {
    [&SIMD].into_iter().chain(input::TEXTS).chain([&SCALES, &WRITE, &CLOUD_FORMAT])
}

const WRITE: TextEntry = TextEntry {
    c_name: c"output.write",
    explanation: "Files of each view: some of depth, normals, confidence, status, graphs, previews, \
                  separated by commas; with + or - before each name they are added to those of the default \
                  or left out.",
    unit: "text",
    get: |options| options.output.write.to_string(),
    set: |options, text| {
        options.output.write = text.parse()?;
        Ok(())
    },
};

const CLOUD_FORMAT: TextEntry = TextEntry {
    c_name: c"output.cloud_format",
    explanation: "Format of the cloud: ply, las or laz.",
    unit: "name",
    get: |options| options.output.cloud_format.name().to_owned(),
    set: |options, text| {
        options.output.cloud_format = CloudFormat::from_name(text)?;
        Ok(())
    },
};

/// The option whose text may have a unit.
const MEMORY: &str = "memory";

/// The options outside the groups that are numbers.
const OTHERS: &[Entry] = &[
    Entry {
        c_name: c"threads",
        explanation: "Worker threads at most; 0 takes one for each core. At most four for each core are \
                      started, and no more than the images keep busy. The result does not depend on it.",
        unit: "threads",
        kind: Kind::Count { min: 0, max: 4096 },
        get: |options| options.threads as f64,
        set: |options, value| options.threads = value as usize,
    },
    Entry {
        c_name: c"memory",
        explanation: "Bytes of memory that a run in a folder keeps to; 0 takes three quarters of what the \
                      machine or its control group allows. The result does not depend on it.",
        unit: "bytes",
        kind: Kind::Count { min: 0, max: MAX_EXACT },
        get: |options| options.memory as f64,
        set: |options, value| options.memory = value as u64,
    },
    Entry {
        c_name: c"schedule.min_changed_fraction",
        explanation: "From the second cycle of a scale on, the scale ends early once fewer than this \
                      fraction of the pixels changed their depth.",
        unit: "fraction of the pixels",
        kind: Kind::Number { min: 0.0, max: 1.0 },
        get: |options| options.schedule.min_changed_fraction,
        set: |options, value| options.schedule.min_changed_fraction = value,
    },
    Entry {
        c_name: c"output.splat",
        explanation: "Write a scene for Gaussian splatting too, in `splat/`: photographs, cameras, and the \
                      cloud as the points to start from.",
        unit: "switch",
        kind: Kind::Switch,
        get: |options| f64::from(u8::from(options.output.splat)),
        set: |options, value| options.output.splat = value != 0.0,
    },
];

fn numbers() -> impl Iterator<Item = &'static Entry> {
    OTHERS.iter().chain(input::NUMBERS).chain(GROUPED)
}

impl Options {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// An option out of its range.
    pub fn check(&self) -> Result<()> {
        self.check_scales()?;
        self.input.bounds()?;
        self.output.cloud_format.check()?;
        for entry in numbers() {
            entry.kind.check(entry.name(), (entry.get)(self))?;
        }
        let ViewSelectionOptions { min_triangulation_angle: min, max_triangulation_angle: max, .. } =
            self.view_selection;
        Kind::Number { min, max: 180.0 }.check("view_selection.max_triangulation_angle", max)?;
        if self.cost.max_views_per_pixel == 1 {
            let expected = "0 for all views of the set, or at least 2";
            return Err(Error::argument("options.cost.max_views_per_pixel", 1, expected));
        }
        Ok(())
    }

    /// Minimum number of views in which a hypothesis must be visible to have a finite cost. The sum over all
    /// views is infinite for fewer than two in any case.
    pub(crate) fn min_matched_views(&self) -> usize {
        match self.cost.best_views {
            0 => 2,
            _ if self.check.few_views > 0 => 1,
            _ => self.check.min_consistent_views.min(2) as usize,
        }
    }

    /// All options, in the order in which they are listed: name, explanation, unit and values of each.
    pub fn infos() -> impl Iterator<Item = OptionInfo> {
        let [threads, memory, min_changed, splat] = [0, 1, 2, 3].map(|index: usize| OTHERS[index].info());
        let input = input::NUMBERS.iter().map(Entry::info).chain(input::TEXTS.iter().map(TextEntry::info));
        let of_run = [SEED, threads, memory, SIMD.info()].into_iter().chain(input);
        let of_method = [SCALES.info(), min_changed].into_iter().chain(GROUPED.iter().map(Entry::info));
        of_run.chain(of_method).chain([WRITE.info(), CLOUD_FORMAT.info(), splat])
    }

    /// The groups with a sentence on each, in the order of the options.
    pub fn groups() -> impl Iterator<Item = (&'static str, &'static str)> {
        let schedule = ("schedule", "Schedule: the scales of a run and the cycles on each.");
        let trimmed = |&(name, text): &(&'static str, &'static str)| (name, text.trim_start());
        let input = ("input", "Input: what a run takes from a scene in files.");
        let output = ("output", "Output: what a run in a folder writes; it changes no values.");
        [input, schedule].into_iter().chain(groups::GROUPS.iter().map(trimmed)).chain([output])
    }

    /// The description of the option of this name.
    ///
    /// # Errors
    /// No option of this name, or several.
    pub fn info(name: &str) -> Result<OptionInfo> {
        let in_full = |info: &OptionInfo| info.name == name;
        let alone = |info: &OptionInfo| info.name.split_once('.').is_some_and(|(_, field)| field == name);
        if let Some(found) = Options::infos().find(in_full) {
            return Ok(found);
        }
        let found: Vec<OptionInfo> = Options::infos().filter(alone).collect();
        match found[..] {
            [only] => Ok(only),
            [] => Err(Error::argument("option", name, expected_instead_of(name))),
            _ => Err(Error::argument("option", name, format!("one of {}", names(found.into_iter())))),
        }
    }

    /// The value of the option of this name.
    ///
    /// # Errors
    /// No option of this name, or several.
    pub fn get(&self, name: &str) -> Result<OptionValue> {
        let info = Options::info(name)?;
        Ok(match numbers().find(|entry| entry.name() == info.name) {
            Some(entry) => entry.value(self),
            None if info == SEED => OptionValue::Count(self.seed),
            None => OptionValue::Text(
                texts().find(|entry| entry.info() == info).map(|entry| (entry.get)(self)).unwrap_or_default(),
            ),
        })
    }

    /// Sets the numeric option of this name; a switch is 1 or 0.
    ///
    /// # Errors
    /// No option of this name, or several; an option that is not numeric; a value out of its range. No option
    /// is changed then.
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<()> {
        let info = Options::info(name)?;
        match numbers().find(|entry| entry.name() == info.name) {
            Some(entry) => {
                info.kind.check(info.name, value)?;
                (entry.set)(self, value);
            }
            None if info == SEED => {
                // An f64 does not represent every larger whole number.
                info_range(MAX_EXACT).check(info.name, value)?;
                self.seed = value as u64;
            }
            None => return Err(Error::argument(format!("options.{}", info.name), value, "a text")),
        }
        Ok(())
    }

    /// Sets the option of this name from its text, as [`OptionValue`] displays it.
    ///
    /// # Errors
    /// No option of this name, or several; a text that is not of its kind; a value out of its range. No
    /// option is changed then.
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let info = Options::info(name)?;
        let text = text.trim();
        let error = |expected: String| {
            Error::argument(format!("options.{}", info.name), format!("`{text}`"), expected)
        };
        if info == SEED {
            self.seed = text.parse().map_err(|_| error(info.kind.to_string()))?;
        } else if info.name == MEMORY {
            self.set_number(MEMORY, parse_bytes(text)? as f64)?;
        } else if let Some(entry) = texts().find(|entry| entry.info() == info) {
            (entry.set)(self, text)?;
        } else {
            let value = match (info.kind, text) {
                (Kind::Switch, "true") => 1.0,
                (Kind::Switch, "false") => 0.0,
                _ => text.parse().map_err(|_| error(info.kind.to_string()))?,
            };
            self.set_number(info.name, value)?;
        }
        Ok(())
    }

    /// Every option by name with its value.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, OptionValue)> + '_ {
        Options::infos().map(|info| (info.name, self.get(info.name).expect("it is listed")))
    }

    /// The name with this index in [`Options::infos`], as a C string.
    #[cfg(feature = "capi")]
    pub(crate) fn c_name(index: usize) -> Option<&'static CStr> {
        let name = Options::infos().nth(index)?.name;
        if name == SEED.name {
            return Some(c"seed");
        }
        let text = texts().find(|entry| entry.info().name == name).map(|entry| entry.c_name);
        text.or_else(|| numbers().find(|entry| entry.name() == name).map(|entry| entry.c_name))
    }
}

impl FusionOptions {
    /// Checks that the values are in their ranges.
    ///
    /// # Errors
    /// An option out of its range.
    pub fn check(&self) -> Result<()> {
        let options = Options { fusion: *self, ..Options::default() };
        let mut own = numbers().filter(|entry| entry.name().starts_with("fusion."));
        own.try_for_each(|entry| entry.kind.check(entry.name(), (entry.get)(&options)))
    }
}

/// The largest whole number up to which an f64 represents all.
const MAX_EXACT: u64 = 1 << 53;

fn info_range(max: u64) -> Kind {
    Kind::Count { min: 0, max }
}

/// What is expected instead of a name that does not exist: one of the similar names or, where there are none,
/// a group and where its options are listed.
fn expected_instead_of(name: &str) -> String {
    let similar = similar(name);
    if !similar.is_empty() {
        return format!("one of {}", names(similar.into_iter()));
    }
    let alone = Options::infos().filter(|info| !info.name.contains('.'));
    let groups: Vec<&str> = Options::groups().map(|(group, _)| group).collect();
    format!(
        "{}, or an option of a group: {}; `skep info` lists all, `skep info {}` those of a group",
        names(alone),
        groups.join(", "),
        groups[0]
    )
}

/// The options that share most words with a name that does not exist; none, if none shares any.
fn similar(name: &str) -> Vec<OptionInfo> {
    let words = |name: &str| -> Vec<String> {
        name.split(['.', '_', '-', ' ']).filter(|word| word.len() > 2).map(str::to_lowercase).collect()
    };
    let wanted = words(name);
    let shared = |info: &OptionInfo| {
        let own = words(info.name);
        wanted.iter().filter(|word| own.contains(word)).count()
    };
    let most = Options::infos().map(|info| shared(&info)).max().unwrap_or(0);
    Options::infos().filter(|info| most > 0 && shared(info) == most).collect()
}

fn names(infos: impl Iterator<Item = OptionInfo>) -> String {
    infos.map(|info| info.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests;
