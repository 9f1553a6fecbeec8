//! `report.html`: the parts of the page put together.

use super::advice::advice;
use super::cloud::{Cloud, POINT_BYTES};
use super::cycles;
use super::geometry::Geometry;
use super::run_files::RunFiles;
use super::thumbnails::{self, LAYERS, Thumbnails};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use serde_json::{Value, json};
use skep::geometry::Camera;
use skep::{Error, Result};
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The page in the folder of a run.
pub const PAGE_NAME: &str = "report.html";
/// Bytes of the page at most.
const PAGE_BYTES: usize = 25_000_000;
/// Points of the cloud at most.
const MOST_POINTS: usize = 300_000;
/// Points of the cloud that are kept for, whatever the pictures take.
const LEAST_POINTS: usize = 150_000;
/// Width of the pictures of views in pixels, at most and at least.
const WIDTHS: (u32, u32) = (448, 48);
/// Bytes of the pictures of a view for each of their pixels, about.
const BYTES_PER_PIXEL: f64 = 3.0;
/// Views whose pictures show how many bytes they take, where that limits the width.
const PROBED_VIEWS: usize = 6;
/// Bytes of the pictures of cycles at most.
const CYCLES_BYTES: usize = 2_500_000;
/// Bytes of JSON for each view, at most in most cases: names, figures, cycles.
const VIEW_JSON_BYTES: usize = 2600;
/// Bytes for figures that are not known when the points are counted.
const SPARE_BYTES: usize = 20_000;
/// Bytes of memory for each pixel of a photograph while it is reduced.
const BYTES_PER_PHOTOGRAPH_PIXEL: u64 = 16;

const TEMPLATE: &str = include_str!("viewer/page.html");
const STYLES: &str = include_str!("viewer/page.css");
const VIEWER: &str = include_str!("viewer/dist/viewer.js");
const LICENSE: &str = include_str!("viewer/dist/LICENSE-three");
const VIEWER_HASH: &str = include_str!("viewer/dist/viewer.js.sha256");

/// How a page is made.
pub struct PageOptions<'a> {
    /// Threads; 0 for one each core.
    pub threads: usize,
    /// Memory that may be taken.
    pub memory: u64,
    /// The folder of `--dump`.
    pub dump: Option<PathBuf>,
    /// Whether to go on.
    pub goes_on: &'a (dyn Fn() -> bool + Sync),
}

/// A page before its figures are put in.
pub struct Page {
    data: Value,
    blobs: Vec<(String, Vec<u8>)>,
}

/// Makes the page of a run, but for the report's figures: those have the time that this took.
///
/// # Errors
/// [`Error::Cancelled`]; threads that cannot be started.
pub fn make(files: &RunFiles, options: &PageOptions) -> Result<Page> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|error| Error::argument("threads", options.threads, error.to_string()))?;
    pool.install(|| make_on_pool(files, options))
}

fn make_on_pool(files: &RunFiles, options: &PageOptions) -> Result<Page> {
    let views = files.model.images.len();
    let names: Vec<&str> = files.model.images.iter().map(|image| image.name.as_str()).collect();
    let (dump, mut blobs) = match &options.dump {
        Some(folder) => cycles::read(folder, &names, CYCLES_BYTES),
        None => (Value::Null, Vec::new()),
    };
    let fixed = TEMPLATE.len() + STYLES.len() + VIEWER.len() + views * VIEW_JSON_BYTES + encoded(&blobs);
    let mut cloud = match files.cloud().map(|path| Cloud::read(&path, MOST_POINTS)) {
        Some(Ok(cloud)) => cloud,
        // One of another layout, or a run that goes on.
        _ => Cloud::of_views(),
    };
    let budget = PAGE_BYTES.saturating_sub(fixed + base64_length(LEAST_POINTS * POINT_BYTES));
    let mut width = chosen_width(files, budget);
    let (mut made, mut bytes) = (Vec::new(), usize::MAX);
    // More than once only if the views that were probed took less than the others.
    while bytes > budget && (made.is_empty() || width > WIDTHS.1) {
        if !made.is_empty() {
            width = (f64::from(width) * (0.95 * budget as f64 / bytes as f64).sqrt()) as u32;
        }
        made = views_pictures(files, options, (width, &cloud))?;
        bytes = pictures_bytes(&made);
    }
    let left_out = leave_out(&mut made, budget, bytes);
    if !cloud.is_fused() {
        let finished = made.iter().filter(|view| !view.samples.depth.is_empty()).count().max(1);
        for (view, thumbnails) in made.iter().enumerate() {
            cloud.add_samples(
                view as u32,
                &files.model.images[view].camera,
                thumbnails,
                MOST_POINTS / finished,
            );
        }
    }
    let middles: Vec<Option<f64>> =
        made.iter().map(|view| view.depth_range.map(|(low, high)| (low * high).sqrt())).collect();
    let geometry = Geometry::new(files, &middles);
    let facts: Vec<Value> = made
        .iter()
        .enumerate()
        .map(|(view, thumbnails)| view_facts(files, &geometry, view, thumbnails))
        .collect();
    for (view, thumbnails) in made.into_iter().enumerate() {
        let pictures = LAYERS.into_iter().zip(thumbnails.layers);
        blobs.extend(pictures.filter_map(|(layer, bytes)| Some((format!("view-{view}-{layer}"), bytes?))));
    }
    let mut data = json!({
        "title": files.title(),
        "version": env!("CARGO_PKG_VERSION"),
        "complete": files.is_complete,
        "finished": (0..views).filter(|&view| files.is_finished(view)).count(),
        "views": facts,
        "left_out": left_out,
        "geometry": geometry.facts(),
        "advice": advice(files, &geometry),
        "dump": dump,
    });
    // The cloud takes what is left; the times and the facts of the cloud are not in the figures yet.
    let figures = script_text(&data).len() + script_text(&compact(&files.report)).len() + SPARE_BYTES;
    let taken = TEMPLATE.len() + STYLES.len() + VIEWER.len() + encoded(&blobs) + figures;
    cloud.thin((PAGE_BYTES.saturating_sub(taken) / 4 * 3 / POINT_BYTES).min(MOST_POINTS));
    let (cloud_facts, points) = cloud.encode(geometry.up);
    blobs.push(("cloud".to_owned(), points));
    data["cloud"] = cloud_facts;
    Ok(Page { data, blobs })
}

/// Leaves out the pictures of some views, evenly, where even the smallest do not fit; returns their number.
fn leave_out(made: &mut [Thumbnails], budget: usize, bytes: usize) -> usize {
    let share = (budget as f64 / bytes.max(1) as f64).min(1.0);
    let kept = |count: usize| (count as f64 * share) as usize;
    let mut left_out = 0;
    for (view, thumbnails) in made.iter_mut().enumerate() {
        if kept(view + 1) == kept(view) {
            thumbnails.layers = Default::default();
            left_out += 1;
        }
    }
    left_out
}

fn pictures_bytes(made: &[Thumbnails]) -> usize {
    let pictures = made.iter().flat_map(|view| view.layers.iter().flatten());
    pictures.map(|bytes| base64_length(bytes.len())).sum()
}

/// The width of the pictures with which those of all views take `budget` bytes in base64.
fn chosen_width(files: &RunFiles, budget: usize) -> u32 {
    let images = &files.model.images;
    let aspect: f64 =
        images.iter().map(|image| f64::from(image.camera.height) / f64::from(image.camera.width)).sum();
    let width_for = |bytes_per_pixel: f64| {
        let pixels = budget as f64 * 0.75 / bytes_per_pixel;
        (pixels / aspect.max(f64::MIN_POSITIVE)).sqrt().clamp(WIDTHS.1.into(), WIDTHS.0.into()) as u32
    };
    let first = width_for(2.0 * BYTES_PER_PIXEL);
    if first == WIDTHS.0 {
        return first;
    }
    let first = width_for(BYTES_PER_PIXEL);
    let step = images.len().div_ceil(PROBED_VIEWS);
    let probed: Vec<usize> = (0..images.len()).step_by(step).collect();
    let (bytes, pixels) = probed
        .par_iter()
        .map(|&view| {
            let made = thumbnails::make(files, view, first);
            (made.layers.iter().flatten().map(Vec::len).sum::<usize>(), made.grid.len())
        })
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    width_for((bytes as f64 / pixels.max(1) as f64).max(0.2) * 1.04)
}

/// The pictures of all views, as many at the same time as threads and memory allow.
fn views_pictures(
    files: &RunFiles,
    options: &PageOptions,
    (width, cloud): (u32, &Cloud),
) -> Result<Vec<Thumbnails>> {
    let images = &files.model.images;
    let points = cloud.points_by_view(images.len());
    let largest = images.iter().map(|image| image.camera.pixels() as u64).max().unwrap_or(1);
    let fitting = options.memory / (largest * BYTES_PER_PHOTOGRAPH_PIXEL).max(1);
    let lanes = (fitting.max(1) as usize).min(rayon::current_num_threads());
    let next = AtomicUsize::new(0);
    let lane = |_| -> Result<Vec<(usize, Thumbnails)>> {
        let mut made = Vec::new();
        loop {
            let view = next.fetch_add(1, Ordering::Relaxed);
            if view >= images.len() {
                return Ok(made);
            }
            if !(options.goes_on)() {
                return Err(Error::Cancelled);
            }
            let mut thumbnails = thumbnails::make(files, view, width);
            let camera = &images[view].camera;
            if cloud.is_fused() {
                cloud.add_confidences(&points[view], camera, thumbnails.grid, &thumbnails.samples);
                // No longer needed: many views would take much.
                thumbnails.samples = Default::default();
            }
            made.push((view, thumbnails));
        }
    };
    let lists: Vec<_> = (0..lanes).into_par_iter().with_max_len(1).map(lane).collect::<Result<_>>()?;
    let mut made: Vec<(usize, Thumbnails)> = lists.into_iter().flatten().collect();
    made.sort_unstable_by_key(|(view, _)| *view);
    Ok(made.into_iter().map(|(_, thumbnails)| thumbnails).collect())
}

fn view_facts(files: &RunFiles, geometry: &Geometry, view: usize, made: &Thumbnails) -> Value {
    let image = &files.model.images[view];
    let Camera { width, height, fx, fy, cx, cy, rotation, .. } = image.camera;
    let rounded = |number: f64| (number * 100.0).round() / 100.0;
    let angles = geometry.sorted_angles(view);
    let lens = [fx, fy, cx, cy].map(rounded);
    let axes = [0, 1, 2].map(|row| rotation.row(row).to_array());
    json!({
        "name": image.name,
        "size": [width, height],
        "grid": [made.grid.columns, made.grid.rows],
        "finished": files.is_finished(view),
        "center": image.camera.center().to_array(),
        // Rows are the axes of the camera in the world.
        "axes": axes,
        "lens": lens,
        "depth": made.depth_range.map(|(low, high)| [low, high]),
        "sources": geometry.sources[view],
        "angle": angles.get(angles.len() / 2).copied().map(rounded),
        "points": geometry.points[view],
    })
}

impl Page {
    /// Puts the figures of the report into the page, and writes it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_to(&self, out: &mut dyn Write, report: &Value) -> std::io::Result<()> {
        let mut data = self.data.clone();
        data["report"] = compact(report);
        let title = escaped(data["title"].as_str().unwrap_or_default());
        for (part, text) in parts(TEMPLATE) {
            out.write_all(text.as_bytes())?;
            match part {
                "TITLE" => out.write_all(title.as_bytes())?,
                "HASH" => out.write_all(VIEWER_HASH.trim().as_bytes())?,
                "STYLES" => out.write_all(STYLES.as_bytes())?,
                "LICENSE" => out.write_all(escaped(LICENSE).as_bytes())?,
                "DATA" => out.write_all(script_text(&data).as_bytes())?,
                "VIEWER" => out.write_all(VIEWER.as_bytes())?,
                "BLOBS" => {
                    for (name, bytes) in &self.blobs {
                        let text = STANDARD.encode(bytes);
                        writeln!(out, "<script type=\"text/plain\" id=\"{name}\">{text}</script>")?;
                    }
                }
                _ => (),
            }
        }
        Ok(())
    }
}

/// Writes a page into the folder of its run.
///
/// # Errors
/// A file that cannot be written.
pub fn write(page: &Page, files: &RunFiles, report: &Value) -> Result<PathBuf> {
    let path = files.workspace.folder().join(PAGE_NAME);
    skep::io::write_file(&path, |out| page.write_to(out, report))?;
    Ok(path)
}

/// The texts of a template and the name of the part `<!--{NAME}-->` that follows each; the last has none.
fn parts(template: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    let mut rest = template;
    while let Some((text, (name, after))) =
        rest.split_once("<!--{").and_then(|(text, after)| Some((text, after.split_once("}-->")?)))
    {
        found.push((name, text));
        rest = after;
    }
    found.push(("", rest));
    found
}

/// The report without what the page does not show.
fn compact(report: &Value) -> Value {
    let mut report = report.clone();
    let without = |entry: &mut Value, keys: &[&str]| {
        if let Some(entry) = entry.as_object_mut() {
            keys.iter().for_each(|key| drop(entry.remove(*key)));
        }
    };
    without(&mut report["totals"], &["outcomes"]);
    for view in report["views"].as_array_mut().into_iter().flatten() {
        without(view, &["outcomes", "sources", "bilinear_samples", "early_terminations"]);
    }
    report
}

/// JSON that can stand in a script element: nothing in it ends the element or begins a comment.
fn script_text(data: &Value) -> String {
    let text = data.to_string();
    text.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

/// Text in HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn base64_length(bytes: usize) -> usize {
    // And its element.
    bytes.div_ceil(3) * 4 + 80
}

fn encoded(blobs: &[(String, Vec<u8>)]) -> usize {
    blobs.iter().map(|(_, bytes)| base64_length(bytes.len())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_the_data_ends_its_element() {
        let hostile = "</script><!--<script>&\u{2028}\u{2029}";
        let text = script_text(&json!({ "name": hostile }));
        assert!(!text.contains(['<', '>', '&', '\u{2028}', '\u{2029}']), "{text}");
        let read: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(read["name"], hostile);
        assert_eq!(escaped("<a title=\"&\">"), "&lt;a title=&quot;&amp;&quot;&gt;");
    }

    #[test]
    fn a_template_has_texts_and_named_parts() {
        assert_eq!(parts("a<!--{X}-->b<!--{Y}-->"), [("X", "a"), ("Y", "b"), ("", "")]);
        let names: Vec<&str> = parts(TEMPLATE).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["HASH", "TITLE", "STYLES", "TITLE", "LICENSE", "DATA", "BLOBS", "VIEWER", ""]);
    }
}
