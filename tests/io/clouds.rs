//! Clouds far from the origin, in LAS and LAZ, and as scenes for Gaussian splatting.

use crate::{assert_refused, model};
use skep::io::{ColmapModel, Workspace, read_ply, read_visibility, write_ply};
use skep::{PointCloud, PointViews};
use std::fs::read;
use std::path::Path;
use tempfile::tempdir;

/// A square of 40 x 40 points with gaps of a millimeter.
fn square(corner: [f64; 3]) -> PointCloud {
    let mut cloud = PointCloud::default();
    for index in 0..1600 {
        let [x, y, z] = corner;
        cloud.positions.push([x + 1e-3 * f64::from(index % 40), y + 1e-3 * f64::from(index / 40), z]);
        cloud.normals.push([0.0, 0.6, -0.8]);
        cloud.colors.push([255, (index % 256) as u8, 0]);
        cloud.views.push(&[index % 3, 7]);
    }
    cloud
}

const ECEF: [f64; 3] = [4_123_456.7, -912_345.6, 4_765_432.1];

#[test]
fn positions_that_floats_cannot_hold_are_doubles() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("fused.ply");
    write_ply(&path, &square(ECEF)).unwrap();
    let bytes = read(&path).unwrap();
    let header = String::from_utf8_lossy(&bytes[..400]).into_owned();
    assert!(
        header.contains("property double x\nproperty double y\nproperty double z\nproperty float nx\n"),
        "{header}"
    );
    let length = header.find("end_header\n").unwrap() + "end_header\n".len();
    assert_eq!(bytes.len() - length, 1600 * 39);
    assert_eq!(bytes[length..length + 8], ECEF[0].to_le_bytes());
    assert_eq!(read_ply(&path).unwrap(), PointCloud { views: PointViews::default(), ..square(ECEF) });

    write_ply(&path, &square([10.0, -20.0, 3.0])).unwrap();
    assert!(String::from_utf8_lossy(&read(&path).unwrap()[..400]).contains("property float x\n"));
}

#[test]
fn a_file_of_another_ending_is_refused() {
    let folder = tempdir().unwrap();
    let write = |name: &str| Workspace::write_cloud(&folder.path().join(name), &square(ECEF));
    assert_refused(write("cloud.xyz"), &["cloud.xyz", "ply, las, laz"]);
    assert_refused(write("cloud"), &["ply, las, laz"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[cfg(feature = "las")]
#[test]
fn las_and_laz_hold_positions_colors_and_normals() {
    let folder = tempdir().unwrap();
    for (name, corner) in [("a.las", ECEF), ("a.laz", ECEF), ("b.LAZ", [0.0, 0.0, 2.0])] {
        let (path, cloud) = (folder.path().join(name), square(corner));
        Workspace::write_cloud(&path, &cloud).unwrap();
        let mut reader = las::Reader::from_path(&path).unwrap();
        let header = reader.header().clone();
        assert_eq!((header.number_of_points(), header.version().minor), (1600, 4));
        assert_eq!(header.point_format().is_compressed, !name.ends_with("las"));
        assert!(header.transforms().x.scale <= 1e-3 / 8.0, "{:?}", header.transforms());
        let data = reader.read_all().unwrap();
        let points: Vec<las::Point> = data.points().map(Result::unwrap).collect();
        for (index, point) in points.iter().enumerate() {
            let [x, y, z] = cloud.positions[index];
            let error = (point.x - x).abs().max((point.y - y).abs()).max((point.z - z).abs());
            assert!(error < 1e-4, "{name}, point {index}: {error}");
            let green = u16::from(cloud.colors[index][1]) * 257;
            assert_eq!(point.color, Some(las::Color::new(65535, green, 0)));
            let normal =
                point.extra_bytes.chunks(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()));
            assert!(normal.eq(cloud.normals[index]));
        }
        let visibility = folder.path().join(format!("{name}.vis"));
        assert_eq!(read_visibility(&visibility).unwrap(), cloud.views);
    }
    let same =
        |a: &str, b: &str| read(folder.path().join(a)).unwrap() == read(folder.path().join(b)).unwrap();
    Workspace::write_cloud(&folder.path().join("again.las"), &square(ECEF)).unwrap();
    assert!(same("a.las", "again.las"));
    Workspace::write_cloud(&folder.path().join("empty.laz"), &PointCloud::default()).unwrap();
    assert_eq!(
        las::Reader::from_path(folder.path().join("empty.laz")).unwrap().header().number_of_points(),
        0
    );
}

#[test]
fn a_scene_for_splatting_has_cameras_photographs_and_the_points_of_the_cloud() {
    let folder = tempdir().unwrap();
    let photographs = folder.path().join("images");
    for image in model().images {
        let path = photographs.join(&image.name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "photograph").unwrap();
    }
    let (splat, cloud) = (folder.path().join("splat"), square([1.0, 2.0, 3.0]));
    for _ in 0..2 {
        Workspace::write_splat(&splat, &model().images, &photographs, &cloud).unwrap();
    }
    let found = ColmapModel::read(&splat.join("sparse/0")).unwrap();
    assert_eq!(found.images.len(), 2);
    for (found, expected) in found.images.iter().zip(model().images) {
        assert_eq!(found.name, expected.name);
        assert!((found.camera.translation - expected.camera.translation).length() < 1e-12);
        assert!(splat.join("images").join(&found.name).is_file());
    }
    let positions: Vec<[f64; 3]> = found.points.iter().map(|point| point.position.to_array()).collect();
    assert_eq!(positions, cloud.positions);
    let bytes = read(splat.join("sparse/0/points3D.bin")).unwrap();
    assert_eq!(bytes.len(), 8 + 1600 * (8 + 24 + 3 + 8 + 8));
    assert_eq!(bytes[8 + 32..8 + 35], cloud.colors[0]);
    let ply = read_ply(&splat.join("sparse/0/points3D.ply")).unwrap();
    assert_eq!((ply.normals, ply.colors), (cloud.normals, cloud.colors));
    assert!(!Path::new(&splat.join("sparse/0/points3D.ply.vis")).exists());
}
