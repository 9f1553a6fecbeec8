//! How far a run is, for who only watches it.

use super::folder::RunFolder;
use super::manifest::Manifest;
use super::task::{Content, Record, Task, ViewSummary};
use crate::error::Result;
use crate::options::Options;
use crate::pipeline::CycleRecord;
use std::path::Path;

/// What is done of a run in a folder, by its records.
#[derive(Debug, Clone, PartialEq)]
pub struct RunState {
    /// The views in order.
    pub views: Vec<ViewState>,
    /// Number of points, once the cloud is written.
    pub points: Option<usize>,
    /// The options of the run.
    pub options: Options,
}

/// What is done of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewState {
    /// Its name.
    pub name: String,
    /// The cycles that are checked, in order.
    pub cycles: Vec<CycleRecord>,
    /// The counts, once its maps are written.
    pub finished: Option<ViewSummary>,
}

/// Reads how far the run in a folder is; `None` where no run was planned. Nothing is locked: another process
/// may work on the run meanwhile.
///
/// # Errors
/// A damaged manifest, or one of another version.
pub fn read_state(folder: &Path) -> Result<Option<RunState>> {
    let folder = RunFolder::new(folder);
    let Some(manifest) = Manifest::read(&folder.manifest())? else { return Ok(None) };
    let run = manifest.run();
    let content = |task| Record::read(&folder, run, task).map(|record| record.content);
    let count = manifest.photographs.len();
    let mut cycles = vec![Vec::new(); count];
    let mut next = Some(0);
    while let Some(cycle) = next {
        for (view, cycles) in cycles.iter_mut().enumerate() {
            if let Some(Content::Check(record)) = content(Task::Check { cycle, view }) {
                cycles.push(record);
            }
        }
        next = match content(Task::Next { cycle }) {
            Some(Content::Next(following)) => following.filter(|&following| following > cycle),
            _ => None,
        };
    }
    let state = |(view, cycles): (usize, Vec<CycleRecord>)| {
        let finished = match content(Task::Finish { view }) {
            Some(Content::Finish(summary)) => Some(summary),
            _ => None,
        };
        ViewState { name: manifest.photographs[view].name.clone(), cycles, finished }
    };
    let views = cycles.into_iter().enumerate().map(state).collect();
    let points = match content(Task::Fuse) {
        Some(Content::Fuse(points)) => Some(points),
        _ => None,
    };
    Ok(Some(RunState { views, points, options: manifest.options(&Options::default())? }))
}
