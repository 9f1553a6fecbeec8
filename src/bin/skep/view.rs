//! `skep view`: the report of a run in a browser.

use crate::arguments::View;
use crate::interrupt::Interrupt;
use crate::report::{self, PAGE_NAME, PageOptions, RunFiles};
use crate::server::{Pages, serve};
use crate::{Failure, streams};
use skep::{Error, Result, available_memory};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Programs that open a file with the one of the desktop for it.
const OPENERS: &[&str] = if cfg!(target_os = "macos") {
    &["open"]
} else if cfg!(windows) {
    &["explorer"]
} else {
    &["xdg-open"]
};

/// Memory where the system does not say what is available.
const LEAST_MEMORY: u64 = 1 << 30;

/// Runs the command.
pub fn run(arguments: &View, interrupt: &Interrupt) -> std::result::Result<(), Failure> {
    let folder = run_folder(&arguments.folder).map_err(Failure::Usage)?;
    if let Some(port) = arguments.serve {
        let pages = Pages::new(|| current_page(arguments, &folder, interrupt));
        return Ok(serve(port, pages, interrupt)?);
    }
    let page = written_page(arguments, &folder, interrupt)?;
    streams::result(&page.display().to_string());
    if !open(&page) {
        streams::notice("no program of the desktop opened it; open the file in a browser");
    }
    Ok(())
}

/// The folder of the run: the one that is named, or `dense` in the folder of a scene.
fn run_folder(named: &Path) -> Result<PathBuf> {
    let has_run =
        |folder: &&Path| folder.join("run").join("manifest.json").is_file() || folder.join("stereo").is_dir();
    let found = [named, &named.join("dense")].into_iter().find(has_run).map(Path::to_owned);
    found.ok_or_else(|| Error::file(named, "no run here; expected the folder of one, such as SCENE/dense"))
}

/// The file of the page; of a run that wrote none it is made and written.
fn written_page(arguments: &View, folder: &Path, interrupt: &Interrupt) -> Result<PathBuf> {
    let path = folder.join(PAGE_NAME);
    let is_final = path.is_file() && folder.join("report.json").is_file();
    if is_final && !arguments.fresh {
        return Ok(path);
    }
    let files = RunFiles::find(folder)?;
    let page = report::make(&files, &options(arguments, &|| interrupt.control_flow().is_continue()))?;
    if files.is_complete == Some(false) {
        streams::notice("the run is not complete: the report shows what is done so far");
    }
    report::write(&page, &files, &files.report)
}

/// The page as it is now, and whether it will stay so.
fn current_page(arguments: &View, folder: &Path, interrupt: &Interrupt) -> Result<(Vec<u8>, bool)> {
    let path = folder.join(PAGE_NAME);
    if !arguments.fresh
        && folder.join("report.json").is_file()
        && let Ok(bytes) = std::fs::read(&path)
    {
        return Ok((bytes, true));
    }
    let files = RunFiles::find(folder)?;
    let page = report::make(&files, &options(arguments, &|| interrupt.control_flow().is_continue()))?;
    let mut bytes = Vec::new();
    page.write_to(&mut bytes, &files.report).map_err(|error| Error::file(&path, error.to_string()))?;
    Ok((bytes, files.is_complete == Some(true)))
}

fn options<'a>(arguments: &View, goes_on: &'a (dyn Fn() -> bool + Sync)) -> PageOptions<'a> {
    let resources = arguments.resources.options();
    let available = || available_memory().map_or(LEAST_MEMORY, |bytes| bytes / 4 * 3);
    let memory = if resources.memory > 0 { resources.memory } else { available() };
    PageOptions { threads: resources.threads, memory, dump: arguments.dump.clone(), goes_on }
}

/// Opens a file with a program of the desktop; whether there is one.
fn open(path: &Path) -> bool {
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let run = |program: &&str| {
        let mut command = Command::new(program);
        command.arg(&path).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        // The explorer of Windows has no status that tells.
        command.status().is_ok_and(|status| status.success() || cfg!(windows))
    };
    OPENERS.iter().any(run)
}
