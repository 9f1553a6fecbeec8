//! Scene and map files: COLMAP models, maps and clouds, pictures, and folder layouts.
//!
//! Writes are atomic: a file is written under a temporary name in its folder and renamed. Missing parent
//! folders are created. Readers check every count against the file's size before they allocate.

mod cloud;
mod colmap_maps;
mod colmap_model;
mod files;
mod fingerprint;
mod jpeg_end;
mod maps;
mod picture_formats;
mod pictures;
mod places;
mod previews;
mod scene_folder;
mod text_file;
mod view_files;
mod workspace;
mod workspace_maps;

pub(crate) use cloud::{CloudSpool, StoredCloud, visibility_path, write_cloud, write_splat};
pub use cloud::{read_ply, read_visibility, write_ply, write_visibility};
#[cfg(feature = "capi")]
pub(crate) use colmap_maps::map_size;
pub use colmap_maps::{
    ConsistencyGraph, Grid, read_consistency_graph, read_depth_map, read_normal_map, write_consistency_graph,
    write_depth_map, write_normal_map,
};
pub use colmap_model::{ColmapModel, ModelImage};
pub use files::write_file;
pub(crate) use files::{
    FileReader, NAME_INSIDE, NewFolders, cannot_be_read, cannot_be_written, check_file_place, link_or_copy,
    remove_temporary_files, stays_inside,
};
pub(crate) use fingerprint::{Fingerprint, fingerprint, fingerprint_file, text};
pub use maps::{DepthMapFile, MapFormat, write_dmap, write_float_map};
pub(crate) use picture_formats::{
    deep_picture_from_bytes, largest_value, opaque_pixels, picture_header, read_mask, write_mask,
    write_photograph,
};
pub(crate) use pictures::picture_from_bytes;
pub use pictures::{picture_size, read_picture, write_picture};
pub use previews::{write_depth_preview, write_fraction_preview, write_normal_preview, write_views_preview};
pub use scene_folder::{SceneFolder, write_scene};
pub use text_file::read_text;
pub use workspace::{MapKind, Workspace};
pub use workspace_maps::{WorkspaceMaps, WorkspaceView};
