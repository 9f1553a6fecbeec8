//! The layouts of the files that a run writes, byte by byte.

use crate::{HEIGHT, NAMES, WIDTH, text};
use std::fs;
use std::path::Path;

/// The floats of a map after its header, `None` when the file is not one of this size.
pub fn map(path: &Path, width: usize, height: usize, channels: usize) -> Option<Vec<f32>> {
    let bytes = fs::read(path).ok()?;
    let header = format!("{width}&{height}&{channels}&");
    let values = bytes.strip_prefix(header.as_bytes())?;
    let whole = values.len() == width * height * channels * 4;
    whole.then(|| values.chunks_exact(4).map(|value| f32::from_le_bytes(value.try_into().unwrap())).collect())
}

/// Maps and graphs of one view; validated values equal the raw ones.
pub fn check_maps(dense: &Path, name: &str, validated: usize) {
    let file = |what: &str, kind: &str| dense.join(format!("stereo/{what}/{name}.{kind}.bin"));
    let read = |what: &str, kind: &str, channels| {
        let path = file(what, kind);
        map(&path, WIDTH, HEIGHT, channels).unwrap_or_else(|| panic!("{} is no map", path.display()))
    };
    let depth = read("depth_maps", "photometric", 1);
    let filtered = read("depth_maps", "geometric", 1);
    assert!(filtered.iter().zip(&depth).all(|(filtered, depth)| *filtered == 0.0 || filtered == depth));
    assert_eq!(filtered.iter().filter(|&&depth| depth > 0.0).count(), validated, "{name}");

    let normal = read("normal_maps", "geometric", 3);
    read("normal_maps", "photometric", 3);
    let pixels = WIDTH * HEIGHT;
    for pixel in 0..pixels {
        let length = (0..3).map(|channel| normal[channel * pixels + pixel].powi(2)).sum::<f32>().sqrt();
        let expected = if filtered[pixel] > 0.0 { 1.0 } else { 0.0 };
        assert!((length - expected).abs() < 1e-3, "{name}, pixel {pixel}: normal of length {length}");
    }
    for kind in ["photometric", "geometric"] {
        check_graph(&fs::read(file("consistency_graphs", kind)).unwrap());
    }
}

/// `column, row, N, index*N` to the end, every number in its bounds.
fn check_graph(bytes: &[u8]) {
    let numbers =
        bytes.strip_prefix(format!("{WIDTH}&{HEIGHT}&1&").as_bytes()).expect("header of one channel");
    let mut numbers = numbers.chunks_exact(4).map(|bytes| i32::from_le_bytes(bytes.try_into().unwrap()));
    let mut pixels = 0;
    while let Some(column) = numbers.next() {
        let (row, count) = (numbers.next().unwrap(), numbers.next().unwrap());
        assert!((0..WIDTH as i32).contains(&column) && (0..HEIGHT as i32).contains(&row));
        assert!((1..NAMES.len() as i32).contains(&count));
        for _ in 0..count {
            assert!((0..NAMES.len() as i32).contains(&numbers.next().unwrap()));
        }
        pixels += 1;
    }
    assert!(pixels > 0);
}

/// A cloud in COLMAP's layout and the views of its points beside it; gives the number of points.
pub fn check_cloud(path: &Path) -> usize {
    let bytes = fs::read(path).unwrap();
    let end = b"end_header\n";
    let header_length = bytes.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let header = text(&bytes[..header_length]);
    let count = header.lines().find_map(|line| line.strip_prefix("element vertex ")).unwrap();
    let points: usize = count.parse().unwrap();
    assert!(header.contains("format binary_little_endian 1.0"), "{header}");
    let properties: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property ")).collect();
    let floats = ["float x", "float y", "float z", "float nx", "float ny", "float nz"];
    assert_eq!(properties, [&floats[..], &["uchar red", "uchar green", "uchar blue"]].concat());
    assert_eq!(bytes.len() - header_length, points * 27, "6 floats and 3 bytes a point");

    let views = fs::read(format!("{}.vis", path.display())).unwrap();
    assert_eq!(views[..8], (points as u64).to_le_bytes());
    let mut numbers = views[8..].chunks_exact(4).map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()));
    for _ in 0..points {
        let count = numbers.next().unwrap();
        assert!(count > 1, "a point is seen by several views");
        assert!(numbers.by_ref().take(count as usize).all(|view| (view as usize) < NAMES.len()));
    }
    assert_eq!(numbers.next(), None);
    points
}
