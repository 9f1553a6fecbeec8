//! Pixelwise view selection (section 4 of the paper): the triangulation angle gives each reference view its source
//! views; incidence and visibility then refine the set of each pixel.

mod rules;
mod source_lists;
#[cfg(test)]
mod tests;

pub use rules::{ViewRules, ViewSelector, are_occluded, faces_sources, select_sets};
pub use source_lists::{SourceLists, source_lists, triangulation_angle};
