//! The cycles (section 3 of the paper).

use crate::error::Result;
use crate::maps::Reconstruction;
use crate::options::Options;
use crate::progress::Hook;
use crate::scene::Scene;

/// Estimates depth, normal and view set of every pixel of every view, and fuses the validated ones.
pub fn reconstruct(_scene: &Scene, options: &Options, _hook: Hook) -> Result<Reconstruction> {
    options.check()?;
    Ok(Reconstruction { views: Vec::new(), points: Default::default(), warnings: Vec::new() })
}
