//! Whether a JPEG file is whole: decoders fill what is missing at its end with gray, without an error.

use std::io::{self, BufRead, ErrorKind, Read};

const START_OF_IMAGE: u8 = 0xd8;
const END_OF_IMAGE: u8 = 0xd9;
const START_OF_SCAN: u8 = 0xda;

/// Whether the first image of the file has its end-of-image marker; what follows is not read. Images in
/// segments, such as thumbnails, do not count. `false` for what is no JPEG file.
///
/// ```text
/// FF D8                          start of image
/// FF marker length content       segments; the length counts its own two bytes and the content
/// FF DA length content entropy   a scan; in its coded data FF 00 is the byte FF, FF D0 to FF D7 are restarts
/// FF D9                          end of image
/// ```
pub(super) fn has_end(file: &mut impl BufRead) -> io::Result<bool> {
    match find_end(file) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        found => found,
    }
}

fn find_end(file: &mut impl BufRead) -> io::Result<bool> {
    if bytes(file)? != [0xff, START_OF_IMAGE] {
        return Ok(false);
    }
    let mut marker = next_marker(file)?;
    while marker != END_OF_IMAGE {
        // Markers without content; 0 is none, but garbage between segments.
        if !matches!(marker, 0x00 | 0x01 | 0xd0..=START_OF_IMAGE) {
            let Some(length) = u16::from_be_bytes(bytes(file)?).checked_sub(2) else { return Ok(false) };
            if io::copy(&mut file.take(length.into()), &mut io::sink())? < length.into() {
                return Ok(false);
            }
        }
        marker = match marker {
            START_OF_SCAN => marker_after_scan(file)?,
            _ => next_marker(file)?,
        };
    }
    Ok(true)
}

/// The marker that ends the coded data of a scan.
fn marker_after_scan(file: &mut impl BufRead) -> io::Result<u8> {
    loop {
        match next_marker(file)? {
            0 | 0xd0..=0xd7 => (),
            marker => return Ok(marker),
        }
    }
}

/// The byte that follows the next `FF`; any number of `FF` may precede a marker.
fn next_marker(file: &mut impl BufRead) -> io::Result<u8> {
    loop {
        let buffer = file.fill_buf()?;
        if buffer.is_empty() {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        let found = buffer.iter().position(|&byte| byte == 0xff);
        let read = found.map_or(buffer.len(), |place| place + 1);
        file.consume(read);
        if found.is_some() {
            break;
        }
    }
    loop {
        match bytes(file)? {
            [0xff] => (),
            [marker] => return Ok(marker),
        }
    }
}

fn bytes<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).map(|()| bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, ImageFormat, Rgb};
    use std::io::Cursor;

    fn is_whole(bytes: &[u8]) -> bool {
        has_end(&mut &bytes[..]).unwrap()
    }

    fn jpeg() -> Vec<u8> {
        let picture =
            ImageBuffer::from_fn(40, 30, |x, y| Rgb([(x * 37) as u8, (y * 91) as u8, (x * y) as u8]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
        bytes.into_inner()
    }

    /// The file with a segment after its first marker.
    fn with_segment(marker: u8, content: &[u8]) -> Vec<u8> {
        let mut bytes = jpeg();
        let length = (content.len() as u16 + 2).to_be_bytes();
        let segment = [&[0xff, marker][..], &length, content].concat();
        bytes.splice(2..2, segment);
        bytes
    }

    #[test]
    fn a_file_cut_anywhere_is_not_whole() {
        let whole = jpeg();
        assert!(is_whole(&whole));
        for length in 0..whole.len() {
            assert!(!is_whole(&whole[..length]), "{length} of {} bytes", whole.len());
        }
        let mut zeros = whole[..whole.len() / 2].to_vec();
        zeros.resize(whole.len(), 0);
        assert!(!is_whole(&zeros), "a disk that was full, or a download that began with its size");
    }

    #[test]
    fn what_follows_the_image_and_lies_in_segments_does_not_matter() {
        let appended = [jpeg(), jpeg()[..50].to_vec()].concat();
        assert!(is_whole(&appended), "as multi-picture files have a second image");
        let thumbnail = with_segment(0xe1, &jpeg());
        assert!(is_whole(&thumbnail));
        // The thumbnail's end is not the file's.
        assert!(!is_whole(&thumbnail[..thumbnail.len() - 100]));
    }
}
