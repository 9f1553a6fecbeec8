//! Fused clouds and their visibility.

use crate::{assert_refused, rewrite};
use skep::io::{read_ply, read_visibility, write_ply, write_visibility};
use skep::{PointCloud, PointViews};
use std::fs::read;
use tempfile::tempdir;

fn cloud() -> PointCloud {
    let mut views = PointViews::default();
    views.push(&[4, 0, 2]);
    views.push(&[]);
    PointCloud {
        positions: vec![[1.0, -2.5, 3.25], [0.0, 0.5, 1e6]],
        normals: vec![[0.0, 0.0, -1.0], [0.6, 0.8, 0.0]],
        colors: vec![[255, 0, 7], [1, 2, 3]],
        views,
    }
}

#[test]
fn clouds_have_colmaps_layout() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("fused.ply");
    write_ply(&path, &cloud()).unwrap();
    let mut expected = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\n\
        property float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        .to_vec();
    for number in [1.0f32, -2.5, 3.25, 0.0, 0.0, -1.0] {
        expected.extend(number.to_le_bytes());
    }
    expected.extend([255, 0, 7]);
    let written = read(&path).unwrap();
    assert_eq!(written.len(), expected.len() + 27);
    assert_eq!(written[..expected.len()], expected);
    assert_eq!(read_ply(&path).unwrap(), PointCloud { views: PointViews::default(), ..cloud() });
}

#[test]
fn a_cloud_may_be_empty() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("fused.ply");
    write_ply(&path, &PointCloud::default()).unwrap();
    write_visibility(&folder.path().join("fused.ply.vis"), &PointViews::default()).unwrap();
    assert_eq!(read_ply(&path).unwrap(), PointCloud::default());
    assert_eq!(read(folder.path().join("fused.ply.vis")).unwrap(), [0; 8]);
}

#[test]
fn broken_clouds_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("fused.ply");
    let read_changed = |change: &dyn Fn(&mut Vec<u8>)| {
        write_ply(&path, &cloud()).unwrap();
        rewrite(&path, change);
        read_ply(&path)
    };
    assert_refused(
        read_changed(&|bytes| bytes.truncate(bytes.len() - 1)),
        &["fused.ply", "fewer than 2 points"],
    );
    assert_refused(read_changed(&|bytes| bytes.push(0)), &["bytes follow the 2 points"]);
    assert_refused(read_changed(&|bytes| bytes.truncate(20)), &["fused.ply"]);
    assert_refused(read_changed(&|bytes| bytes[0] = b'q'), &["fused.ply"]);
    let replace = |from: &'static str, to: &'static str| {
        move |bytes: &mut Vec<u8>| {
            let start = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
            bytes.splice(start..start + from.len(), to.bytes());
        }
    };
    assert_refused(
        read_changed(&replace("vertex 2", "vertex 99999999999")),
        &["fewer than 99999999999 points"],
    );
    assert_refused(read_changed(&replace("float nx", "float w")), &["float x y z nx ny nz"]);
    assert_refused(read_changed(&replace("float x", "double x")), &["float x y z nx ny nz"]);
    assert_refused(read_changed(&replace("binary_little", "binary_big")), &["binary_little_endian"]);
    let short = PointCloud { colors: vec![], ..cloud() };
    assert_refused(write_ply(&path, &short), &["cloud.colors", "0 values", "2 points"]);
}

#[test]
fn visibility_lists_the_views_of_each_point() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("fused.ply.vis");
    write_visibility(&path, &cloud().views).unwrap();
    let numbers = [3u32, 4, 0, 2, 0];
    let expected: Vec<u8> =
        2u64.to_le_bytes().into_iter().chain(numbers.into_iter().flat_map(u32::to_le_bytes)).collect();
    assert_eq!(read(&path).unwrap(), expected);
    assert_eq!(read_visibility(&path).unwrap(), cloud().views);

    for end in 0..expected.len() {
        rewrite(&path, |bytes| *bytes = expected[..end].to_vec());
        assert_refused(read_visibility(&path), &["fused.ply.vis", "truncated"]);
    }
    rewrite(&path, |bytes| *bytes = [expected.as_slice(), &[0; 4]].concat());
    assert_refused(read_visibility(&path), &["4 bytes too many"]);
    rewrite(&path, |bytes| bytes[..8].fill(255));
    assert_refused(read_visibility(&path), &["truncated"]);
}
