//! Some points of a fused cloud, read from its file without the others.

use las::{Point, Reader};
use skep::CloudFormat;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Points of a LAS file that are read at a time.
const LAS_PART: u64 = 1 << 16;

/// A point of a cloud in a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SampledPoint {
    pub position: [f64; 3],
    pub normal: [f32; 3],
    pub color: [u8; 3],
    /// The views it was fused from; none where there is no list of them.
    pub views: Vec<u32>,
}

/// Points of a cloud.
pub struct Sample {
    pub points: Vec<SampledPoint>,
    /// Number of points in the file.
    pub of: u64,
    /// Whether the views of the points are known.
    pub has_views: bool,
}

/// Reads at most `most` points: one at a random place in each of as many equal parts of the file, so that
/// every region keeps its share. The same file gives the same points.
///
/// # Errors
/// A file that cannot be read, or of another layout.
pub fn sample(path: &Path, most: usize) -> io::Result<Sample> {
    let is_ply = CloudFormat::of_file(path).is_ok_and(|format| format == CloudFormat::Ply);
    let (mut points, of, places) = if is_ply { sample_ply(path, most)? } else { sample_las(path, most)? };
    let mut list = path.as_os_str().to_owned();
    list.push(".vis");
    let views = sample_views(Path::new(&list), of, &places);
    let has_views = views.is_ok();
    for (point, views) in points.iter_mut().zip(views.unwrap_or_default()) {
        point.views = views;
    }
    Ok(Sample { points, of, has_views })
}

type Found = (Vec<SampledPoint>, u64, Vec<u64>);

/// The places of the points to take, ascending.
pub fn places(count: u64, most: usize) -> Vec<u64> {
    let wanted = (most as u64).min(count);
    let part = |index: u64| (u128::from(index) * u128::from(count) / u128::from(wanted)) as u64;
    let place = |index: u64| {
        let (start, end) = (part(index), part(index + 1));
        start + mixed(index) % (end - start).max(1)
    };
    (0..wanted).map(place).collect()
}

/// A number without a pattern (the finalizer of SplitMix64).
fn mixed(index: u64) -> u64 {
    let mut bits = index.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// A cloud in the layout of skep and COLMAP: position in floats or doubles, normal, color.
fn sample_ply(path: &Path, most: usize) -> io::Result<Found> {
    let mut file = BufReader::new(File::open(path)?);
    let (count, is_double) = read_header(&mut file)?;
    let bytes: usize = if is_double { 3 * 8 } else { 3 * 4 } + 3 * 4 + 3;
    let length = file.get_ref().metadata()?.len();
    if count.checked_mul(bytes as u64).is_none_or(|needed| needed > length) {
        return Err(io::Error::other("truncated: fewer points than the header says"));
    }
    let places = places(count, most);
    let mut record = vec![0; bytes];
    let mut points = Vec::with_capacity(places.len());
    let mut next = 0;
    for &place in &places {
        file.seek_relative((place - next) as i64 * bytes as i64)?;
        file.read_exact(&mut record)?;
        next = place + 1;
        points.push(parse_point(&record, is_double));
    }
    Ok((points, count, places))
}

/// The number of points, and whether positions are doubles.
fn read_header(file: &mut impl BufRead) -> io::Result<(u64, bool)> {
    let (mut count, mut properties, mut is_binary) = (None, Vec::new(), false);
    loop {
        let mut line = String::new();
        if file.by_ref().take(1000).read_line(&mut line)? == 0 {
            return Err(io::Error::other("the header has no end"));
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", "binary_little_endian", _] => is_binary = true,
            ["element", "vertex", number] => count = number.parse().ok(),
            ["property", kind, name] => properties.push((kind.to_owned(), name.to_owned())),
            ["end_header"] => break,
            _ => (),
        }
    }
    let is_layout = |position: &str| {
        let kinds = [position; 3].into_iter().chain(["float"; 3]).chain(["uchar"; 3]);
        let names = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"];
        properties.iter().map(|(kind, name)| (kind.as_str(), name.as_str())).eq(kinds.zip(names))
    };
    match count {
        Some(count) if is_binary && is_layout("float") => Ok((count, false)),
        Some(count) if is_binary && is_layout("double") => Ok((count, true)),
        _ => Err(io::Error::other("not a cloud in the layout of skep or COLMAP")),
    }
}

fn parse_point(record: &[u8], is_double: bool) -> SampledPoint {
    let float = |offset: usize| f32::from_le_bytes(record[offset..offset + 4].try_into().unwrap_or_default());
    let double =
        |offset: usize| f64::from_le_bytes(record[offset..offset + 8].try_into().unwrap_or_default());
    let position = std::array::from_fn(|axis| match is_double {
        true => double(8 * axis),
        false => float(4 * axis).into(),
    });
    let rest = if is_double { 24 } else { 12 };
    SampledPoint {
        position,
        normal: std::array::from_fn(|axis| float(rest + 4 * axis)),
        color: std::array::from_fn(|channel| record[rest + 12 + channel]),
        views: Vec::new(),
    }
}

/// A cloud in LAS or LAZ, with the normals as extra bytes.
fn sample_las(path: &Path, most: usize) -> io::Result<Found> {
    let mut reader = Reader::from_path(path).map_err(io::Error::other)?;
    let count = reader.header().number_of_points();
    let places = places(count, most);
    let mut points = Vec::with_capacity(places.len());
    let mut wanted = places.iter().copied().peekable();
    let mut place = 0;
    while wanted.peek().is_some() {
        let part = reader.read_points(LAS_PART).map_err(io::Error::other)?;
        if part.is_empty() {
            return Err(io::Error::other("fewer points than the header says"));
        }
        for point in part.points() {
            if wanted.next_if_eq(&place).is_some() {
                points.push(las_point(&point.map_err(io::Error::other)?));
            }
            place += 1;
        }
    }
    Ok((points, count, places))
}

fn las_point(point: &Point) -> SampledPoint {
    let component = |axis: usize| {
        let bytes = point.extra_bytes.get(4 * axis..4 * axis + 4)?;
        bytes.try_into().ok().map(f32::from_le_bytes)
    };
    let channels = |color: las::Color| [color.red, color.green, color.blue];
    let color = point.color.map_or([128; 3], |color| channels(color).map(|channel| (channel / 257) as u8));
    SampledPoint {
        position: [point.x, point.y, point.z],
        normal: std::array::from_fn(|axis| component(axis).unwrap_or_default()),
        color,
        views: Vec::new(),
    }
}

/// The lists of views of the points at these places, from the file beside the cloud.
fn sample_views(path: &Path, count: u64, places: &[u64]) -> io::Result<Vec<Vec<u32>>> {
    let mut file = BufReader::with_capacity(1 << 18, File::open(path)?);
    let mut number = [0; 8];
    file.read_exact(&mut number)?;
    if u64::from_le_bytes(number) != count {
        return Err(io::Error::other("the views of another cloud"));
    }
    let mut lists = Vec::with_capacity(places.len());
    let mut wanted = places.iter().copied().peekable();
    let mut word = [0; 4];
    let mut place = 0;
    while wanted.peek().is_some() {
        file.read_exact(&mut word)?;
        let length = u32::from_le_bytes(word);
        if wanted.next_if_eq(&place).is_some() {
            let mut bytes = Vec::new();
            file.by_ref().take(4 * u64::from(length)).read_to_end(&mut bytes)?;
            let view = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().unwrap_or_default());
            lists.push(bytes.chunks_exact(4).map(view).collect());
        } else {
            file.seek_relative(4 * i64::from(length))?;
        }
        place += 1;
    }
    Ok(lists)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skep::{PointCloud, PointViews};

    #[test]
    fn places_are_spread_over_the_whole_file() {
        assert_eq!(places(5, 10), [0, 1, 2, 3, 4]);
        let found = places(1_000_000, 1000);
        assert!(found.iter().enumerate().all(|(part, &place)| place / 1000 == part as u64));
        assert!(found.windows(3).any(|three| three[1] - three[0] != three[2] - three[1]), "no pattern");
        assert!(places(0, 10).is_empty());
    }

    #[test]
    fn points_and_their_views_are_read_from_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let mut cloud = PointCloud::default();
        let mut views = PointViews::default();
        for index in 0..100_u32 {
            cloud.positions.push([f64::from(index), 0.5, -1.0]);
            cloud.normals.push([0.0, 0.0, 1.0]);
            cloud.colors.push([index as u8, 2, 3]);
            views.push(&[index, 7]);
        }
        cloud.views = views;
        for format in ["ply", "las", "laz"] {
            let path = folder.path().join(format!("cloud.{format}"));
            skep::io::Workspace::write_cloud(&path, &cloud).unwrap();
            let found = sample(&path, 10).unwrap();
            assert_eq!((found.of, found.points.len(), found.has_views), (100, 10, true), "{format}");
            for (part, point) in found.points.iter().enumerate() {
                assert!((part as f64 * 10.0..part as f64 * 10.0 + 10.0).contains(&point.position[0]));
                assert_eq!(point.color[0], point.position[0].round() as u8);
                assert_eq!(point.views, [point.position[0].round() as u32, 7]);
                assert_eq!(point.normal, [0.0, 0.0, 1.0]);
            }
        }
        std::fs::write(folder.path().join("other.ply"), "ply\nend_header\n").unwrap();
        assert!(sample(&folder.path().join("other.ply"), 10).is_err());
        let ply = std::fs::read(folder.path().join("cloud.ply")).unwrap();
        let header = String::from_utf8_lossy(&ply[..300]).into_owned();
        for count in ["101", "18446744073709551615"] {
            let text = header.replacen("element vertex 100", &format!("element vertex {count}"), 1);
            let damaged = [text.split("end_header\n").next().unwrap().as_bytes(), b"end_header\n"].concat();
            std::fs::write(folder.path().join("other.ply"), damaged).unwrap();
            assert!(sample(&folder.path().join("other.ply"), 10).is_err(), "{count} points");
        }
    }
}
