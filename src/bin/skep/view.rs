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
    let folder = &arguments.folder;
    if !folder.is_dir() {
        let problem = "no such folder; expected that of a run, such as SCENE/dense";
        return Err(Failure::Usage(Error::file(folder, problem)));
    }
    if let Some(port) = arguments.serve {
        let pages = Pages::new(|| current_page(arguments, interrupt));
        return Ok(serve(port, pages, interrupt)?);
    }
    let page = written_page(arguments, interrupt)?;
    streams::result(&page.display().to_string());
    if !open(&page) {
        streams::notice("no program of the desktop opened it; open the file in a browser");
    }
    Ok(())
}

/// The file of the page; of a run that wrote none it is made and written.
fn written_page(arguments: &View, interrupt: &Interrupt) -> Result<PathBuf> {
    let path = arguments.folder.join(PAGE_NAME);
    let is_final = path.is_file() && arguments.folder.join("report.json").is_file();
    if is_final && !arguments.fresh {
        return Ok(path);
    }
    let files = RunFiles::find(&arguments.folder)?;
    let page = report::make(&files, &options(arguments, &|| interrupt.control_flow().is_continue()))?;
    if files.is_complete == Some(false) {
        streams::notice("the run is not complete: the report shows what is done so far");
    }
    report::write(&page, &files, &files.report)
}

/// The page as it is now, and whether it will stay so.
fn current_page(arguments: &View, interrupt: &Interrupt) -> Result<(Vec<u8>, bool)> {
    let path = arguments.folder.join(PAGE_NAME);
    if !arguments.fresh
        && arguments.folder.join("report.json").is_file()
        && let Ok(bytes) = std::fs::read(&path)
    {
        return Ok((bytes, true));
    }
    let files = RunFiles::find(&arguments.folder)?;
    let page = report::make(&files, &options(arguments, &|| interrupt.control_flow().is_continue()))?;
    let mut bytes = Vec::new();
    page.write_to(&mut bytes, &files.report).map_err(|error| Error::file(&path, error.to_string()))?;
    Ok((bytes, files.is_complete == Some(true)))
}

fn options<'a>(arguments: &View, goes_on: &'a (dyn Fn() -> bool + Sync)) -> PageOptions<'a> {
    let resources = arguments.resources.options();
    let available = || available_memory().map_or(LEAST_MEMORY, |bytes| bytes / 4 * 3);
    let memory = if resources.memory > 0 { resources.memory } else { available() };
    PageOptions { threads: resources.threads, memory, dump: None, goes_on }
}

/// Opens a file with a program of the desktop; whether there is one.
fn open(path: &Path) -> bool {
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let run = |program: &&str| {
        let mut command = Command::new(program);
        command.arg(&path).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    OPENERS.iter().any(run)
}
