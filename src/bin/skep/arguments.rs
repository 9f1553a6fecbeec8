//! The arguments of the command line, and their help.

use crate::output_arguments::{CloudArguments, Convert};
use crate::progress::Messages;
use crate::run_arguments::Run;
use clap::{Args, Parser, Subcommand};
use skep::{Options, Result};
use std::ops::Range;
use std::path::PathBuf;

#[derive(Parser)]
#[command(name = "skep", version, about, after_help = EXAMPLES, arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Estimate depth, normal and source-view maps of a scene and fuse them into a cloud
    #[command(after_help = RECONSTRUCT_HELP)]
    Reconstruct(Reconstruct),
    /// Plan a run in a folder, whose tasks other processes or machines then do
    #[command(after_help = PLAN_HELP)]
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
    #[command(after_help = FUSE_HELP)]
    Fuse(Fuse),
    /// Open the report of a run, or serve it while the run goes on
    #[command(after_help = VIEW_HELP)]
    View(View),
    /// Write the depth, normal and confidence maps of a workspace in formats of other programs
    Convert(Convert),
    /// Score depth maps and clouds against ground truth, or against photographs that were left out
    #[command(after_help = crate::evaluate::HELP)]
    Evaluate(Box<crate::evaluate::Evaluate>),
    /// Show version, instruction set, threads and every option of the presets, or explain one option
    Info(Info),
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
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Memory to keep to, such as 8GiB [default: three quarters of what the machine allows]
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
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
    #[arg(long, value_name = "N")]
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
    #[arg(long, value_name = "N")]
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
    #[command(flatten)]
    pub resources: Resources,
}

#[derive(Args)]
pub struct Info {
    /// Option to explain, with or without its group, such as check.depth_tolerance
    pub option: Option<String>,
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
    /// Set an option of the fusion; `skep info` lists those of the group fusion, `skep info NAME` explains
    /// one. May be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Leave pixels of a smaller confidence, 0 to 1, out of the cloud; only maps of skep have confidences
    #[arg(long, value_name = "C")]
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
        let changes_nothing =
            self.set.is_empty() && self.min_confidence.is_none() && self.cloud.are_default();
        let is_run = self.workspace.join("run").join("manifest.json").is_file();
        changes_nothing && self.scene.is_none() && self.output.is_none() && is_run
    }

    /// The options of the fusion and of its output, its threads and memory, and the file of the cloud.
    pub fn options(&self) -> Result<(Options, PathBuf)> {
        let mut options = self.resources.options();
        for (name, value) in &self.set {
            options.set(name, value)?;
        }
        if let Some(least) = self.min_confidence {
            options.fusion.min_confidence = least;
        }
        self.cloud.apply(&mut options)?;
        options.check()?;
        let file = self.cloud.file(self.output.as_deref(), &self.workspace, &options)?;
        Ok((options, file))
    }
}

const EXAMPLES: &str = "\
Examples:
  skep reconstruct SCENE            maps and cloud of a scene, into SCENE/dense
  skep fuse SCENE/dense             the cloud alone, from existing maps
  skep view SCENE/dense             the report, in a browser
  skep plan SCENE -o RUN            a run for other processes and machines to do
  skep info                         the options and their values in the presets
  skep info sigma_color             explanation of one option
  skep help reconstruct             input and output files, and remedies of failures

Lines of --progress json: phase (read, search, check, fusion), done (0 to 1), seconds_left (null at first),
view (the one that is worked on, from 0; several may be at the same time), views (their number), cycle (from
0) and downscale of its scale, both null except in search and check; or message. Warnings and errors are lines
that begin with `warning: ` and `error: `.

Exit status: 0 done, 1 failed, 2 wrong arguments; interrupted: 130 by Ctrl-C (SIGINT), 143 by SIGTERM,
129 by SIGHUP. A second signal ends the program at once. Signals that are ignored when it starts, as
`nohup` has it, stay ignored.";

const RECONSTRUCT_HELP: &str = "\
The scene:
  images/              photographs: PNG, JPEG, TIFF, BMP, WebP, PNM; color or gray, 8 or 16 bits
  sparse/, sparse/0/   COLMAP model, text or binary, of any camera model
  or a scene of another program, a folder or file: transforms.json (nerfstudio, instant-ngp), .mvs
  (OpenMVS), cams/ and pair.txt (MVSNet, ACMM), reconstruction.json (OpenSfM), *_par.txt (Middlebury)
  Where lenses distort, or --max-image-size, --masks and the like ask for it, changed photographs,
  masks and their model are written into the folder of the results; the maps belong to those.

Results, in COLMAP's layouts:
  fused.ply                        the cloud: position, normal, color (--cloud-format las: fused.las)
  fused.ply.vis                    the views each point was fused from
  preview/NAME.depth.png           previews: depth, normal and number of source views of
          NAME.normal.png          each pixel; black where no plane was validated
          NAME.views.png           and its confidence, white for 1
          NAME.confidence.png
  stereo/depth_maps/NAME.photometric.bin    the raw estimate of every pixel
  stereo/depth_maps/NAME.geometric.bin      the validated pixels only
  stereo/normal_maps               likewise; --write +graphs adds stereo/consistency_graphs, the view set
                                   of each pixel: docs/formats.md
  stereo/confidence_maps           likewise, as depth maps: the probability of each depth to be within 1 %
  stereo/status_maps/NAME.png      the status of each pixel: validated, or the reason why it is not
  images, sparse                   copy of the scene, for COLMAP: the folder is a workspace
                                   of `colmap stereo_fusion --workspace_path DIR ...`
  report.html                      the page to look at and judge the result, for any browser, offline;
                                   `skep view DIR` opens it; --write -report leaves it out
  report.json                      counts, times and options; written last
  run/                             what is done of the run: the same command goes on after an
                                   interruption (Ctrl-C, a crash, a full disk), --fresh begins anew

Examples:
  skep reconstruct SCENE --output RESULT --threads 4
  skep reconstruct SCENE --depth-range 0.5 12
  skep reconstruct SCENE --preset paper --without reward,propagation
  skep reconstruct SCENE --set geom_consistency_max_error=0.03 --set fill_gaps=false
  skep reconstruct SCENE --dump CYCLES   CYCLES/00-size2-cycle1/NAME.depth.png, .normal.png and
                                         .validated.png (white: validated), and so on

When it fails:
  no sparse points: set --depth-range MIN MAX, or triangulate points:
    colmap point_triangulator --database_path DATABASE --image_path IMAGES \\
      --input_path MODEL --output_path SCENE/sparse
  an empty or thin cloud: the last lines say why pixels were dropped, report.json for each view;
    preview/NAME.views.png shows where too few views see the surface.
  surfaces missing beyond some distance: they are outside the depth range; report.json has the range
    as depth_min and depth_max, --depth-range MIN MAX sets it.";

const VIEW_HELP: &str = "\
The report is one file, RUN/report.html, without references to others: it can be sent by mail and opened on
any machine. It shows the cloud with the cameras, each view with photograph, depth, normal, source count,
confidence and status, the figures of the run, the geometry of the capture, and warnings with what to do.
Where a run wrote none, or goes on, it is made from the files that are there, as far as they are there.

Examples:
  skep view SCENE/dense             opens RUN/report.html with the program of the desktop for it
  skep view SCENE/dense --serve     http://127.0.0.1:8090/, also while the run goes on: load the page again
                                    for what is done since

A server answers this machine alone, and only requests of the page.";

const PLAN_HELP: &str = "\
A run is a set of tasks. `skep reconstruct` does all of them; a scheduler does them in this order, those of
a line at the same time if it likes, on machines that share the folder of the run:

  skep plan SCENE -o RUN
  for each cycle N, counted from 0:
    skep search RUN --cycle N --views A..B      all views
    skep check RUN --cycle N --views A..B       all views, after the searches of the cycle
    skep next RUN --cycle N                     after the checks of the cycle
  skep finish RUN --views A..B                  all views, after the last cycle
  skep fuse RUN                                 after all views are finished

A task that is done, or of a cycle that the run skips, succeeds at once: tasks may be repeated.
`skep plan` prints the tasks, with the views whose files each range of views reads, or writes them for a
scheduler:

  skep plan SCENE -o RUN --openjd RUN/job.json     for schedulers that read Open Job Description
  skep plan SCENE -o RUN --slurm RUN/submit.sh     then: bash RUN/submit.sh --cpus-per-task=8 --mem=16G";

const FUSE_HELP: &str = "\
The workspace is what `skep reconstruct` or `colmap patch_match_stereo` writes: stereo/depth_maps and
stereo/normal_maps. Its scene, images/ and sparse/, is in WORKSPACE or in the folder above it.
The geometric (validated) maps are fused if any view has one, else the photometric (raw) ones.
FILE.vis, the views of each point, is written beside FILE.
In the folder of a run of skep, without other arguments, this is the run's last task, with its options.

Examples:
  skep fuse SCENE/dense
  skep fuse SCENE/dense --output cloud.laz
  skep fuse SCENE/dense --output small.ply --voxel 0.02 --max-points 1000000 --splat";
