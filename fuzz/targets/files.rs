//! Maps, clouds and pictures.

use super::{new_folder, parts, write};
use skep::io::*;
use skep::{DepthRange, Options};
use std::path::Path;
use tempfile::TempDir;

thread_local! {
    static FOLDER: TempDir = new_folder();
}

/// Pixels of a picture that is decoded, at most: time and memory of a large one are no fault.
const MAX_PIXELS: u64 = 1 << 14;

fn with_file(name: &str, content: &[u8], read: impl FnOnce(&Path) -> bool) -> bool {
    FOLDER.with(|folder| {
        let path = folder.path().join(name);
        write(&path, content);
        read(&path)
    })
}

/// Depth maps, normal maps and consistency graphs of COLMAP; the first byte says which.
pub fn maps(input: &[u8]) -> bool {
    let Some((kind, content)) = input.split_first() else { return false };
    with_file("map.bin", content, |path| {
        let copy = path.with_extension("copy");
        match kind {
            b'd' => {
                let Ok(Grid { width, height, values }) = read_depth_map(path) else { return false };
                write_depth_map(&copy, width, height, &values).expect("the map is written");
                assert_eq!(read_depth_map(&copy).expect("the map that was written").values, values);
            }
            b'n' => {
                let Ok(Grid { width, height, values }) = read_normal_map(path) else { return false };
                write_normal_map(&copy, width, height, &values).expect("the map is written");
                assert_eq!(read_normal_map(&copy).expect("the map that was written").values, values);
            }
            b'g' => {
                let Ok(graph) = read_consistency_graph(path) else { return false };
                assert_eq!(graph.pixels.len(), graph.views.len());
            }
            _ => return false,
        }
        true
    })
}

/// Clouds and their lists of views; the first byte says which.
pub fn clouds(input: &[u8]) -> bool {
    let Some((kind, content)) = input.split_first() else { return false };
    match kind {
        b'p' => with_file("cloud.ply", content, |path| {
            let Ok(cloud) = read_ply(path) else { return false };
            let copy = path.with_extension("copy");
            if write_ply(&copy, &cloud).is_ok() {
                let again = read_ply(&copy).expect("the cloud that was written");
                assert_eq!(again.positions.len(), cloud.positions.len());
            }
            true
        }),
        b'v' => with_file("cloud.ply.vis", content, |path| {
            let Ok(views) = read_visibility(path) else { return false };
            let copy = path.with_extension("copy");
            write_visibility(&copy, &views).expect("the views are written");
            assert_eq!(read_visibility(&copy).expect("the views that were written"), views);
            true
        }),
        _ => false,
    }
}

/// A photograph of any format, and a mask: alone, and in a scene with both.
pub fn pictures(input: &[u8]) -> bool {
    with_file("images/a.png", parts(input)[0], |path| {
        let Ok((width, height)) = picture_size(path) else { return read_picture(path).is_ok() };
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return false;
        }
        let Ok(picture) = read_picture(path) else { return false };
        assert_eq!((picture.width(), picture.height()), (width, height));
        let root = path.ancestors().nth(2).expect("the folder of the scene");
        let images = "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 1 b.png\n\n";
        write(&root.join("sparse/cameras.txt"), format!("1 PINHOLE {width} {height} 9 9 4 4\n").as_bytes());
        write(&root.join("sparse/images.txt"), images.as_bytes());
        write(&root.join("sparse/points3D.txt"), b"");
        write(&root.join("images/b.png"), parts(input)[0]);
        write(&root.join("masks/a.png"), parts(input).get(1).unwrap_or(&parts(input)[0]));
        let mut options = Options { threads: 1, ..Options::default() };
        options.input.alpha_mask = true;
        options.input.max_image_size = width.max(height) / 2;
        let range = Some(DepthRange { near: 1.0, far: 9.0 });
        let read = |options: &Options| {
            skep::import::read_scene(root, range, options, &skep::ignore_progress).map(drop)
        };
        let is_read = read(&options).is_ok();
        options.input.masks = root.join("masks").to_str().expect("UTF-8").to_owned();
        if picture_size(&root.join("masks/a.png"))
            .is_ok_and(|(width, height)| u64::from(width) * u64::from(height) <= MAX_PIXELS)
        {
            let _ = read(&options);
        }
        is_read
    })
}
