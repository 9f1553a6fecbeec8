//! The reports of a run: `report.json` for tools, and `report.html`, a page to look at the reconstruction and
//! to judge it.
//!
//! The page is one file without references to others: template, styles and the bundled viewer of `viewer/`,
//! figures as JSON, pictures and points in base64. It is made from the files in the folder of the run, view
//! by view, so that it can be made later as well, or while the run goes on; what is not there is said to be
//! missing.

mod advice;
mod cloud;
mod cloud_files;
mod cycles;
mod geometry;
mod json;
mod map_samples;
mod page;
mod run_files;
mod thumbnails;
mod unfinished;

pub use json::{Report, Totals};
pub use page::{PAGE_NAME, PageOptions, make, write};
pub use run_files::RunFiles;
