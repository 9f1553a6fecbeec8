//! `skep reconstruct --dump DIR`: the maps of every cycle as pictures, to study the method.

use skep::Result;
use skep::io::{write_depth_preview, write_normal_preview, write_views_preview};
use skep::job::Job;
use std::path::Path;

/// Writes depth and normal of every pixel after a cycle, and white where a pixel is validated, into
/// `DIR/03-size2-cycle4`: index in the run (folders sort by it), downscale, and cycle on that scale.
pub fn write(job: &Job, cycle: usize, folder: &Path) -> Result<()> {
    let at = job.stepper().cycles()[cycle];
    let folder = folder.join(format!("{cycle:02}-size{}-cycle{}", at.scale.downscale, at.cycle + 1));
    for (index, view) in job.scene().views().iter().enumerate() {
        let estimate = job.checked(cycle, index)?;
        let (width, height) = job.stepper().size(cycle, index)?;
        let path = |what: &str| folder.join(format!("{}.{what}.png", view.name));
        let maps = estimate.maps();
        write_depth_preview(&path("depth"), width, height, &maps.depth)?;
        write_normal_preview(&path("normal"), width, height, &maps.normal)?;
        let validated: Vec<bool> = estimate.verdicts().map(|(_, validated)| validated).collect();
        write_views_preview(&path("validated"), width, height, 1, |pixel| usize::from(validated[pixel]))?;
    }
    Ok(())
}
