//! Scenes that are not yet what a run reads: distorted, too large, masked, chosen in part.

use super::{HEIGHT, NAMES, WIDTH, files, path, report, skep, small_board, text};
use skep::geometry::{Distortion, Lens};
use skep::io::{ColmapModel, read_depth_map};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn reconstruct(scene: &TempDir, output: &TempDir, more: &[&str]) -> String {
    let arguments = ["reconstruct", path(scene), "--preset", "fast", "--output", path(output)];
    let done = skep(&[&arguments[..], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    text(&done.stderr).to_owned()
}

fn validated_share(output: &TempDir) -> f64 {
    let totals = &report(output.path())["totals"];
    totals["status_counts"]["validated"].as_f64().unwrap() / totals["pixels"].as_f64().unwrap()
}

/// Rewrites the photographs of the small board as a lens of this distortion would show them, and the model.
fn distort(scene: &TempDir, [k1, k2]: [f64; 2]) {
    let model = ColmapModel::read(&scene.path().join("sparse")).unwrap();
    let pinhole = model.images[0].camera;
    let lens = Lens { camera: pinhole, distortion: Some(Distortion::brown(&[k1, k2], [0.0; 2])) };
    for image in &model.images {
        let file = scene.path().join("images").join(&image.name);
        let ideal = image::open(&file).unwrap().into_rgb8();
        let shown = image::RgbImage::from_fn(pinhole.width, pinhole.height, |x, y| {
            let place = pinhole.ray(glam::DVec2::new(x.into(), y.into())).truncate();
            let ray = lens.distortion.unwrap().undistort(place).unwrap();
            let at = (pinhole.fx * ray.x + pinhole.cx, pinhole.fy * ray.y + pinhole.cy);
            let sample = image::imageops::interpolate_bilinear(&ideal, at.0 as f32, at.1 as f32);
            sample.unwrap_or(image::Rgb([0; 3]))
        });
        shown.save(&file).unwrap();
    }
    let cameras = scene.path().join("sparse/cameras.txt");
    let line = format!(
        "1 RADIAL {} {} {} {} {} {k1} {k2}\n",
        pinhole.width,
        pinhole.height,
        pinhole.fx,
        pinhole.cx + 0.5,
        pinhole.cy + 0.5
    );
    fs::write(cameras, line).unwrap();
}

#[test]
fn a_distorted_scene_is_undistorted_into_the_workspace_and_gives_nearly_the_same_maps() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, &output, &[]);

    let (distorted, undistorted) = (small_board(), TempDir::new().unwrap());
    distort(&distorted, [-0.06, 0.01]);
    let before = files(distorted.path());
    reconstruct(&distorted, &undistorted, &[]);
    assert_eq!(files(distorted.path()), before, "the scene is left as it is");
    // What was written is a workspace of its own.
    let model = ColmapModel::read(&undistorted.path().join("sparse")).unwrap();
    let camera = model.images[0].camera;
    assert_ne!((camera.width, camera.height), (WIDTH as u32 / 4, HEIGHT as u32 / 4));
    let photograph = undistorted.path().join("images").join(NAMES[0]);
    assert_eq!(image::image_dimensions(photograph).unwrap(), (camera.width, camera.height));
    let map = undistorted.path().join(format!("stereo/depth_maps/{}.geometric.bin", NAMES[0]));
    let map = read_depth_map(&map).unwrap();
    assert_eq!((map.width, map.height), (camera.width, camera.height));
    let pinhole = ColmapModel::read(&output.path().join("sparse")).unwrap().images[0].camera;
    let straight = output.path().join(format!("stereo/depth_maps/{}.geometric.bin", NAMES[0]));
    let straight = read_depth_map(&straight).unwrap();
    let (mut both, mut same) = (0, 0);
    for (pixel, &depth) in map.values.iter().enumerate() {
        let place = glam::DVec2::new((pixel as u32 % map.width).into(), (pixel as u32 / map.width).into());
        let point = camera.unproject(place, depth.into());
        let (there, expected) = pinhole.project(point).unwrap_or_default();
        let Some((x, y)) = pinhole.nearest_pixel(there).filter(|_| depth > 0.0) else { continue };
        let found = straight.values[(y * straight.width + x) as usize];
        both += u32::from(found > 0.0);
        same += u32::from(found > 0.0 && (f64::from(found) / expected - 1.0).abs() < 0.05);
    }
    assert!(both > 4000 && same > both * 17 / 20, "{same} of {both}");

    // The same command finds everything done.
    let printed = reconstruct(&distorted, &undistorted, &[]);
    assert!(printed.contains("complete before"), "{printed}");
}

#[test]
fn photographs_are_reduced_chosen_and_masked_as_asked() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let masks = TempDir::new().unwrap();
    let (width, height) = (WIDTH as u32 / 4, HEIGHT as u32 / 4);
    // The left half of the first photograph is ignored.
    let mask =
        image::GrayImage::from_fn(width, height, |x, _| image::Luma([if x < width / 2 { 0 } else { 255 }]));
    mask.save(masks.path().join(format!("{}.png", NAMES[0]))).unwrap();
    let first_four = NAMES[..4].join(",");
    let arguments = ["--max-image-size", "120", "--images", &first_four, "--masks", path(&masks)];
    let printed = reconstruct(&scene, &output, &arguments);
    assert!(printed.contains("3 photographs have no mask"), "{printed}");

    let views = report(output.path())["views"].as_array().unwrap().clone();
    assert_eq!(views.len(), 4);
    assert_eq!((views[0]["width"].as_u64(), views[0]["height"].as_u64()), (Some(120), Some(68)));
    let masked = |view: usize| views[view]["status_counts"]["masked"].as_u64().unwrap();
    assert_eq!((masked(0), masked(1)), (60 * 68, 0));

    let refused = skep(&["reconstruct", path(&scene), "--images", "nothing*", "--output", path(&output)]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("`nothing*`"), "{}", text(&refused.stderr));
}

#[test]
fn only_references_get_maps_and_only_their_sources_are_taken() {
    let (scene, output, lists) = (small_board(), TempDir::new().unwrap(), TempDir::new().unwrap());
    let others = NAMES[1..4].join(",");
    let (sources, ranges) = (lists.path().join("patch-match.cfg"), lists.path().join("ranges"));
    fs::write(&sources, format!("{}\n{others}\n", NAMES[0])).unwrap();
    fs::write(&ranges, format!("{} 0.5 1000\n", NAMES[1])).unwrap();
    let sources = ["--sources", sources.to_str().unwrap()];
    let arguments = ["--reference", NAMES[0], "--depth-ranges", ranges.to_str().unwrap()];
    reconstruct(&scene, &output, &[arguments, [sources[0], sources[1], "--write", "depth"]].concat());

    let maps: Vec<_> = fs::read_dir(output.path().join("stereo/depth_maps")).unwrap().flatten().collect();
    assert!(maps.iter().all(|map| map.file_name().to_str().unwrap().starts_with(NAMES[0])), "{maps:?}");
    assert!(!maps.is_empty());
    let report = report(output.path());
    let views = report["views"].as_array().unwrap();
    let references: Vec<_> = views.iter().map(|view| view["reference"].as_bool().unwrap()).collect();
    assert_eq!(references, [true, false, false, false], "four of seven photographs are read");
    assert_eq!(report["totals"]["pixels"], views[0]["pixels"], "of the maps that there are");
    assert!(validated_share(&output) > 0.3, "{}", validated_share(&output));
    assert_eq!((views[1]["depth_min"].as_f64(), views[1]["depth_max"].as_f64()), (Some(0.5), Some(1000.0)));
    let list = fs::read_to_string(output.path().join("stereo/fusion.cfg")).unwrap();
    assert_eq!(list, format!("{}\n", NAMES[0]));
    // The same command finds everything done, and the maps belong to the run.
    let again = [&arguments[..], &sources, &["--write", "depth"]].concat();
    assert!(reconstruct(&scene, &output, &again).contains("complete before"));
}

#[test]
fn a_distorted_scene_is_read_into_memory_undistorted_reduced_and_chosen() {
    let scene = small_board();
    distort(&scene, [-0.06, 0.01]);
    let mut options = skep::Options::default();
    options.set("input.max_image_size", "100").unwrap();
    options.set("input.images", &NAMES[..3].join(",")).unwrap();
    let read = skep::import::read_scene(scene.path(), None, &options, &skep::ignore_progress).unwrap();
    assert_eq!(read.views().len(), 3);
    let view = &read.views()[0];
    assert_eq!(view.camera.width.max(view.camera.height), 100);
    assert_eq!(view.picture.size(), (view.camera.width, view.camera.height));
    assert!(view.picture.decoded().is_some() && !read.points().is_empty());
}

#[test]
fn of_several_models_the_largest_is_the_run_s() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let sparse = scene.path().join("sparse");
    let mut model = ColmapModel::read(&sparse).unwrap();
    for name in ["cameras.txt", "images.txt", "points3D.txt"] {
        fs::remove_file(sparse.join(name)).unwrap();
    }
    model.write_binary(&sparse.join("1")).unwrap();
    // The part of the photographs that the mapper registered first.
    model.images.truncate(3);
    model.points.iter_mut().for_each(|point| point.views.retain(|&view| view < 3));
    model.write_binary(&sparse.join("0")).unwrap();
    let done = skep(&["plan", path(&scene), "--output", path(&output)]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stderr).contains("sparse/1"), "{}", text(&done.stderr));
    assert_eq!(ColmapModel::read(&output.path().join("sparse")).unwrap().images.len(), NAMES.len());
}

#[test]
fn bounds_leave_only_what_is_inside() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, &output, &["--bounds", "-0.3", "-10", "-10", "0.3", "10", "10"]);
    let cloud = fs::read(output.path().join("fused.ply")).unwrap();
    let positions = positions(&cloud);
    assert!(positions.len() > 100, "{}", positions.len());
    assert!(positions.iter().all(|position| position[0].abs() <= 0.3 + 1e-6));
}

/// Positions in a PLY file whose vertices begin with three floats and have 27 bytes.
fn positions(ply: &[u8]) -> Vec<[f32; 3]> {
    let end = b"end_header\n";
    let start = ply.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    let vertex = |bytes: &[u8]| [0, 4, 8].map(|at| number(&bytes[at..at + 4]));
    ply[start..].chunks_exact(27).map(vertex).collect()
}

#[test]
fn twelve_bits_in_sixteen_are_used_in_full() {
    let (scene, output, deep) = (small_board(), TempDir::new().unwrap(), TempDir::new().unwrap());
    reconstruct(&scene, &output, &[]);
    for name in NAMES {
        let file = scene.path().join("images").join(name);
        let eight = image::open(&file).unwrap().into_luma8();
        let twelve =
            image::ImageBuffer::<image::Luma<u16>, _>::from_fn(eight.width(), eight.height(), |x, y| {
                image::Luma([u16::from(eight.get_pixel(x, y).0[0]) * 16])
            });
        save_png(&file, &image::DynamicImage::from(twelve));
    }
    let printed = reconstruct(&scene, &deep, &[]);
    assert!(printed.contains("4095 is taken as white"), "{printed}");
    let (eight, twelve) = (validated_share(&output), validated_share(&deep));
    assert!((eight - twelve).abs() < 0.02, "{twelve} instead of {eight}");
}

fn save_png(file: &Path, image: &image::DynamicImage) {
    image.save_with_format(file, image::ImageFormat::Png).unwrap();
}
