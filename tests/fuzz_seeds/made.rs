//! The seeds that are made by this crate's writers.

use crate::targets;
use glam::{DMat3, DVec3, Vec3};
use skep::geometry::Camera;
use skep::io::*;
use skep::{EstimateRef, PointCloud, PointViews, SparsePoint, ignore_progress};
use std::path::Path;
use tempfile::tempdir;

/// The files with [`targets::BETWEEN`] between them.
fn joined(files: &[&[u8]]) -> Vec<u8> {
    files.join(targets::BETWEEN)
}

/// Writes a file and returns its bytes.
fn bytes_of(name: &str, write: impl FnOnce(&Path) -> skep::Result<()>) -> Vec<u8> {
    let folder = tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path).unwrap();
    std::fs::read(path).unwrap()
}

fn model() -> ColmapModel {
    let image = |index: u32| {
        let translation = DVec3::new(-0.2 * f64::from(index), 0.0, 0.0);
        let (rotation, fx) = (DMat3::IDENTITY, 24.0);
        let camera = Camera { width: 24, height: 16, fx, fy: fx, cx: 11.5, cy: 7.5, rotation, translation };
        ModelImage { name: format!("{index:08}.png"), camera }
    };
    let point = |x: f64| SparsePoint { position: DVec3::new(x, 0.1, 4.0), views: vec![0, 1, 2] };
    ColmapModel { images: (0..3).map(image).collect(), points: vec![point(0.0), point(0.5)] }
}

fn picture(format: image::ImageFormat, color: image::ColorType) -> Vec<u8> {
    let pixels = image::DynamicImage::new(12, 8, color);
    let mut bytes = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// Writes the seeds below a folder.
pub fn write(seeds: &Path) {
    let put = |target: &str, name: &str, content: &[u8]| {
        std::fs::create_dir_all(seeds.join(target)).unwrap();
        std::fs::write(seeds.join(target).join(name), content).unwrap();
    };
    models(&put);
    maps_and_clouds(&put);
    pictures(&put);
    runs(&put);
}

type Put<'a> = &'a dyn Fn(&str, &str, &[u8]);

fn models(put: Put) {
    let folder = tempdir().unwrap();
    model().write_text(folder.path()).unwrap();
    model().write_binary(folder.path()).unwrap();
    let files = |ending: &str| {
        let read = |name: &str| std::fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap();
        let (cameras, images, points) = (read("cameras"), read("images"), read("points3D"));
        joined(&[&cameras, &images, &points])
    };
    for (target, ending, kind) in [("colmap_text", "txt", b"t"), ("colmap_binary", "bin", b"b")] {
        put(target, "made", &files(ending));
        put("scene_formats", &format!("colmap_{ending}"), &[&kind[..], &files(ending)].concat());
    }
}

fn maps_and_clouds(put: Put) {
    let depth = bytes_of("map", |path| write_depth_map(path, 3, 2, &[1.0, 1.5, 0.0, 1.0, 1.5, 2.0]));
    let normal = bytes_of("map", |path| write_normal_map(path, 3, 2, &[[0.0, 0.6, -0.8]; 6]));
    let graph = bytes_of("map", |path| {
        write_consistency_graph(path, 3, 2, |pixel| (0..pixel as u32 % 3).map(|view| view + 1))
    });
    for (kind, name, content) in [(b"d", "depth", depth), (b"n", "normal", normal), (b"g", "graph", graph)] {
        put("maps", name, &[&kind[..], &content].concat());
        put("c_files", name, &[&kind[..], &[20, 12], &content].concat());
    }
    for (name, offset) in [("floats", 0.0), ("doubles", 5e6)] {
        let cloud = PointCloud {
            positions: (0..4).map(|x| [offset + f64::from(x) * 1e-3, 1.0, 2.0]).collect(),
            normals: vec![Vec3::NEG_Z.to_array(); 4],
            colors: vec![[9, 8, 7]; 4],
            ..PointCloud::default()
        };
        put("clouds", name, &[b"p", &bytes_of("cloud.ply", |path| write_ply(path, &cloud))[..]].concat());
    }
    let mut views = PointViews::default();
    [&[0, 1, 2][..], &[], &[7]].iter().for_each(|list| views.push(list));
    put("clouds", "views", &[b"v", &bytes_of("views", |path| write_visibility(path, &views))[..]].concat());
}

fn pictures(put: Put) {
    use image::{ColorType, ImageFormat};
    let mask = picture(ImageFormat::Png, ColorType::L8);
    for (name, format, color) in [
        ("png_gray", ImageFormat::Png, ColorType::L8),
        ("png_alpha", ImageFormat::Png, ColorType::Rgba8),
        ("png_deep", ImageFormat::Png, ColorType::L16),
        ("jpeg", ImageFormat::Jpeg, ColorType::Rgb8),
        ("pnm", ImageFormat::Pnm, ColorType::Rgb8),
        ("tiff", ImageFormat::Tiff, ColorType::L16),
        ("tiff_alpha", ImageFormat::Tiff, ColorType::Rgba8),
        ("bmp", ImageFormat::Bmp, ColorType::Rgb8),
        ("webp", ImageFormat::WebP, ColorType::Rgba8),
    ] {
        put("pictures", name, &joined(&[&picture(format, color), &mask]));
    }
}

fn runs(put: Put) {
    let run = targets::new_run();
    for (kind, name) in [
        (b'm', "manifest"),
        (b's', "search"),
        (b'c', "check"),
        (b'n', "next"),
        (b'e', "searched"),
        (b'k', "checked"),
        (b'u', "surface"),
    ] {
        put("run_files", name, &run.seed(kind));
    }
    let (_, stepper) = targets::stepper();
    let unknown = vec![None; 3];
    let searched: Vec<_> =
        (0..3).map(|view| stepper.search(0, view, &unknown, None, &ignore_progress).unwrap()).collect();
    let all: Vec<_> = searched.iter().map(|found| Some(EstimateRef::Searched(found))).collect();
    let checked = stepper.check(&searched[0], &all).unwrap();
    put("estimates", "searched", &searched[0].to_bytes());
    put("estimates", "checked", &checked.to_bytes());
}
