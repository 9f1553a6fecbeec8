//! View selection (section 4 of the paper): `source_lists.rs` selects the source views of each reference view
//! by triangulation angle, `rules.rs` the view set of each pixel by incidence and visibility.

mod rules;
mod source_lists;
#[cfg(test)]
mod tests;

pub(crate) use rules::{ViewRules, ViewSelector, select_sets};
pub(crate) use source_lists::{SourceLists, source_lists, triangulation_angle};
