//! Pixelwise view selection (section 4 of the paper): the triangulation angle gives each reference view its source
//! views; incidence and visibility then refine the set of each pixel.

mod angle;
mod placement;
mod reference;
mod select;
mod set;
mod surface;

pub use angle::{SourceLists, source_lists, triangulation_angle};
pub use placement::{AHEAD, Found, Group, Placed, Placements, Surfaces};
pub use reference::{Reference, Source};
pub use select::{ViewRules, ViewSelector, are_occluded, faces_sources, select_sets};
pub use set::ViewSets;
pub use surface::ShownPlane;
