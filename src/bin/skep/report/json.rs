//! `report.json`: counts, times and options of a run. Tools read it: keys are stable, and new ones may be
//! added.

use crate::stopwatch::Times;
use serde::Serialize;
use serde_json::Value;
use skep::job::{Job, Summary, ViewSummary};
use skep::simd::SimdLevel;
use skep::{Counts, CycleRecord, OptionValue, Options, PixelStatus, Result};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// The file.
#[derive(Serialize)]
pub struct Report {
    version: &'static str,
    simd: &'static str,
    threads: usize,
    /// The preset whose options these are; `null` if some differ.
    preset: Option<&'static str>,
    options: BTreeMap<&'static str, Value>,
    /// Of the scene, then of the run.
    pub warnings: Vec<String>,
    pub totals: Totals,
    phases: Option<Times>,
    views: Vec<ViewReport>,
}

/// All views that got maps together.
#[derive(Default, Serialize)]
pub struct Totals {
    pub pixels: u64,
    pub status_counts: BTreeMap<&'static str, u64>,
    /// The same as `status_counts`, under its earlier key, for compatibility.
    pub outcomes: BTreeMap<&'static str, u64>,
    pub ncc_evaluations: u64,
    pub bilinear_samples: u64,
    pub early_terminations: u64,
    pub cycles: Vec<CycleReport>,
    pub points: usize,
    /// `null`, as the other times and the memory, where several processes did the run.
    pub wall_seconds: Option<f64>,
    pub cpu_seconds: Option<f64>,
    pub peak_resident_bytes: Option<u64>,
}

#[derive(Serialize)]
struct ViewReport {
    name: String,
    /// Whether it got maps; else only its photograph was used, and there are no counts.
    reference: bool,
    width: u32,
    height: u32,
    pixels: u64,
    depth_min: f64,
    depth_max: f64,
    sources: Vec<String>,
    status_counts: BTreeMap<&'static str, u64>,
    /// The same as `status_counts`, under its earlier key, for compatibility.
    outcomes: BTreeMap<&'static str, u64>,
    ncc_evaluations: u64,
    bilinear_samples: u64,
    early_terminations: u64,
    cycles: Vec<CycleReport>,
}

/// A cycle of one view, or of all views together.
#[derive(Serialize)]
pub struct CycleReport {
    downscale: u32,
    cycle: u32,
    pixels: u64,
    changed: u64,
    validated: u64,
    /// Median distance between projected planes and the depths of the sources, in pixels of the scale; of a
    /// view only.
    #[serde(skip_serializing_if = "Option::is_none")]
    median_residual: Option<f64>,
}

impl Report {
    /// Collects everything but the times, which [`Report::set_times`] sets.
    pub fn new(job: &Job, result: &Summary) -> Report {
        let (scene, options) = (job.scene(), job.options());
        let views =
            result.views.iter().enumerate().map(|(index, view)| view_report(job, index, view)).collect();
        Report {
            version: env!("CARGO_PKG_VERSION"),
            simd: options.simd.unwrap_or_else(SimdLevel::detect).name(),
            threads: skep::thread_count(scene, options),
            preset: preset_of(options),
            options: options.values().map(|(name, value)| (name, typed(value))).collect(),
            warnings: scene.warnings().iter().chain(&result.warnings).cloned().collect(),
            totals: totals(job, result),
            phases: None,
            views,
        }
    }

    /// Sets the time of each phase and of the whole run, and the peak memory.
    pub fn set_times(&mut self, times: Times) {
        let total = times.total();
        self.phases = Some(times);
        self.totals.wall_seconds = Some(total.wall_seconds);
        self.totals.cpu_seconds = Some(total.cpu_seconds);
        self.totals.peak_resident_bytes = peak_resident_bytes();
    }

    /// The content of the file.
    pub fn to_value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// Writes the file, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<()> {
        skep::io::write_file(path, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }
}

/// The preset with these options, apart from what is taken from the scene and what does not change the
/// result.
fn preset_of(options: &Options) -> Option<&'static str> {
    Options::PRESETS.into_iter().find(|name| {
        let Options { threads, memory, simd, output, .. } = *options;
        let input = options.input.clone();
        Options::preset(name)
            .is_ok_and(|preset| Options { threads, memory, simd, output, input, ..preset } == *options)
    })
}

/// An option's value as JSON.
pub(super) fn typed(value: OptionValue) -> Value {
    match value {
        OptionValue::Count(value) => value.into(),
        OptionValue::Number(value) => value.into(),
        OptionValue::Switch(value) => value.into(),
        OptionValue::Text(value) => value.into(),
    }
}

fn totals(job: &Job, result: &Summary) -> Totals {
    let mut counts = Counts::default();
    let mut status_counts = [0; PixelStatus::ALL.len()];
    for view in &result.views {
        counts += view.counts;
        for (total, count) in status_counts.iter_mut().zip(view.status_counts) {
            *total += count;
        }
    }
    Totals {
        pixels: job.references().iter().map(|&view| job.scene().views()[view].camera.pixels() as u64).sum(),
        status_counts: by_name(status_counts),
        outcomes: by_name(status_counts),
        ncc_evaluations: counts.ncc_evaluations,
        bilinear_samples: counts.bilinear_samples,
        early_terminations: counts.early_terminations,
        cycles: total_cycles(result.views.iter().flat_map(|view| &view.cycles)),
        points: result.points,
        wall_seconds: None,
        cpu_seconds: None,
        peak_resident_bytes: None,
    }
}

/// The cycles of all views together, coarse to fine, the order of the run.
pub(super) fn total_cycles<'a>(of_views: impl Iterator<Item = &'a CycleRecord>) -> Vec<CycleReport> {
    let mut cycles: Vec<CycleRecord> = Vec::new();
    of_views.for_each(|cycle| add_cycle(&mut cycles, cycle));
    cycles.sort_by_key(|cycle| (std::cmp::Reverse(cycle.downscale), cycle.cycle));
    cycles.iter().map(CycleReport::from).collect()
}

/// Adds a view's cycle to the one of the same scale and number.
fn add_cycle(cycles: &mut Vec<CycleRecord>, cycle: &CycleRecord) {
    let same = |total: &&mut CycleRecord| (total.downscale, total.cycle) == (cycle.downscale, cycle.cycle);
    match cycles.iter_mut().find(same) {
        Some(total) => {
            total.pixels += cycle.pixels;
            total.changed += cycle.changed;
            total.validated += cycle.validated;
        }
        None => cycles.push(*cycle),
    }
}

fn view_report(job: &Job, index: usize, result: &ViewSummary) -> ViewReport {
    let scene = job.scene();
    let view = &scene.views()[index];
    let range = scene.depth_range(index);
    ViewReport {
        name: view.name.clone(),
        reference: job.references().contains(&index),
        width: view.camera.width,
        height: view.camera.height,
        pixels: view.camera.pixels() as u64,
        depth_min: range.near,
        depth_max: range.far,
        sources: job
            .stepper()
            .sources(index)
            .iter()
            .map(|&source| scene.views()[source as usize].name.clone())
            .collect(),
        status_counts: by_name(result.status_counts),
        outcomes: by_name(result.status_counts),
        ncc_evaluations: result.counts.ncc_evaluations,
        bilinear_samples: result.counts.bilinear_samples,
        early_terminations: result.counts.early_terminations,
        cycles: result.cycles.iter().map(CycleReport::of_view).collect(),
    }
}

pub(super) fn by_name(counts: [u64; PixelStatus::ALL.len()]) -> BTreeMap<&'static str, u64> {
    PixelStatus::ALL.iter().map(|status| status.name()).zip(counts).collect()
}

impl CycleReport {
    pub(super) fn of_view(record: &CycleRecord) -> CycleReport {
        CycleReport { median_residual: Some(record.median_residual), ..record.into() }
    }
}

impl From<&CycleRecord> for CycleReport {
    fn from(cycle: &CycleRecord) -> CycleReport {
        let &CycleRecord { downscale, cycle, pixels, changed, validated, .. } = cycle;
        CycleReport { downscale, cycle, pixels, changed, validated, median_residual: None }
    }
}

/// Peak resident memory of the process, where the system reports it (Linux).
fn peak_resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}
