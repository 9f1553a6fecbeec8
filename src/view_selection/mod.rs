//! View selection (section 4 of the paper): `source_lists.rs` selects the source views of each reference view
//! by triangulation angle, `shared_angles.rs` finds these angles at sparse points, `rules.rs` selects the
//! view set of each pixel by incidence and visibility.

mod rules;
mod shared_angles;
mod source_lists;
#[cfg(test)]
mod tests;

pub(crate) use rules::{ViewRules, ViewSelector, select_sets};
#[cfg(feature = "capi")]
pub(crate) use shared_angles::SharedAngles;
pub(crate) use source_lists::{SourceLists, source_lists};
#[cfg(feature = "capi")]
pub(crate) use source_lists::{source_lists_by_angle, triangulation_angle};
