//! Maps of floating-point numbers of other programs: PFM and NPY.

use skep::io::Grid;
use skep::{Error, Result};
use std::path::Path;

/// Magic of NumPy's files.
const NPY: &[u8] = b"\x93NUMPY";

/// A map of `CHANNELS` numbers a pixel, the rows from the top.
pub type Values<const CHANNELS: usize> = Grid<[f32; CHANNELS]>;

/// Reads a portable float map of one channel (`Pf`) or three (`PF`).
///
/// # Errors
/// Another number of channels; a header that is not understood; a size that the values do not fill.
pub fn read_pfm<const CHANNELS: usize>(path: &Path) -> Result<Values<CHANNELS>> {
    let bytes = read(path)?;
    let mut rest = bytes.as_slice();
    let mut word = || -> Option<&str> {
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace)?;
        let word = &rest[start..start + length];
        // One white-space character ends the header.
        rest = &rest[start + length + 1..];
        std::str::from_utf8(word).ok()
    };
    let expected = if CHANNELS == 1 { "Pf" } else { "PF" };
    let header = || format!("expected the header of a portable float map: {expected} WIDTH HEIGHT SCALE");
    let mut next = || word().ok_or_else(|| Error::file(path, header()));
    let kind = next()?.to_owned();
    if kind != expected {
        return Err(Error::file(path, format!("begins with {kind:?}; {}", header())));
    }
    let side = |text: &str| text.parse::<u32>().ok().filter(|side| *side > 0);
    let (width, height) = (side(next()?), side(next()?));
    let scale = next()?.parse::<f64>().ok();
    let (Some(width), Some(height), Some(scale)) = (width, height, scale) else {
        return Err(Error::file(path, header()));
    };
    let from = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let numbers = numbers::<4>(path, rest, pixels(width, height) * CHANNELS as u128)?;
    let values: Vec<f32> = numbers.map(from).collect();
    let mut rows: Vec<&[f32]> = values.chunks_exact(width as usize * CHANNELS).collect();
    rows.reverse();
    Ok(Grid { width, height, values: grouped(&rows.concat()) })
}

/// Reads an array of NumPy of float32 or float64: (height, width), or (height, width, 3) for three channels.
///
/// # Errors
/// Another shape, type or order; a size that the values do not fill.
pub fn read_npy<const CHANNELS: usize>(path: &Path) -> Result<Values<CHANNELS>> {
    let bytes = read(path)?;
    let truncated = || Error::file(path, "truncated: the header of an array of NumPy is not complete");
    if !bytes.starts_with(NPY) {
        return Err(Error::file(path, "expected an array of NumPy (.npy)"));
    }
    // Version 1 has a length of two bytes, later ones of four.
    let (start, length) = match bytes.get(6) {
        Some(1) => (10, bytes.get(8..10).map(|at| u32::from(u16::from_le_bytes([at[0], at[1]])))),
        _ => (12, bytes.get(8..12).map(|at| u32::from_le_bytes([at[0], at[1], at[2], at[3]]))),
    };
    let end = start + length.ok_or_else(truncated)? as usize;
    let header = String::from_utf8_lossy(bytes.get(start..end).ok_or_else(truncated)?).into_owned();
    let rest = &bytes[end..];
    let shape = shape(&header).unwrap_or_default();
    let wanted =
        if CHANNELS == 1 { shape.len() == 2 } else { shape.len() == 3 && shape[2] == CHANNELS as u32 };
    let is_row_by_row = header.contains("'fortran_order': False");
    if !wanted || !is_row_by_row || shape[..2].contains(&0) {
        let form = if CHANNELS == 1 { "(height, width)" } else { "(height, width, 3)" };
        let problem = format!("the array is {}; expected {form} in C order", header.trim());
        return Err(Error::file(path, problem));
    }
    let (height, width) = (shape[0], shape[1]);
    let count = pixels(width, height) * CHANNELS as u128;
    let values: Vec<f32> = if header.contains("'<f4'") {
        numbers::<4>(path, rest, count)?.map(f32::from_le_bytes).collect()
    } else if header.contains("'<f8'") {
        numbers::<8>(path, rest, count)?.map(|bytes| f64::from_le_bytes(bytes) as f32).collect()
    } else {
        let problem = format!("the array is {}; expected float32 or float64, little-endian", header.trim());
        return Err(Error::file(path, problem));
    };
    Ok(Grid { width, height, values: grouped(&values) })
}

/// The numbers behind `'shape':` in the header.
fn shape(header: &str) -> Option<Vec<u32>> {
    let (_, after) = header.split_once("'shape':")?;
    let (inside, _) = after.trim_start().strip_prefix('(')?.split_once(')')?;
    let numbers = inside.split(',').map(str::trim).filter(|number| !number.is_empty());
    numbers.map(|number| number.parse().ok()).collect()
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| Error::file(path, format!("cannot be read: {error}")))
}

fn pixels(width: u32, height: u32) -> u128 {
    u128::from(width) * u128::from(height)
}

/// The bytes of so many numbers of `SIZE` bytes, which must be all.
fn numbers<'a, const SIZE: usize>(
    path: &Path,
    bytes: &'a [u8],
    count: u128,
) -> Result<impl Iterator<Item = [u8; SIZE]> + use<'a, SIZE>> {
    if bytes.len() as u128 != count * SIZE as u128 {
        let problem =
            format!("{} bytes follow the header; expected {count} numbers of {SIZE} bytes", bytes.len());
        return Err(Error::file(path, problem));
    }
    let (numbers, _) = bytes.as_chunks::<SIZE>();
    Ok(numbers.iter().copied())
}

fn grouped<const CHANNELS: usize>(values: &[f32]) -> Vec<[f32; CHANNELS]> {
    let (pixels, _) = values.as_chunks::<CHANNELS>();
    pixels.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skep::io::{MapFormat, write_float_map};

    #[test]
    fn maps_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let (pfm, npy) = (folder.path().join("a.pfm"), folder.path().join("a.npy"));
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        write_float_map(&pfm, MapFormat::Pfm, (3, 2), 1, &values).unwrap();
        write_float_map(&npy, MapFormat::Npy, (3, 2), 1, &values).unwrap();
        let (pfm_map, npy_map) = (read_pfm::<1>(&pfm).unwrap(), read_npy::<1>(&npy).unwrap());
        assert_eq!(pfm_map, npy_map);
        assert_eq!((pfm_map.width, pfm_map.height, pfm_map.values.as_flattened()), (3, 2, &values[..]));
        write_float_map(&npy, MapFormat::Npy, (1, 2), 3, &values).unwrap();
        assert_eq!(read_npy::<3>(&npy).unwrap().values, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert!(read_npy::<1>(&npy).unwrap_err().to_string().contains("expected (height, width)"));
    }

    #[test]
    fn damaged_maps_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map");
        let headers: [&[u8]; 5] =
            [b"", b"Pf\n2 2\n", b"Pf\n0 2\n-1.0\n", b"Pf\n2 2\n-1.0\nabc", b"PF 1 1 -1 "];
        for bytes in headers {
            std::fs::write(&path, bytes).unwrap();
            assert!(read_pfm::<1>(&path).is_err(), "{bytes:?}");
            assert!(read_npy::<1>(&path).is_err(), "{bytes:?}");
        }
        std::fs::write(&path, b"\x93NUMPY\x01\x00\xff\xff{'descr'").unwrap();
        assert!(read_npy::<1>(&path).unwrap_err().to_string().contains("truncated"));
    }
}
