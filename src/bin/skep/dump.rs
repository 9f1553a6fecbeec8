//! `skep reconstruct --dump DIR`: a stepwise run that writes the maps of every cycle as pictures, to study
//! the method.
//!
//! The stages are those of [`skep::reconstruct`] in the same order, one view at a time, so the result has the
//! same bits. It is slower: the views are processed one at a time.

use skep::io::{write_depth_preview, write_normal_preview, write_views_preview};
use skep::{Checked, Error, Options, Phase, Progress, ProgressFn, Reconstruction, Result, Scene};
use skep::{EstimateRef, Searched, Stepper, ViewEstimate, ViewResult};
use std::path::{Path, PathBuf};

/// Fraction of the progress that fusion takes; a rough measurement on photographs.
const FUSION_SHARE: f64 = 0.03;

/// Runs all cycles and fuses; writes the maps of each cycle into a folder of its own below `folder`. On the
/// threads of the current pool.
pub fn reconstruct(
    scene: &Scene,
    options: &Options,
    folder: &Path,
    progress: ProgressFn,
) -> Result<Reconstruction> {
    let stepper = Stepper::new(scene, options)?;
    let dump = Dump { scene, stepper: &stepper, folder, progress };
    let mut estimates = Vec::new();
    let mut next = Some(0);
    while let Some(cycle) = next {
        estimates = dump.check(cycle, &dump.search(cycle, estimates)?)?;
        dump.write(cycle, &estimates)?;
        next = stepper.next(cycle, &known(&estimates))?;
    }
    let last = known(&estimates);
    // The end of the run is short beside its cycles: it cancels, and the share stays.
    let finishing = |at: &Progress| progress(&Progress { done: 1.0 - FUSION_SHARE, ..*at });
    let finish = |view| stepper.finish(view, &last, &finishing);
    let views: Vec<ViewResult> = (0..stepper.views()).map(finish).collect::<Result<_>>()?;
    let fusing = |at: &Progress| progress(&Progress { done: 1.0 - FUSION_SHARE * (1.0 - at.done), ..*at });
    let points = stepper.fuse(scene, &views, &fusing)?;
    Ok(Reconstruction { views, points, warnings: stepper.warnings().to_vec() })
}

/// The estimates as the stepper takes them: one entry for each view.
fn known(estimates: &[ViewEstimate<Checked>]) -> Vec<Option<&ViewEstimate<Checked>>> {
    estimates.iter().map(Some).collect()
}

/// A run whose cycles are written.
struct Dump<'a> {
    scene: &'a Scene,
    stepper: &'a Stepper,
    folder: &'a Path,
    progress: ProgressFn<'a>,
}

impl Dump<'_> {
    /// Upsamples the estimates to the cycle's scale, propagates them between views and searches every view.
    fn search(
        &self,
        cycle: usize,
        estimates: Vec<ViewEstimate<Checked>>,
    ) -> Result<Vec<ViewEstimate<Searched>>> {
        let scale = |cycle: usize| self.stepper.cycles()[cycle].scale_index;
        let to_this_scale = |own: ViewEstimate<Checked>| match scale(own.cycle()) < scale(cycle) {
            true => self.stepper.upsample(cycle, &own),
            false => Ok(own),
        };
        let estimates: Vec<_> = estimates.into_iter().map(to_this_scale).collect::<Result<_>>()?;
        let before = known(&estimates);
        let search = |view| {
            let candidates = self.stepper.propagate(cycle, view, &before)?;
            let progress =
                |at: &Progress| (self.progress)(&Progress { done: self.done(cycle, view, at.done), ..*at });
            self.stepper.search(cycle, view, &before, Some(&candidates), &progress)
        };
        (0..self.stepper.views()).map(search).collect()
    }

    /// Checks every view against the searched estimates of all.
    fn check(&self, cycle: usize, searched: &[ViewEstimate<Searched>]) -> Result<Vec<ViewEstimate<Checked>>> {
        let found: Vec<_> = searched.iter().map(|found| Some(EstimateRef::Searched(found))).collect();
        let check = |own: &ViewEstimate<Searched>| {
            self.report_check(cycle, own.view())?;
            self.stepper.check(own, &found)
        };
        searched.iter().map(check).collect()
    }

    /// Reports the check of a view, which takes no callback of its own.
    fn report_check(&self, cycle: usize, view: usize) -> Result<()> {
        let (at, views) = (self.stepper.cycles()[cycle], self.stepper.views());
        let progress = Progress {
            phase: Phase::Check,
            downscale: at.scale.downscale,
            cycle: at.cycle,
            view,
            views,
            done: self.done(cycle, views, 0.0),
        };
        if (self.progress)(&progress).is_break() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Fraction of the whole run that is done at a fraction of a view's search.
    fn done(&self, cycle: usize, view: usize, share: f64) -> f64 {
        let pixels = |view: &skep::View| u64::from(view.camera.width) * u64::from(view.camera.height);
        let pixels: u64 = self.scene.views().iter().map(pixels).sum();
        let work = |cycle: &skep::Cycle| cycle.work(pixels / u64::from(cycle.scale.downscale).pow(2)) as f64;
        let works: Vec<f64> = self.stepper.cycles().iter().map(work).collect();
        let before: f64 = works[..cycle].iter().sum();
        let now = works[cycle] * (view as f64 + share) / self.stepper.views() as f64;
        (1.0 - FUSION_SHARE) * (before + now) / works.iter().sum::<f64>()
    }

    /// `DIR/03-size2-cycle4`: index in the run (folders sort by it), downscale, and cycle on that scale.
    fn cycle_folder(&self, cycle: usize) -> PathBuf {
        let at = self.stepper.cycles()[cycle];
        self.folder.join(format!("{cycle:02}-size{}-cycle{}", at.scale.downscale, at.cycle + 1))
    }

    /// Writes depth and normal of every pixel, and white where a pixel is validated.
    fn write(&self, cycle: usize, estimates: &[ViewEstimate<Checked>]) -> Result<()> {
        let folder = self.cycle_folder(cycle);
        for (view, estimate) in self.scene.views().iter().zip(estimates) {
            let (width, height) = self.stepper.size(cycle, estimate.view())?;
            let path = |what: &str| folder.join(format!("{}.{what}.png", view.name));
            let maps = estimate.maps();
            write_depth_preview(&path("depth"), width, height, &maps.depth)?;
            write_normal_preview(&path("normal"), width, height, &maps.normal)?;
            let validated: Vec<bool> = estimate.verdicts().map(|(_, validated)| validated).collect();
            write_views_preview(&path("validated"), width, height, 1, |pixel| usize::from(validated[pixel]))?;
        }
        Ok(())
    }
}
