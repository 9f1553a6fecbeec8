//! A scene folder in, maps and a cloud out: `cargo run --release --example reconstruct -- SCENE DENSE`.

use skep::import::read_scene;
use skep::io::{SceneFolder, Workspace};
use skep::{Options, PixelStatus, Progress};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, dense] = &arguments[..] else {
        eprintln!("usage: reconstruct SCENE DENSE (SCENE holds images/ and sparse/)");
        return ExitCode::from(2);
    };
    match reconstruct(Path::new(scene), Path::new(dense)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("reconstruct: {error}");
            ExitCode::FAILURE
        }
    }
}

fn reconstruct(folder: &Path, dense: &Path) -> skep::Result<()> {
    // Options are fields, and have names too.
    let mut options = Options { seed: 1, ..Options::default() };
    options.fusion.min_agreeing_views = 2;
    options.set("check.depth_tolerance", "0.01")?;
    let scene = read_scene(folder, None, &options, &show)?;

    let result = skep::reconstruct(&scene, &options, &show)?;
    eprintln!();
    for warning in &result.warnings {
        eprintln!("note: {warning}");
    }

    let workspace = Workspace::new(dense);
    for (view, found) in scene.views().iter().zip(&result.views) {
        workspace.write_view(&view.name, &view.camera, found)?;
        let counts = found.status_counts();
        let validated = 100.0 * counts[PixelStatus::Validated as usize] as f64 / found.status.len() as f64;
        println!("{}: {validated:.1} % validated, from {} source views", view.name, found.sources.len());
        for status in PixelStatus::ALL.into_iter().skip(1).filter(|&status| counts[status as usize] > 0) {
            println!("  {:>9} pixels {}", counts[status as usize], status.name());
        }
    }
    workspace.write_lists(scene.views().iter().map(|view| view.name.as_str()))?;
    workspace.adopt(&SceneFolder::find(folder)?)?;
    Workspace::write_cloud(&workspace.cloud(), &result.points)?;
    println!("{} points in {}", result.points.positions.len(), workspace.cloud().display());
    Ok(())
}

/// Called often and from any thread; `Break` would cancel.
fn show(progress: &Progress) -> ControlFlow<()> {
    eprint!("\r{:3.0} % {:<6}", progress.done * 100.0, progress.phase.name());
    let _ = std::io::stderr().flush();
    ControlFlow::Continue(())
}
