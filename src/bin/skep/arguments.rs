//! The arguments of the command line, and their help.

use crate::options_file;
use crate::output_arguments::{BoundsArguments, CloudArguments, Convert};
use crate::progress::Messages;
use crate::run_arguments::Run;
use crate::streams::LogLevel;
use clap::{Args, Parser, Subcommand};
use skep::{Error, Options, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};

#[derive(Parser)]
#[command(name = "skep", version, about, after_help = include_str!("help/main.txt"))]
#[command(arg_required_else_help = true, max_term_width = 80)]
pub struct Arguments {
    /// What is printed on standard error: only errors, also warnings (like --quiet), also the progress, or
    /// also what the run is made of
    #[arg(long, value_name = "LEVEL", global = true, default_value = "info", display_order = 100)]
    pub log_level: LogLevel,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Estimate depth, normal and source-view maps of a scene and fuse them into a cloud
    #[command(after_help = include_str!("help/reconstruct.txt"))]
    Reconstruct(Reconstruct),
    /// Plan a run in a folder, whose tasks other processes or machines then do
    #[command(after_help = include_str!("help/plan.txt"))]
    Plan(Plan),
    /// Task of a planned run: search views in a cycle
    Search(Views),
    /// Task of a planned run: check views in a cycle, after all were searched
    Check(Views),
    /// Task of a planned run: decide which cycle follows, after all views were checked
    Next(NextCycle),
    /// Task of a planned run: write the maps of views, after the last cycle
    Finish(FinishViews),
    /// Fuse existing depth and normal maps, of skep or of COLMAP, into a cloud
    #[command(after_help = include_str!("help/fuse.txt"))]
    Fuse(Fuse),
    /// Open the report of a run, or serve it while the run goes on
    #[command(after_help = include_str!("help/view.txt"))]
    View(View),
    /// Write the depth, normal and confidence maps of a workspace in formats of other programs
    Convert(Convert),
    /// Score depth maps and clouds against ground truth, or against photographs that were left out
    #[command(after_help = include_str!("help/evaluate.txt"))]
    Evaluate(Box<crate::evaluate::Evaluate>),
    /// Show version, instruction set, threads and every option of the presets, or explain one option
    Info(Info),
    /// Print a script that completes commands and arguments in a shell
    #[command(after_help = include_str!("help/completions.txt"))]
    Completions(Completions),
    /// Write the manual pages of all commands
    Man(Man),
}

impl Command {
    /// The files and folders that it reads and that must be there.
    pub fn inputs(&self) -> Vec<&Path> {
        match self {
            Command::Reconstruct(Reconstruct { run, .. }) | Command::Plan(Plan { run, .. }) => run.inputs(),
            Command::Search(Views { planned, .. })
            | Command::Check(Views { planned, .. })
            | Command::Next(NextCycle { planned, .. })
            | Command::Finish(FinishViews { planned, .. }) => vec![&planned.folder],
            Command::Fuse(Fuse { workspace, scene, options, .. }) => {
                [Some(workspace), scene.as_ref(), options.as_ref()]
                    .into_iter()
                    .flatten()
                    .map(PathBuf::as_path)
                    .collect()
            }
            Command::View(View { folder, .. }) => vec![folder],
            Command::Convert(Convert { workspace, scene, .. }) => {
                [Some(workspace), scene.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect()
            }
            Command::Evaluate(evaluate) => evaluate.inputs(),
            Command::Info(_) | Command::Completions(_) | Command::Man(_) => Vec::new(),
        }
    }
}

#[derive(Args)]
pub struct Reconstruct {
    #[command(flatten)]
    pub run: Run,
    /// Also write the maps of every cycle as pictures into DIR, to study the method; slower, same result
    #[arg(long, value_name = "DIR")]
    pub dump: Option<PathBuf>,
}

#[derive(Args)]
pub struct Plan {
    #[command(flatten)]
    pub run: Run,
    /// Write the tasks as a template of Open Job Description instead of printing them
    #[arg(long, value_name = "FILE")]
    pub openjd: Option<PathBuf>,
    /// Write a script that submits the tasks to Slurm instead of printing them
    #[arg(long, value_name = "FILE")]
    pub slurm: Option<PathBuf>,
}

/// What a command may take of the machine; the result does not depend on it.
#[derive(Args)]
pub struct Resources {
    /// Worker threads at most; 0 uses one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    threads: usize,
    /// Memory to keep to, such as 8GiB [default: three quarters of what the machine allows]
    #[arg(long, value_name = "SIZE", value_parser = bytes, allow_hyphen_values = true)]
    memory: Option<u64>,
}

/// A planned run and how to work on it.
#[derive(Args)]
pub struct Planned {
    /// Folder of the run, as planned by `skep plan`
    pub folder: PathBuf,
    #[command(flatten)]
    pub resources: Resources,
    #[command(flatten)]
    pub messages: Messages,
}

#[derive(Args)]
pub struct Views {
    #[command(flatten)]
    pub planned: Planned,
    /// The cycle, counted from 0; one that the run skips takes no time
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub cycle: usize,
    /// The views from A to before B, counted from 0 [default: all]
    #[arg(long, value_name = "A..B", value_parser = range)]
    pub views: Option<Range<usize>>,
}

#[derive(Args)]
pub struct NextCycle {
    #[command(flatten)]
    pub planned: Planned,
    /// The cycle whose views are all checked
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub cycle: usize,
}

#[derive(Args)]
pub struct FinishViews {
    #[command(flatten)]
    pub planned: Planned,
    /// The views from A to before B, counted from 0 [default: all]
    #[arg(long, value_name = "A..B", value_parser = range)]
    pub views: Option<Range<usize>>,
}

impl Resources {
    /// The options that do not change the result.
    pub fn options(&self) -> Options {
        Options { threads: self.threads, memory: self.memory.unwrap_or(0), ..Options::default() }
    }
}

/// A size in bytes.
pub fn bytes(text: &str) -> std::result::Result<u64, String> {
    skep::parse_bytes(text).map_err(|error| error.to_string())
}

/// `A..B`, or `A` for one view.
fn range(text: &str) -> std::result::Result<Range<usize>, String> {
    let number =
        |text: &str| text.trim().parse::<usize>().map_err(|_| "expected A..B, such as 0..16".to_owned());
    let (start, end) = match text.split_once("..") {
        Some((start, end)) => (number(start)?, number(end)?),
        None => (number(text)?, number(text)? + 1),
    };
    if start < end { Ok(start..end) } else { Err("expected A..B with A below B, such as 0..16".to_owned()) }
}

/// `NAME=VALUE`.
pub fn setting(text: &str) -> std::result::Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as smoothness_reward=0.1")?;
    if name.trim() == "preset" {
        return Err(
            "a preset is no option; `--preset NAME` of reconstruct and plan starts from one".to_owned()
        );
    }
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

#[derive(Args)]
pub struct View {
    /// Folder of the run
    pub folder: PathBuf,
    /// Serve the report to browsers on this machine at http://127.0.0.1:PORT/ until Ctrl-C, instead of
    /// opening it; 0 takes a free port. While the run goes on, the page shows what is done so far
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "8090")]
    pub serve: Option<u16>,
    /// Make the page again, also if the run wrote one
    #[arg(long)]
    pub fresh: bool,
    /// Folder with the pictures of every cycle that the run wrote with --dump, for a page that is made now
    #[arg(long, value_name = "DIR")]
    pub dump: Option<PathBuf>,
    #[command(flatten)]
    pub resources: Resources,
}

#[derive(Args)]
pub struct Info {
    /// Option to explain, with or without its group, such as check.depth_tolerance; a group, such as fusion,
    /// or a part of a name lists those options
    pub option: Option<String>,
}

#[derive(Args)]
pub struct Completions {
    /// The shell
    pub shell: clap_complete::Shell,
}

#[derive(Args)]
pub struct Man {
    /// Folder for the pages: skep.1, skep-reconstruct.1 and so on
    pub folder: PathBuf,
}

#[derive(Args)]
pub struct Fuse {
    /// Folder that holds stereo/depth_maps and stereo/normal_maps
    pub workspace: PathBuf,
    /// Folder with images/ and sparse/ that the maps belong to [default: WORKSPACE or the folder above it]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// File of the cloud, ending in .ply, .las or .laz [default: WORKSPACE/fused.ply]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    cloud: CloudArguments,
    #[command(flatten)]
    bounds: BoundsArguments,
    /// Start from the options in FILE, a report.json of a run or an object with options, instead of the
    /// defaults
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    /// Set an option of the fusion; `skep info fusion` lists them, `skep info NAME` explains one. May be
    /// repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Leave pixels of a smaller confidence, 0 to 1, out of the cloud; only maps of skep have confidences
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    min_confidence: Option<f64>,
    /// Do not write the page report.html, where this is the last task of a run
    #[arg(long)]
    pub no_report: bool,
    #[command(flatten)]
    pub resources: Resources,
    #[command(flatten)]
    pub messages: Messages,
}

impl Fuse {
    /// Whether the cloud is that of a run in the folder, with the run's options.
    pub fn is_task(&self) -> bool {
        let changes_nothing = self.options.is_none()
            && self.set.is_empty()
            && self.min_confidence.is_none()
            && self.cloud.are_default()
            && self.bounds.are_default();
        changes_nothing && self.scene.is_none() && self.replaces_cloud_of_run()
    }

    /// Whether the cloud is written where a run of skep wrote its own.
    pub fn replaces_cloud_of_run(&self) -> bool {
        self.output.is_none() && self.workspace.join("run").join("manifest.json").is_file()
    }

    /// The options of the fusion and of its output, its threads and memory, and the file of the cloud.
    pub fn options(&self) -> Result<(Options, PathBuf)> {
        let mut options = self.resources.options();
        if let Some(file) = &self.options {
            options_file::apply(file, &mut options)?;
        }
        for (name, value) in &self.set {
            let known = Options::info(name)?.name;
            if !known.starts_with("fusion.") && !known.starts_with("output.") && known != "input.bounds" {
                let expected = "an option of the group fusion: the maps are there already";
                return Err(Error::argument("--set", name, expected));
            }
            options.set(name, value)?;
        }
        if let Some(least) = self.min_confidence {
            options.fusion.min_confidence = least;
        }
        self.cloud.apply(&mut options)?;
        self.bounds.apply(&mut options)?;
        options.check()?;
        let file = self.cloud.file(self.output.as_deref(), &self.workspace, &options)?;
        Ok((options, file))
    }
}
