//! Maps in formats of other programs, byte by byte.

use crate::{assert_refused, camera};
use skep::Maps;
use skep::io::{DepthMapFile, MapFormat, write_dmap, write_float_map};
use std::fs::read;
use tempfile::tempdir;

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

#[test]
fn pfm_has_its_rows_from_the_bottom_to_the_top() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("map.pfm");
    write_float_map(&path, MapFormat::Pfm, (3, 2), 1, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
    let expected = [b"Pf\n3 2\n-1.0\n".to_vec(), bytes(&[4.0, 5.0, 6.0, 1.0, 2.0, 3.0])].concat();
    assert_eq!(read(&path).unwrap(), expected);
    write_float_map(&path, MapFormat::Pfm, (1, 2), 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
    let expected = [b"PF\n1 2\n-1.0\n".to_vec(), bytes(&[4.0, 5.0, 6.0, 1.0, 2.0, 3.0])].concat();
    assert_eq!(read(&path).unwrap(), expected);
}

#[test]
fn npy_has_a_header_of_a_multiple_of_64_bytes() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("map.npy");
    write_float_map(&path, MapFormat::Npy, (2, 1), 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
    let written = read(&path).unwrap();
    let (header, values) = written.split_at(128);
    assert_eq!(values, bytes(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\x76\x00");
    let text = std::str::from_utf8(&header[10..]).unwrap();
    assert_eq!(text.trim_end(), "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }");
    assert!(text.ends_with('\n'));
}

#[cfg(feature = "tiff")]
#[test]
fn tiff_holds_floats_of_one_or_three_channels() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("map.tiff");
    for channels in [1, 3] {
        let values: Vec<f32> = (0..6 * channels).map(|value| value as f32 / 3.0).collect();
        write_float_map(&path, MapFormat::Tiff, (3, 2), channels, &values).unwrap();
        let mut decoder = tiff::decoder::Decoder::new(std::io::Cursor::new(read(&path).unwrap())).unwrap();
        assert_eq!(decoder.dimensions().unwrap(), (3, 2));
        let tiff::decoder::DecodingResult::F32(found) = decoder.read_image().unwrap() else {
            panic!("no floats")
        };
        assert_eq!(found, values);
    }
}

#[test]
fn dmap_has_the_layout_of_openmvs() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("depth0003.dmap");
    let mut maps = Maps { depth: vec![2.0; 24], normal: vec![[0.0, 0.6, -0.8]; 24] };
    (maps.depth[0], maps.normal[0], maps.depth[5]) = (0.0, [0.0; 3], 3.5);
    let camera = camera(0.5);
    let content = DepthMapFile {
        photograph: "images/a.jpg",
        camera: &camera,
        view: 3,
        neighbors: &[1, 4],
        maps: &maps,
        confidence: Some(&[0.25; 24]),
    };
    write_dmap(&path, &content).unwrap();
    let numbers =
        |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let doubles =
        |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let calibration = [8.0, 0.0, 2.5, 0.0, 8.25, 1.75, 0.0, 0.0, 1.0];
    let rotation: Vec<f64> = (0..3).flat_map(|row| camera.rotation.row(row).to_array()).collect();
    let expected = [
        b"DR\x07\x00".to_vec(),
        numbers(&[6, 4, 6, 4]),
        bytes(&[2.0, 3.5]),
        b"\x0c\x00images/a.jpg".to_vec(),
        numbers(&[3, 3, 1, 4]),
        doubles(&calibration),
        doubles(&rotation),
        doubles(&camera.center().to_array()),
        bytes(&maps.depth),
        bytes(maps.normal.as_flattened()),
        bytes(&[0.25; 24]),
    ];
    assert_eq!(read(&path).unwrap(), expected.concat());
    let short = Maps { depth: vec![1.0; 23], ..maps.clone() };
    assert_refused(write_dmap(&path, &DepthMapFile { maps: &short, ..content }), &["depth map", "23 values"]);
}

#[test]
fn values_that_do_not_fill_a_map_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("map.pfm");
    let write = |channels, values: &[f32]| write_float_map(&path, MapFormat::Pfm, (2, 2), channels, values);
    assert_refused(write(1, &[0.0; 3]), &["map", "3 values", "2 x 2"]);
    assert_refused(write(3, &[0.0; 4]), &["4 values", "a multiple of 3"]);
    assert_refused(write(2, &[0.0; 8]), &["channels is 2", "1 or 3"]);
    assert!(!path.exists());
}
