//! The dense folder, written and read back.

use crate::scene_folder::write_pictures;
use crate::{assert_refused, camera, model};
use skep::geometry::ViewSets;
use skep::io::{
    MapKind, SceneFolder, Workspace, read_consistency_graph, read_ply, read_visibility, write_depth_map,
    write_normal_map,
};
use skep::{Counts, Maps, PixelStatus, PointCloud, PointViews, ViewResult};
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// A result of 6 x 4 pixels: pixel 3 is validated, pixel 4 inconsistent, the others masked. Its sources are
/// the views 5 and 2 of the scene, both used by pixel 3, the second by pixel 4.
fn result() -> ViewResult {
    let mut result = ViewResult {
        width: 6,
        raw: Maps { depth: vec![0.0; 24], normal: vec![[0.0; 3]; 24] },
        cost: vec![0.0; 24],
        confidence: vec![0.5; 24],
        status: vec![PixelStatus::Masked; 24],
        sources: vec![5, 2],
        view_sets: ViewSets::empty(24, 2),
        counts: Counts::default(),
        cycles: vec![],
    };
    for (pixel, status) in [(3, PixelStatus::Validated), (4, PixelStatus::Inconsistent)] {
        result.raw.depth[pixel] = pixel as f32;
        result.raw.normal[pixel] = [0.0, 0.6, -0.8];
        result.status[pixel] = status;
        result.view_sets.insert(pixel, 1);
    }
    result.view_sets.insert(3, 0);
    result
}

/// A scene with a dense folder in it.
fn scene() -> (TempDir, Workspace) {
    let folder = tempdir().unwrap();
    model().write_text(&folder.path().join("sparse")).unwrap();
    write_pictures(folder.path(), &model());
    let workspace = Workspace::new(folder.path().join("dense"));
    std::fs::create_dir(workspace.folder()).unwrap();
    (folder, workspace)
}

const NAME: &str = "cam 1/right side.png";

#[test]
fn a_view_is_written_as_colmap_lays_it_out() {
    let (_folder, workspace) = scene();
    workspace.write_view(NAME, &camera(0.0), &result()).unwrap();
    for file in [
        "stereo/depth_maps/cam 1/right side.png.photometric.bin",
        "stereo/normal_maps/cam 1/right side.png.geometric.bin",
        "stereo/consistency_graphs/cam 1/right side.png.geometric.bin",
        "preview/cam 1/right side.png.depth.png",
        "preview/cam 1/right side.png.normal.png",
        "preview/cam 1/right side.png.views.png",
        "preview/cam 1/right side.png.confidence.png",
        "stereo/confidence_maps/cam 1/right side.png.geometric.bin",
    ] {
        assert!(workspace.folder().join(file).is_file(), "{file}");
    }
    let raw = workspace.read_maps(NAME, MapKind::Raw, &camera(0.0)).unwrap();
    assert_eq!(raw, result().raw);
    let validated = workspace.read_maps(NAME, MapKind::Validated, &camera(0.0)).unwrap();
    assert_eq!(validated, result().validated());
    assert_eq!((validated.depth[3], validated.depth[4]), (3.0, 0.0));
}

#[test]
fn consistency_graphs_name_the_views_of_the_scene() {
    let (_folder, workspace) = scene();
    workspace.write_view(NAME, &camera(0.0), &result()).unwrap();
    let graph = |kind| read_consistency_graph(&workspace.consistency_graph(NAME, kind)).unwrap();
    let raw = graph(MapKind::Raw);
    assert_eq!(raw.pixels, [[3, 0], [4, 0]]);
    assert_eq!((raw.views.get(0), raw.views.get(1)), ([5, 2].as_slice(), [2].as_slice()));
    assert_eq!(graph(MapKind::Validated).pixels, [[3, 0]], "validated pixels only");
}

#[test]
fn a_cloud_is_written_with_its_visibility_beside_it() {
    let (_folder, workspace) = scene();
    let mut views = PointViews::default();
    views.push(&[1, 0]);
    let cloud = PointCloud {
        positions: vec![[1.0, 2.0, 3.0]],
        normals: vec![[0.0, 0.0, 1.0]],
        colors: vec![[1, 2, 3]],
        views: views.clone(),
    };
    Workspace::write_cloud(&workspace.cloud(), &cloud).unwrap();
    assert_eq!(read_ply(&workspace.folder().join("fused.ply")).unwrap().positions, cloud.positions);
    assert_eq!(read_visibility(&workspace.folder().join("fused.ply.vis")).unwrap(), views);
}

#[test]
fn maps_that_do_not_fit_are_refused() {
    let (_folder, workspace) = scene();
    let read = |camera| workspace.read_maps("a.png", MapKind::Validated, &camera);
    assert_refused(read(camera(0.0)), &["depth_maps", "a.png.geometric.bin", "cannot be read"]);
    let (depth, normal) =
        (workspace.depth_map("a.png", MapKind::Validated), workspace.normal_map("a.png", MapKind::Validated));
    write_depth_map(&depth, 6, 4, &[1.0; 24]).unwrap();
    assert_refused(read(camera(0.0)), &["normal_maps", "cannot be read"]);
    write_normal_map(&normal, 4, 6, &[[0.0, 0.0, -1.0]; 24]).unwrap();
    assert_refused(read(camera(0.0)), &["normal_maps", "4x6", "6x4"]);
    write_normal_map(&normal, 6, 4, &[[0.0, 0.0, -1.5]; 24]).unwrap();
    assert_refused(read(camera(0.0)), &["column 0, row 0", "length 1.5"]);
    write_depth_map(&depth, 6, 4, &[0.0; 24]).unwrap();
    assert_eq!(read(camera(0.0)).unwrap().normal, [[0.0; 3]; 24], "no depth, no normal");
}

#[test]
fn a_workspace_finds_its_own_scene_or_the_one_above() {
    let (folder, workspace) = scene();
    let above = folder.path().canonicalize().unwrap();
    assert_eq!(workspace.find_scene().unwrap(), SceneFolder::find(&above).unwrap());
    model().write_binary(&workspace.folder().join("sparse")).unwrap();
    assert_eq!(workspace.find_scene().unwrap(), SceneFolder::find(&above.join("dense")).unwrap());
    let (lost, none) = (folder.path().join("images/cam 1"), Path::new("no such workspace"));
    assert_refused(Workspace::new(lost).find_scene(), &["cam 1", "folder above", "sparse/"]);
    assert_refused(Workspace::new(none).find_scene(), &["no such workspace"]);
}

#[test]
fn the_maps_of_a_workspace_are_found_and_those_that_are_missing_too() {
    let (folder, workspace) = scene();
    let found = workspace.find_scene().unwrap();
    assert_refused(workspace.maps(&found), &["no depth maps", "left.png.geometric.bin"]);

    workspace.write_view(NAME, &camera(0.5), &result()).unwrap();
    std::fs::remove_file(folder.path().join("images/left.png")).unwrap();
    let maps = workspace.maps(&found).unwrap();
    let has_maps: Vec<(&str, bool)> =
        maps.views.iter().map(|view| (view.name.as_str(), view.has_maps)).collect();
    assert_eq!(maps.kind, MapKind::Validated);
    assert_eq!(has_maps, [("left.png", false), (NAME, true)], "views keep their places in the file");
    assert!(!maps.views[0].has_photograph && maps.read_picture(0).unwrap().is_none());
    maps.check_sizes().unwrap();
    assert_eq!(maps.read_maps(1).unwrap(), result().validated());
    assert_eq!(maps.read_picture(1).unwrap().unwrap().rgb(0), [1, 50, 60]);
    assert!(maps.read_confidence(1).unwrap().is_some());
    assert_eq!(maps.points.len(), 3);

    std::fs::remove_file(workspace.depth_map(NAME, MapKind::Validated)).unwrap();
    let maps = workspace.maps(&found).unwrap();
    assert_eq!((maps.kind, &maps.read_maps(1).unwrap()), (MapKind::Raw, &result().raw));
    std::fs::remove_file(workspace.normal_map(NAME, MapKind::Raw)).unwrap();
    assert_refused(maps.check_sizes(), &["normal_maps", "photometric.bin", "cannot be read"]);
}

#[test]
fn a_workspace_takes_the_scene_in_and_lists_its_images() {
    let (folder, workspace) = scene();
    let names: Vec<String> = model().images.into_iter().map(|image| image.name).collect();
    workspace.write_lists(names.iter().map(String::as_str)).unwrap();
    let stereo = workspace.folder().join("stereo");
    let lines = |file: &str| std::fs::read_to_string(stereo.join(file)).unwrap();
    assert_eq!(lines("fusion.cfg").lines().collect::<Vec<_>>(), names);
    assert_eq!(lines("patch-match.cfg").lines().nth(3), Some("__auto__, 20"));

    let outside = SceneFolder::find(folder.path()).unwrap();
    std::fs::create_dir_all(workspace.folder().join("sparse")).unwrap();
    let own = workspace.folder().join("sparse/points3D.txt");
    std::fs::write(&own, "# mine\n").unwrap();
    // A second call finds its own files.
    for _ in 0..2 {
        workspace.adopt(&outside).unwrap();
        let inside = SceneFolder::find(workspace.folder()).unwrap();
        assert_eq!(inside.sparse, workspace.folder().join("sparse"));
        for name in &names {
            let read = |folder: &SceneFolder| std::fs::read(folder.images.join(name)).unwrap();
            assert_eq!(read(&inside), read(&outside), "{name}");
        }
    }
    assert_eq!(std::fs::read_to_string(own).unwrap(), "# mine\n", "existing files are kept");
    // A model that is changed in the workspace is not changed in the scene.
    let before = std::fs::read(outside.sparse.join("cameras.txt")).unwrap();
    let cameras = workspace.folder().join("sparse/cameras.txt");
    std::fs::OpenOptions::new().write(true).truncate(true).open(cameras).unwrap();
    assert_eq!(std::fs::read(outside.sparse.join("cameras.txt")).unwrap(), before);
}
