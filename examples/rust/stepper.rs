//! A run taken apart, as a host's scheduler would do it: `cargo run --release --example stepper -- SCENE`.
//!
//! Each stage of each view is a call of its own. Here they are made one after the other; all calls of a stage
//! are independent of each other and may be made on different threads or machines. The result has the bits of
//! `skep::reconstruct`.

use skep::ignore_progress;
use skep::{Checked, EstimateRef, Options, PointCloud, Searched, Stepper, ViewEstimate, ViewResult};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: stepper SCENE (SCENE holds images/ and sparse/)");
        return ExitCode::from(2);
    };
    match run(Path::new(&folder)) {
        Ok(cloud) => {
            println!("{} points", cloud.positions.len());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("stepper: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(folder: &Path) -> skep::Result<PointCloud> {
    let options = Options::default();
    let scene = skep::import::read_scene(folder, None, &options, &ignore_progress)?;
    let stepper = Stepper::new(&scene, &options)?;
    for view in 0..stepper.views() {
        println!("{} has the source views {:?}", scene.views()[view].name, stepper.sources(view));
    }

    let mut estimates = Vec::new();
    let mut next = Some(0);
    while let Some(cycle) = next {
        estimates = run_cycle(&stepper, cycle, estimates)?;
        report(&stepper, cycle, &estimates);
        // A scale ends early when few pixels changed; then cycles are left out.
        next = stepper.next(cycle, &known(&estimates))?;
    }

    // Averaging across views, gap filling, recheck and classification of each view.
    let last = known(&estimates);
    let finish = |view| stepper.finish(view, &last, &ignore_progress);
    let results: Vec<ViewResult> = (0..stepper.views()).map(finish).collect::<skep::Result<_>>()?;
    stepper.fuse(&scene, &results, &ignore_progress)
}

/// The estimates as the stepper takes them: one entry for each view; `None` is a view of which nothing is
/// known.
fn known(estimates: &[ViewEstimate<Checked>]) -> Vec<Option<&ViewEstimate<Checked>>> {
    estimates.iter().map(Some).collect()
}

/// One cycle of all views: upsample, propagate, search, check.
fn run_cycle(
    stepper: &Stepper,
    cycle: usize,
    estimates: Vec<ViewEstimate<Checked>>,
) -> skep::Result<Vec<ViewEstimate<Checked>>> {
    let scale = |cycle: usize| stepper.cycles()[cycle].scale_index;
    let to_this_scale = |own: ViewEstimate<Checked>| match scale(own.cycle()) < scale(cycle) {
        true => stepper.upsample(cycle, &own),
        false => Ok(own),
    };
    let estimates: Vec<_> = estimates.into_iter().map(to_this_scale).collect::<skep::Result<_>>()?;

    // A search reads what the previous cycle published of the view's sources; before the first there is
    // nothing.
    let before: Vec<_> = (0..stepper.views()).map(|view| estimates.get(view)).collect();
    let search = |view| {
        let candidates = stepper.propagate(cycle, view, &before)?;
        stepper.search(cycle, view, &before, Some(&candidates), &ignore_progress)
    };
    let searched: Vec<ViewEstimate<Searched>> =
        (0..stepper.views()).map(search).collect::<skep::Result<_>>()?;

    // A check reads what the view's sources have just found: here all searches of the cycle must be done.
    let found: Vec<_> = searched.iter().map(|found| Some(EstimateRef::Searched(found))).collect();
    searched.iter().map(|own| stepper.check(own, &found)).collect()
}

fn report(stepper: &Stepper, cycle: usize, estimates: &[ViewEstimate<Checked>]) {
    let records = estimates.iter().filter_map(|estimate| estimate.cycles().last());
    let (changed, validated, pixels) = records.fold((0, 0, 0), |sums, record| {
        (sums.0 + record.changed, sums.1 + record.validated, sums.2 + record.pixels)
    });
    let share = |count: u64| 100.0 * count as f64 / pixels.max(1) as f64;
    let at = stepper.cycles()[cycle];
    println!(
        "size 1/{}, cycle {}: {:.1} % of the pixels changed, {:.1} % validated",
        at.scale.downscale,
        at.cycle + 1,
        share(changed),
        share(validated)
    );
}
