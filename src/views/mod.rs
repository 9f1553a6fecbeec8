//! Pixelwise view selection (section 4 of the paper).

mod set;

pub use set::ViewSets;
