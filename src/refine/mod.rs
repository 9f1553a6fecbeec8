//! Filters of one view's planes, beyond the paper.

pub mod foreground_fattening;
pub mod gap_filling;
pub mod plane_smoothing;
pub mod stencil;
pub mod textureless;
