//! The files of a run's folder, and estimates as bytes.

use super::{new_folder, write, write_workspace};
use skep::job::{Job, Task, read_state};
use skep::{AnyEstimate, EstimateRef, Options, Scene, Stepper, ignore_progress};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;
use xxhash_rust::xxh3::xxh3_64;

thread_local! {
    static RUN: Run = Run::new();
}

/// Options of a short run with two scales.
pub fn short_run() -> Options {
    let mut options = Options { threads: 1, ..Options::default() };
    let scales = "downscale=2 food_sources=2 iterations=1+1x1; downscale=1 food_sources=2 iterations=0+0x1";
    options.set("schedule.scales", scales).expect("a schedule");
    options.set("window.window_radius", "2").expect("a radius");
    options
}

/// A run whose first cycle is checked, and what its files hold.
pub struct Run {
    folder: TempDir,
    /// The name of the run and the version, which are in every file.
    run: [u8; 8],
    run_text: String,
    version: String,
    scene: Vec<(PathBuf, Vec<u8>)>,
}

/// The files of the run that an input stands for.
const FILES: [(u8, &str); 8] = [
    (b'm', "run/manifest.json"),
    (b's', "run/tasks/cycle00-search-00000.json"),
    (b'c', "run/tasks/cycle00-check-00000.json"),
    (b'n', "run/tasks/cycle00-next.json"),
    (b'f', "run/tasks/finish-00000.json"),
    (b'e', "run/estimates/cycle00-00000.searched"),
    (b'k', "run/estimates/cycle00-00000.checked"),
    (b'u', "run/estimates/cycle00-00000.surface"),
];

impl Run {
    pub fn new() -> Run {
        let folder = new_folder();
        let (scene, run) = (folder.path().join("scene"), folder.path().join("dense"));
        write_workspace(&scene);
        let job = Job::plan(&scene, None, &short_run(), &run, false, &ignore_progress).expect("a run");
        let work = |task| job.run_task(task, &ignore_progress).expect("a task");
        (0..3).for_each(|view| work(Task::Search { cycle: 0, view }));
        // The checks remove the searched estimates.
        let searched = files_below(&run);
        (0..3).for_each(|view| work(Task::Check { cycle: 0, view }));
        work(Task::Next { cycle: 0 });
        drop(job);
        for (path, content) in searched.iter().filter(|(path, _)| !path.exists()) {
            write(path, content);
        }
        let manifest = std::fs::read_to_string(run.join("run/manifest.json")).expect("a manifest");
        let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("a manifest");
        let record = std::fs::read_to_string(run.join(FILES[3].1)).expect("a record");
        let record: serde_json::Value =
            serde_json::from_str(record.lines().next().unwrap_or_default()).expect("a record");
        let estimate = std::fs::read(run.join(FILES[5].1)).expect("an estimate");
        let mut found = Run {
            run: estimate[..8].try_into().expect("eight bytes"),
            run_text: record["run"].as_str().expect("a name").to_owned(),
            version: manifest["version"].as_str().expect("a version").to_owned(),
            folder,
            scene: Vec::new(),
        };
        found.scene = files_below(&found.root());
        found
    }

    fn root(&self) -> PathBuf {
        self.folder.path().join("dense")
    }

    /// Removes what a run wrote and puts the files back that it removed.
    fn restore(&self) {
        let root = self.root();
        for (path, _) in files_below(&root.join("run")) {
            if !self.scene.iter().any(|(known, _)| *known == path) {
                let _ = std::fs::remove_file(path);
            }
        }
        for (path, content) in self.scene.iter().filter(|(path, _)| path.starts_with(root.join("run"))) {
            if !std::fs::read(path).is_ok_and(|found| found == *content) {
                write(path, content);
            }
        }
    }

    /// What an input is in a file: with the run's names, and with the hash that a record or estimate ends
    /// with.
    fn complete(&self, name: &str, content: &[u8]) -> Vec<u8> {
        if name.ends_with("manifest.json") {
            return replaced(content, b"VERSION", self.version.as_bytes());
        }
        if name.ends_with(".json") {
            let mut line = replaced(content, b"RUN", self.run_text.as_bytes());
            let hash = xxh3_64(&line);
            line.extend(format!("\n{hash:016x}").bytes());
            return line;
        }
        let mut bytes = [&self.run, content].concat();
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// The content of a file as an input, which `complete` makes the file of.
    pub fn seed(&self, kind: u8) -> Vec<u8> {
        let name = FILES.iter().find(|(known, _)| *known == kind).expect("a file of the run").1;
        let content = std::fs::read(self.root().join(name)).unwrap_or_default();
        let content = if name.ends_with("manifest.json") {
            replaced(&content, self.version.as_bytes(), b"VERSION")
        } else if name.ends_with(".json") {
            let line = content.split(|&byte| byte == b'\n').next().unwrap_or_default();
            replaced(line, self.run_text.as_bytes(), b"RUN")
        } else {
            content[8..content.len() - 8].to_vec()
        };
        [&[kind], &content[..]].concat()
    }
}

fn files_below(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.path() {
            path if path.is_dir() => found.extend(files_below(&path)),
            path => found.push((path.clone(), std::fs::read(path).unwrap_or_default())),
        }
    }
    found
}

fn replaced(content: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    match content.windows(from.len()).position(|window| window == from) {
        Some(at) => [&content[..at], to, &content[at + from.len()..]].concat(),
        None => content.to_vec(),
    }
}

/// A file of a run's folder, as the first byte says, whose checksum is right.
pub fn run_files(input: &[u8]) -> bool {
    let Some((kind, content)) = input.split_first() else { return false };
    let Some((_, name)) = FILES.iter().find(|(known, _)| known == kind) else { return false };
    RUN.with(|run| {
        run.restore();
        let root = run.root();
        write(&root.join(name), &run.complete(name, content));
        let _ = read_state(&root);
        let Ok(job) = Job::open(&root, &Options { threads: 1, ..Options::default() }) else { return false };
        let _ = (job.checked(0, 0), job.is_complete(), job.summary().map(drop));
        let mut is_read = true;
        if matches!(kind, b'e' | b'k' | b'u') {
            // The check reads searched estimates, the search of the next cycle checked ones.
            let (task, done) = match kind {
                b'e' => (Task::Check { cycle: 0, view: 0 }, "cycle00-check-00000.json"),
                _ => (Task::Search { cycle: 1, view: 0 }, "cycle01-search-00000.json"),
            };
            let _ = std::fs::remove_file(root.join("run/tasks").join(done));
            is_read = job.run_task(task, &ignore_progress).is_ok();
        }
        is_read
    })
}

/// The scene and the stepper of the estimates.
pub fn stepper() -> &'static (Scene, Stepper) {
    static STEPPER: OnceLock<(Scene, Stepper)> = OnceLock::new();
    STEPPER.get_or_init(|| {
        let folder = new_folder();
        write_workspace(folder.path());
        let options = short_run();
        let scene =
            skep::import::read_scene(folder.path(), None, &options, &ignore_progress).expect("a scene");
        let stepper = Stepper::new(&scene, &options).expect("a stepper");
        (scene, stepper)
    })
}

/// Estimates as bytes: what is read is taken by the stages of a run.
pub fn estimates(input: &[u8]) -> bool {
    let (_, stepper) = stepper();
    let Ok(found) = AnyEstimate::from_bytes(stepper, input) else { return false };
    // Costs are rounded once they are read.
    let bytes = found.to_bytes();
    assert_eq!(bytes.len(), input.len());
    let again = AnyEstimate::from_bytes(stepper, &bytes).expect("the bytes of an estimate");
    assert_eq!(again.to_bytes(), bytes);
    let _ = (found.maps(), found.cost(), found.validated());
    let (cycle, view) = (found.cycle(), found.view());
    match &found {
        AnyEstimate::Searched(searched) => {
            let mut all = vec![None; stepper.views()];
            all[view] = Some(EstimateRef::Searched(searched));
            let _ = stepper.check(searched, &all);
        }
        AnyEstimate::Checked(checked) => {
            let mut all = vec![None; stepper.views()];
            all[view] = Some(checked);
            let _ = stepper.next(cycle, &all);
            if cycle + 1 < stepper.cycles().len() {
                let _ = stepper.upsample(cycle + 1, checked);
                let _ = stepper.propagate(cycle + 1, view, &all);
            }
            let _ = stepper.finish(view, &all, &ignore_progress);
        }
    }
    true
}
