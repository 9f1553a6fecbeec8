//! The pictures of a view in the page: the photograph, and maps sampled on a coarse grid.
//!
//! Maps are stored as gray or color PNG pictures of numbers that the page reads back: it colors them, and
//! shows the value under the cursor. The constants say how each is quantised; the page repeats that.

use super::map_samples::{self, SampleGrid};
use super::run_files::RunFiles;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageReader};
use skep::image::Picture;
use skep::io::MapKind;
use std::path::Path;

/// Quality of the photographs as JPEG.
const PHOTOGRAPH_QUALITY: u8 = 78;
/// Percentiles of a view's validated depths between which they are quantised: outliers do not cost steps.
const DEPTH_PERCENTILES: (f64, f64) = (0.01, 0.99);
/// Steps of depths, even in the logarithm; 0 is no depth.
const DEPTH_STEPS: f64 = 254.0;
/// Steps of the confidence from 0 to 1; the numbers begin with 1, as 0 is no depth.
const CONFIDENCE_STEPS: f32 = 50.0;
/// Numbers of normals' components are multiples of this, less one half: 1 / 64 of their range.
const NORMAL_STEP: u8 = 4;

/// A layer: its name in the page.
pub const LAYERS: [&str; 6] = ["photograph", "depth", "normal", "sources", "confidence", "status"];

/// The pictures of a view, and the samples that they were made from.
pub struct Thumbnails {
    pub grid: SampleGrid,
    /// By [`LAYERS`], the picture in its file format; `None` for what is missing.
    pub layers: [Option<Vec<u8>>; LAYERS.len()],
    /// Depths of the numbers 1 and 255.
    pub depth_range: Option<(f64, f64)>,
    pub samples: Samples,
}

/// Samples of a view's maps; empty if missing.
#[derive(Default)]
pub struct Samples {
    /// Validated depths, 0 where there is none.
    pub depth: Vec<f32>,
    /// x, then y, then z of all samples.
    pub normal: Vec<f32>,
    /// 0 to 1.
    pub confidence: Vec<f32>,
    /// Number of source views that agree.
    pub sources: Vec<u8>,
    pub color: Vec<[u8; 3]>,
}

/// Makes the pictures of a view, of this width at most. What cannot be read is missing.
pub fn make(files: &RunFiles, view: usize, width: u32) -> Thumbnails {
    let image = &files.model.images[view];
    let (name, camera) = (&image.name, &image.camera);
    let grid = SampleGrid::new(camera, width);
    let map = |path: &Path, channels| map_samples::read(path, channels, camera, grid).unwrap_or_default();
    let preview = |what: &str| read_numbers(files, view, &files.workspace.preview(name, what), grid);
    let depth = map(&files.workspace.depth_map(name, MapKind::Validated), 1);
    let mut confidence = map(&files.workspace.confidence_map(name, MapKind::Validated), 1);
    if confidence.is_empty() {
        let of_preview = preview("confidence").unwrap_or_default();
        confidence = of_preview.iter().map(|&number| f32::from(number) / 255.0).collect();
    }
    let count = files.view_report(view).and_then(|report| report["sources"].as_array().map(Vec::len));
    let sources = count.filter(|&count| count > 0).and_then(|count| {
        // A preview has the share of all sources, rounded down.
        let number = |&share: &u8| (usize::from(share) * count).div_ceil(255).min(255) as u8;
        Some(preview("views")?.iter().map(number).collect())
    });
    let status = read_numbers(files, view, &files.workspace.status_map(name), grid);
    let color: Vec<[u8; 3]> =
        files.scene.read_picture(name, camera).map(|picture| reduced(&picture, grid)).unwrap_or_default();
    let normal = map(&files.workspace.normal_map(name, MapKind::Validated), 3);
    let samples = Samples { depth, normal, confidence, sources: sources.unwrap_or_default(), color };
    let depth_range = depth_range(&samples.depth);
    let gray = |numbers: Vec<u8>| {
        (!numbers.is_empty()).then(|| png(&numbers, grid, ExtendedColorType::L8)).flatten()
    };
    let layers = [
        photograph(&samples.color, grid),
        depth_range.and_then(|range| gray(depth_numbers(&samples.depth, range))),
        normal_numbers(&samples.normal).and_then(|numbers| png(&numbers, grid, ExtendedColorType::Rgb8)),
        gray(samples.sources.clone()),
        gray(confidence_numbers(&samples)),
        status.and_then(gray),
    ];
    Thumbnails { grid, layers, depth_range, samples }
}

/// The numbers of a gray picture of the view's size, sampled.
fn read_numbers(files: &RunFiles, view: usize, path: &Path, grid: SampleGrid) -> Option<Vec<u8>> {
    let camera = &files.model.images[view].camera;
    let picture = ImageReader::open(path).ok()?.with_guessed_format().ok()?.decode().ok()?.into_luma8();
    if picture.dimensions() != (camera.width, camera.height) {
        return None;
    }
    let cells = (0..grid.rows).flat_map(|row| (0..grid.columns).map(move |column| (column, row)));
    Some(
        cells
            .map(|cell| {
                let (x, y) = grid.pixel(camera, cell);
                picture.get_pixel(x, y).0[0]
            })
            .collect(),
    )
}

/// The mean color of each cell.
fn reduced(picture: &Picture, grid: SampleGrid) -> Vec<[u8; 3]> {
    let (width, height) = (picture.width(), picture.height());
    let bounds = |cell: u32, cells: u32, pixels: u32| {
        let edge = |cell: u32| (u64::from(cell) * u64::from(pixels) / u64::from(cells)) as usize;
        (edge(cell), edge(cell + 1).max(edge(cell) + 1))
    };
    let columns: Vec<(usize, usize)> =
        (0..grid.columns).map(|column| bounds(column, grid.columns, width)).collect();
    let mut colors = Vec::with_capacity(grid.len());
    for row in 0..grid.rows {
        let (top, bottom) = bounds(row, grid.rows, height);
        let mut sums = vec![[0_u32; 3]; columns.len()];
        for y in top..bottom {
            for (sum, &(left, right)) in sums.iter_mut().zip(&columns) {
                for x in left..right {
                    let rgb = picture.rgb(y * width as usize + x);
                    sum.iter_mut().zip(rgb).for_each(|(sum, channel)| *sum += u32::from(channel));
                }
            }
        }
        let mean = |(sum, &(left, right)): (&[u32; 3], &(usize, usize))| {
            let pixels = ((right - left) * (bottom - top)) as u32;
            sum.map(|sum| ((sum + pixels / 2) / pixels) as u8)
        };
        colors.extend(sums.iter().zip(&columns).map(mean));
    }
    colors
}

fn photograph(colors: &[[u8; 3]], grid: SampleGrid) -> Option<Vec<u8>> {
    if colors.is_empty() {
        return None;
    }
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, PHOTOGRAPH_QUALITY);
    encoder.write_image(colors.as_flattened(), grid.columns, grid.rows, ExtendedColorType::Rgb8).ok()?;
    Some(bytes)
}

fn png(numbers: &[u8], grid: SampleGrid, kind: ExtendedColorType) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(numbers, grid.columns, grid.rows, kind)
        .ok()?;
    Some(bytes)
}

/// The depths at the percentiles; `None` without depths.
fn depth_range(depth: &[f32]) -> Option<(f64, f64)> {
    let mut valid: Vec<f32> = depth.iter().copied().filter(|&depth| depth > 0.0).collect();
    if valid.is_empty() {
        return None;
    }
    let mut at = |share: f64| {
        let index = ((valid.len() - 1) as f64 * share).round() as usize;
        f64::from(*valid.select_nth_unstable_by(index, f32::total_cmp).1)
    };
    let (low, high) = (at(DEPTH_PERCENTILES.0), at(DEPTH_PERCENTILES.1));
    // A plane that faces the camera has one depth.
    Some((low, high.max(low * (1.0 + 1e-6))))
}

/// 0 for no depth, else 1 to 255, even steps in the logarithm; depths beyond the range have its ends.
fn depth_numbers(depth: &[f32], (low, high): (f64, f64)) -> Vec<u8> {
    let scale = DEPTH_STEPS / (high / low).ln();
    let number = |&depth: &f32| match depth > 0.0 {
        true => 1 + ((f64::from(depth) / low).ln() * scale).round().clamp(0.0, DEPTH_STEPS) as u8,
        false => 0,
    };
    depth.iter().map(number).collect()
}

/// 0 for no depth, else 1 and the steps of the confidence.
fn confidence_numbers(samples: &Samples) -> Vec<u8> {
    let has_depth = |index: usize| samples.depth.get(index).is_none_or(|&depth| depth > 0.0);
    let number = |(index, &confidence): (usize, &f32)| match has_depth(index) {
        true => 1 + (confidence.clamp(0.0, 1.0) * CONFIDENCE_STEPS).round() as u8,
        false => 0,
    };
    samples.confidence.iter().enumerate().map(number).collect()
}

/// Normals as colors: x to the right is red, y up is green, z to the camera is blue; 0 for none.
fn normal_numbers(normal: &[f32]) -> Option<Vec<u8>> {
    let count = normal.len() / 3;
    let number = |component: f32| {
        let steps = 255 / NORMAL_STEP;
        let step = ((component * 0.5 + 0.5) * f32::from(steps)).round().clamp(0.0, f32::from(steps)) as u8;
        step * NORMAL_STEP + NORMAL_STEP / 2
    };
    let numbers = (0..count).flat_map(|index| {
        let [x, y, z] = [normal[index], normal[count + index], normal[2 * count + index]];
        if [x, y, z] == [0.0; 3] { [0; 3] } else { [number(x), number(-y), number(-z)] }
    });
    (count > 0).then(|| numbers.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_even_in_the_logarithm_between_the_percentiles() {
        let depth: Vec<f32> = (0..=1000).map(|index| if index == 0 { 0.0 } else { index as f32 }).collect();
        let range = depth_range(&depth).unwrap();
        assert_eq!(range, (11.0, 990.0));
        let numbers = depth_numbers(&depth, range);
        assert_eq!((numbers[0], numbers[1], numbers[11], numbers[990], numbers[1000]), (0, 1, 1, 255, 255));
        let step = (range.1 / range.0).ln() / DEPTH_STEPS;
        for (index, &number) in numbers.iter().enumerate().take(991).skip(11) {
            let read = range.0 * (f64::from(number - 1) * step).exp();
            assert!((read / index as f64).ln().abs() <= step / 2.0 + 1e-9, "{index}: {read}");
        }
        assert_eq!(depth_range(&[0.0; 4]), None);
    }

    #[test]
    fn normals_and_confidences_are_stored_within_their_steps() {
        let numbers = normal_numbers(&[0.0, 0.6, 0.0, 0.0, 0.0, -0.8]).unwrap();
        assert_eq!(numbers[..3], [0; 3], "no normal");
        let read = |number: u8| (f32::from(number - NORMAL_STEP / 2) / 252.0) * 2.0 - 1.0;
        let found = [read(numbers[3]), -read(numbers[4]), -read(numbers[5])];
        assert!(found.iter().zip([0.6, 0.0, -0.8]).all(|(found, truth)| (found - truth).abs() < 0.017));
        let samples =
            Samples { depth: vec![0.0, 1.0, 1.0], confidence: vec![0.0, 0.0, 1.0], ..Samples::default() };
        assert_eq!(confidence_numbers(&samples), [0, 1, 51]);
    }

    #[test]
    fn photographs_are_averaged_over_the_cells() {
        let picture = Picture::from_gray(4, 2, vec![0, 100, 200, 0, 100, 200, 0, 100]).unwrap();
        let grid = SampleGrid { columns: 2, rows: 1 };
        assert_eq!(reduced(&picture, grid), [[100; 3], [75; 3]]);
    }
}
