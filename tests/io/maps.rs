//! Depth maps, normal maps and consistency graphs.

use crate::{assert_refused, rewrite};
use skep::io::{
    read_consistency_graph, read_depth_map, read_normal_map, write_consistency_graph, write_depth_map,
    write_normal_map,
};
use std::fs::{read, read_dir, write};
use tempfile::tempdir;

const DEPTH: [f32; 6] = [1.5, 0.0, 2.25, 1e-3, 1e6, 4.0];

#[test]
fn depth_maps_have_colmaps_layout() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("new/folder/0001.png.geometric.bin");
    write_depth_map(&path, 3, 2, &DEPTH).unwrap();
    let expected: Vec<u8> =
        b"3&2&1&".iter().copied().chain(DEPTH.into_iter().flat_map(f32::to_le_bytes)).collect();
    assert_eq!(read(&path).unwrap(), expected);
    let grid = read_depth_map(&path).unwrap();
    assert_eq!((grid.width, grid.height, grid.values.as_slice()), (3, 2, DEPTH.as_slice()));
}

#[test]
fn normal_maps_are_planar() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("normals.bin");
    let normals = [[0.0, 0.0, -1.0], [0.6, 0.0, -0.8]];
    write_normal_map(&path, 2, 1, &normals).unwrap();
    let planes = [0.0f32, 0.6, 0.0, 0.0, -1.0, -0.8];
    let expected: Vec<u8> =
        b"2&1&3&".iter().copied().chain(planes.into_iter().flat_map(f32::to_le_bytes)).collect();
    assert_eq!(read(&path).unwrap(), expected);
    assert_eq!(read_normal_map(&path).unwrap().values, normals);
}

#[test]
fn a_finished_file_leaves_nothing_beside_it_and_is_readable_by_others() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("depth.bin");
    write_depth_map(&path, 3, 2, &DEPTH).unwrap();
    write_depth_map(&path, 1, 1, &[5.0]).unwrap();
    assert_eq!(read_depth_map(&path).unwrap().values, [5.0], "a second file replaces the first");
    assert_eq!(read_dir(folder.path()).unwrap().count(), 1);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &std::path::Path| path.metadata().unwrap().permissions().mode();
        let ordinary = folder.path().join("ordinary");
        write(&ordinary, "").unwrap();
        assert_eq!(mode(&path), mode(&ordinary));
    }
}

#[test]
fn buffers_of_another_size_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("depth.bin");
    assert_refused(write_depth_map(&path, 3, 3, &DEPTH), &["depth map", "6 values", "3 x 3"]);
    assert_refused(write_normal_map(&path, 3, 3, &[]), &["normal map", "0 values", "3 x 3"]);
    assert!(!path.exists());
}

#[test]
fn broken_maps_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("depth.bin");
    let read_changed = |change: &dyn Fn(&mut Vec<u8>)| {
        write_depth_map(&path, 3, 2, &DEPTH).unwrap();
        rewrite(&path, change);
        read_depth_map(&path)
    };
    assert_refused(read_changed(&|bytes| bytes.truncate(29)), &["depth.bin", "23 bytes", "3 x 2 x 1 x 4"]);
    assert_refused(read_changed(&|bytes| bytes.push(0)), &["25 bytes"]);
    assert_refused(read_changed(&|bytes| bytes.truncate(3)), &["truncated", "header"]);
    assert_refused(read_changed(&|bytes| bytes.clear()), &["truncated", "header"]);
    assert_refused(read_changed(&|bytes| bytes[4] = b'3'), &["header is 3&2&3&", "1 channel"]);
    assert_refused(read_changed(&|bytes| bytes[0] = b'0'), &["0&2&1&", "height of at least 1"]);
    assert_refused(read_changed(&|bytes| bytes[0] = b'-'), &["640&480&1&"]);
    for (value, name) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-1.0, "-1")] {
        let change = move |bytes: &mut Vec<u8>| bytes[6 + 16..][..4].copy_from_slice(&value.to_le_bytes());
        assert_refused(read_changed(&change), &["column 1, row 1", name]);
    }
    for header in ["4000000000&4000000000&1&", "99999999999&1&1&", "4294967296&1&1&"] {
        write(&path, header).unwrap();
        assert_refused(read_depth_map(&path), &["depth.bin", "header"]);
    }
    write_normal_map(&path, 1, 1, &[[0.0, f32::NAN, 1.0]]).unwrap();
    assert_refused(read_normal_map(&path), &["column 0, row 0", "NaN"]);
    assert_refused(read_depth_map(&folder.path().join("none.bin")), &["none.bin", "cannot be read"]);
    assert_refused(read_depth_map(folder.path()), &["cannot be read"]);
}

#[test]
fn consistency_graphs_list_column_row_and_views() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("graph.bin");
    let views = [vec![], vec![], vec![3, 0], vec![], vec![7], vec![]];
    write_consistency_graph(&path, 3, 2, |pixel| views[pixel].iter().copied()).unwrap();
    let numbers = [2i32, 0, 2, 3, 0, 1, 1, 1, 7];
    let expected: Vec<u8> =
        b"3&2&1&".iter().copied().chain(numbers.into_iter().flat_map(i32::to_le_bytes)).collect();
    assert_eq!(read(&path).unwrap(), expected);
    let graph = read_consistency_graph(&path).unwrap();
    assert_eq!((graph.width, graph.height), (3, 2));
    assert_eq!(graph.pixels, [[2, 0], [1, 1]], "pixels without views are not listed");
    assert_eq!((graph.views.get(0), graph.views.get(1)), ([3, 0].as_slice(), [7].as_slice()));
}

#[test]
fn broken_consistency_graphs_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("graph.bin");
    let read_changed = |change: &dyn Fn(&mut Vec<u8>)| {
        write_consistency_graph(&path, 3, 2, |pixel| (0..2).filter(move |_| pixel == 4)).unwrap();
        rewrite(&path, change);
        read_consistency_graph(&path)
    };
    assert_eq!(read_changed(&|_| ()).unwrap().pixels, [[1, 1]]);
    for end in 7..26 {
        assert_refused(read_changed(&|bytes| bytes.truncate(end)), &["graph.bin", "truncated"]);
    }
    assert_refused(read_changed(&|bytes| bytes[6] = 3), &["column 3", "below 3 and 2"]);
    assert_refused(read_changed(&|bytes| bytes[14..18].fill(255)), &["truncated"]);
    assert_refused(read_changed(&|bytes| bytes[18..22].fill(255)), &["a view is -1"]);
}
