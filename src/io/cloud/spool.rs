//! Clouds on their way into files: points that wait on disk, since number, bounds and spacing of all of them
//! precede them in the files.

use super::visibility::write_lists;
use crate::error::Result;
use crate::fusion::{CloudSource, PointCloud};
use crate::io::files::{NewFolders, cannot_be_read, cannot_be_written, temporary_file};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Bytes of a point: a position of 64-bit floats, a normal of 32-bit floats, a color.
const POINT_BYTES: usize = 3 * 8 + 3 * 4 + 3;
/// Points that are read at a time.
const PART: usize = 1 << 14;

/// Takes the points of a cloud as they are made, into temporary files.
pub(crate) struct CloudSpool {
    path: PathBuf,
    points: BufWriter<NamedTempFile>,
    views: BufWriter<NamedTempFile>,
    count: usize,
    /// After the files in them: what is dropped first is removed first.
    folders: NewFolders,
}

impl CloudSpool {
    /// A cloud without points yet. The temporary files lie beside the file that it is for.
    ///
    /// # Errors
    /// A folder in which no file can be made.
    pub(crate) fn new(path: &Path) -> Result<CloudSpool> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let folders = NewFolders::create(folder).map_err(|error| cannot_be_written(path, error))?;
        let temporary = || -> Result<BufWriter<NamedTempFile>> {
            let file = temporary_file(folder);
            Ok(BufWriter::new(file.map_err(|error| cannot_be_written(path, error))?))
        };
        let (points, views) = (temporary()?, temporary()?);
        Ok(CloudSpool { path: path.to_owned(), points, views, count: 0, folders })
    }

    /// Adds points.
    ///
    /// # Errors
    /// A full disk, for example.
    pub(crate) fn add(&mut self, cloud: &PointCloud) -> Result<()> {
        self.count += cloud.positions.len();
        let written = write_points(&mut self.points, cloud);
        let written = written.and_then(|()| write_lists(&mut self.views, &cloud.views));
        written.map_err(|error| cannot_be_written(&self.path, error))
    }

    /// All points, to be read.
    ///
    /// # Errors
    /// A full disk, for example.
    pub(crate) fn finish(self) -> Result<StoredCloud> {
        let whole = |file: BufWriter<NamedTempFile>| {
            let file = file.into_inner().map_err(io::IntoInnerError::into_error);
            file.map_err(|error| cannot_be_written(&self.path, error))
        };
        let (points, views) = (whole(self.points)?, whole(self.views)?);
        Ok(StoredCloud { points, views, count: self.count, _folders: self.folders })
    }
}

fn write_points(out: &mut impl Write, cloud: &PointCloud) -> io::Result<()> {
    for ((position, normal), color) in cloud.positions.iter().zip(&cloud.normals).zip(&cloud.colors) {
        position.iter().try_for_each(|coordinate| out.write_all(&coordinate.to_le_bytes()))?;
        normal.iter().try_for_each(|component| out.write_all(&component.to_le_bytes()))?;
        out.write_all(color)?;
    }
    Ok(())
}

/// A cloud in temporary files, which are removed when it is dropped.
pub(crate) struct StoredCloud {
    points: NamedTempFile,
    views: NamedTempFile,
    count: usize,
    /// After the files in them.
    _folders: NewFolders,
}

impl CloudSource for StoredCloud {
    fn len(&self) -> usize {
        self.count
    }

    fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()> {
        let open = |file: &NamedTempFile| {
            let opened = file.reopen().map(BufReader::new);
            opened.map_err(|error| cannot_be_read(file.path(), error))
        };
        let (mut points, mut views) = (open(&self.points)?, open(&self.views)?);
        let mut left = self.count;
        while left > 0 {
            let count = left.min(PART);
            left -= count;
            let part = read_part(count, &mut points, &mut views);
            body(&part.map_err(|error| cannot_be_read(self.points.path(), error))?)?;
        }
        Ok(())
    }
}

fn read_part(count: usize, points: &mut impl Read, views: &mut impl Read) -> io::Result<PointCloud> {
    let mut part = PointCloud::default();
    let mut list = Vec::new();
    for _ in 0..count {
        let mut bytes = [0; POINT_BYTES];
        points.read_exact(&mut bytes)?;
        let (position, rest) = bytes.split_at(24);
        let (normal, color) = rest.split_at(12);
        part.positions.push(numbers(position).map(f64::from_le_bytes));
        part.normals.push(numbers(normal).map(f32::from_le_bytes));
        part.colors.push([color[0], color[1], color[2]]);
        list.clear();
        for _ in 0..read_u32(views)? {
            list.push(read_u32(views)?);
        }
        part.views.push(&list);
    }
    Ok(part)
}

/// Three numbers of `N` bytes each.
fn numbers<const N: usize>(bytes: &[u8]) -> [[u8; N]; 3] {
    std::array::from_fn(|index| std::array::from_fn(|byte| bytes[index * N + byte]))
}

fn read_u32(file: &mut impl Read) -> io::Result<u32> {
    let mut bytes = [0; 4];
    file.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fusion::PointViews;

    #[test]
    fn points_are_read_as_they_were_added_and_the_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let mut views = PointViews::default();
        views.push(&[3, 0]);
        views.push(&[]);
        let part = PointCloud {
            positions: vec![[4_123_456.789_012_3, -0.1, 5e6], [1.0, 2.0, 3.0]],
            normals: vec![[0.0, 0.6, -0.8], [1.0, 0.0, 0.0]],
            colors: vec![[1, 2, 3], [255, 0, 9]],
            views,
        };
        let mut spool = CloudSpool::new(&folder.path().join("fused.ply")).unwrap();
        let mut expected = PointCloud::default();
        for _ in 0..PART {
            spool.add(&part).unwrap();
            expected.append(&part);
        }
        let stored = spool.finish().unwrap();
        assert_eq!(stored.len(), 2 * PART);
        for _ in 0..2 {
            let mut found = PointCloud::default();
            let mut parts = 0;
            let read = stored.each_part(&mut |part| {
                found.append(part);
                parts += 1;
                Ok(())
            });
            assert_eq!((read, parts), (Ok(()), 2));
            assert!(found == expected);
        }
        drop(stored);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
