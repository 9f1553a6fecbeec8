//! Scene and map files: COLMAP models, maps and clouds, pictures, and folder layouts.
//!
//! Writes are atomic: a file is written under a temporary name in its folder and renamed. Missing parent
//! folders are created. Readers check every count against the file's size before they allocate.

mod colmap_maps;
mod colmap_model;
mod files;
mod pictures;
mod ply;
mod previews;
mod scene_folder;
mod workspace;

pub use colmap_maps::{
    ConsistencyGraph, Grid, read_consistency_graph, read_depth_map, read_normal_map, write_consistency_graph,
    write_depth_map, write_normal_map,
};
pub use colmap_model::{ColmapModel, ModelImage};
pub use files::write_file;
pub(crate) use files::{
    FileReader, NAME_INSIDE, cannot_be_read, cannot_be_written, link_or_copy, remove_temporary_files,
    stays_inside,
};
pub(crate) use pictures::picture_from_bytes;
pub use pictures::{picture_size, read_picture, write_picture};
pub(crate) use ply::{CloudWriter, visibility_path};
pub use ply::{read_ply, read_visibility, write_ply, write_visibility};
pub use previews::{write_depth_preview, write_fraction_preview, write_normal_preview, write_views_preview};
pub use scene_folder::{SceneFolder, read_scene, write_scene};
pub use workspace::{MapKind, Workspace, WorkspaceMaps, WorkspaceView};
