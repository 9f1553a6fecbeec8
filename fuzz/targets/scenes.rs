//! Models of COLMAP and the scenes of other programs.

use super::{new_folder, parts, write_parts, write_photographs};
use skep::Options;
use skep::import::SourceScene;
use skep::io::ColmapModel;
use std::path::Path;
use tempfile::TempDir;

thread_local! {
    static TEXT: TempDir = new_folder();
    static BINARY: TempDir = new_folder();
    static FORMATS: TempDir = formats();
}

/// Cameras, images and points of COLMAP as text.
pub fn colmap_text(input: &[u8]) -> bool {
    TEXT.with(|folder| read_model(folder.path(), ["cameras.txt", "images.txt", "points3D.txt"], input))
}

/// Cameras, images and points of COLMAP as binary files.
pub fn colmap_binary(input: &[u8]) -> bool {
    BINARY.with(|folder| read_model(folder.path(), ["cameras.bin", "images.bin", "points3D.bin"], input))
}

fn read_model(folder: &Path, names: [&str; 3], input: &[u8]) -> bool {
    write_parts(folder, &names, input);
    let is_read = ColmapModel::read_with_lenses(folder).is_ok();
    // This one refuses lenses with distortion.
    let Ok(model) = ColmapModel::read(folder) else { return is_read };
    // What was read can be written, or is refused; what is written can be read.
    let copy = folder.join("copy");
    if model.write_binary(&copy).is_ok() {
        let again = ColmapModel::read(&copy).expect("the model that was written");
        assert_eq!(again.images.len(), model.images.len());
        assert_eq!(again.points.len(), model.points.len());
    }
    let _ = std::fs::remove_dir_all(copy);
    true
}

/// A folder of each format and the names of the input's files in it.
const FORMS: [(u8, &str, &[&str]); 7] = [
    (b'n', "nerfstudio", &["transforms.json", "sparse_pc.ply"]),
    (b'o', "openmvs", &["scene.mvs"]),
    (b's', "opensfm", &["reconstruction.json", "tracks.csv"]),
    (b'v', "mvsnet", &["cams/00000000_cam.txt", "cams/00000001_cam.txt", "pair.txt"]),
    (b'p', "middlebury", &["wall_par.txt"]),
    (b't', "colmap", &["sparse/cameras.txt", "sparse/images.txt", "sparse/points3D.txt"]),
    (b'b', "colmap_binary", &["sparse/cameras.bin", "sparse/images.bin", "sparse/points3D.bin"]),
];

fn formats() -> TempDir {
    let folder = new_folder();
    for (_, name, _) in FORMS {
        let own = folder.path().join(name);
        match name {
            "middlebury" => write_photographs(&own),
            _ => write_photographs(&own.join("images")),
        }
    }
    folder
}

/// Scenes of all programs; the first byte says which.
pub fn scene_formats(input: &[u8]) -> bool {
    let Some((kind, content)) = input.split_first() else { return false };
    let Some((_, name, names)) = FORMS.iter().find(|(known, ..)| known == kind) else { return false };
    if names_a_device(content) {
        return false;
    }
    FORMATS.with(|folder| {
        let folder = folder.path().join(name);
        write_parts(&folder, names, content);
        let Ok(scene) = skep::import::read(&folder) else { return false };
        if is_small(&scene) {
            let mut options = Options { threads: 1, ..Options::default() };
            options.input.alpha_mask = parts(content).len() > 1;
            let _ = skep::import::read_scene(&folder, None, &options, &skep::ignore_progress);
        }
        true
    })
}

/// Whether the photographs take no time to undistort.
fn is_small(scene: &SourceScene) -> bool {
    scene.photographs.len() <= 8
        && scene.photographs.iter().all(|photograph| {
            let camera = &photograph.lens.camera;
            camera.width <= 64 && camera.height <= 64
        })
}

/// Whether an input has the path of a device, such as a terminal: a scene may name any file.
pub fn names_a_device(content: &[u8]) -> bool {
    ["/dev", "/proc"].iter().any(|path| content.windows(path.len()).any(|window| window == path.as_bytes()))
}
