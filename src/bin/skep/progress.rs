//! Progress on standard error: a bar on a terminal, plain lines, or lines of JSON for programs.

use crate::streams;
use crate::time_left::{TimeLeft, clock};
use clap::{Args, ValueEnum};
use serde_json::json;
use skep::{Phase, Progress};
use std::io::Write;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Width of the bar, in characters.
const BAR_WIDTH: usize = 12;
/// Width of a terminal that does not tell it.
const USUAL_WIDTH: usize = 80;
/// Erases the line of the cursor and those below it.
const ERASE: &str = "\r\x1b[J";

/// What is printed about a command.
#[derive(Args)]
pub struct Messages {
    /// Print warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// How progress is shown on standard error [default: bar on a terminal, else plain]
    #[arg(long, value_name = "FORM")]
    pub progress: Option<ProgressForm>,
}

impl Messages {
    /// Whether neither progress nor results are printed.
    pub fn are_quiet(&self) -> bool {
        streams::is_quiet(self.quiet)
    }
}

/// A form of the progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressForm {
    /// A line that changes, for terminals
    Bar,
    /// A line for each step, and every 10 seconds
    Plain,
    /// A JSON object on a line for each step, and every second
    Json,
}

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Display {
    Silent,
    Shown(ProgressForm),
}

/// Displays the progress of one call; dropping it removes the bar and keeps printed lines.
pub struct Reporter {
    display: Display,
    state: Mutex<State>,
}

struct State {
    time_left: TimeLeft,
    /// What was shown last, and when.
    last: Option<(Step, Instant)>,
    /// The largest fraction that was reported: threads report in any order.
    done: f64,
}

/// A step of a run: phase, scale and cycle.
type Step = (Phase, u32, u32);

impl Display {
    /// The form that was asked for, else a bar on a terminal and lines elsewhere; nothing when `quiet`.
    pub fn new(messages: &Messages) -> Display {
        let usual = || if streams::is_screen() { ProgressForm::Bar } else { ProgressForm::Plain };
        match messages.are_quiet() {
            true => Display::Silent,
            false => Display::Shown(messages.progress.unwrap_or_else(usual)),
        }
    }

    /// Prints a line about work that has no progress.
    pub fn print(self, line: &str) {
        match self {
            Display::Silent => (),
            Display::Shown(ProgressForm::Json) => streams::notice(&json!({ "message": line }).to_string()),
            Display::Shown(ProgressForm::Bar | ProgressForm::Plain) => streams::notice(line),
        }
    }

    /// Starts the clock of a call, from which the remaining time is estimated.
    pub fn start(self) -> Reporter {
        let state = State { time_left: TimeLeft::start(), last: None, done: 0.0 };
        Reporter { display: self, state: Mutex::new(state) }
    }
}

impl Reporter {
    /// Displays the progress, from any thread; returns at once while another thread is drawing, so that
    /// workers never wait.
    pub fn show(&self, progress: &Progress) {
        let (Display::Shown(form), Ok(mut state)) = (self.display, self.state.try_lock()) else { return };
        if progress.done < state.done {
            return;
        }
        let now = Instant::now();
        let seconds_left = state.time_left.update(progress.done, now);
        state.done = progress.done;
        let step = (progress.phase, progress.downscale, progress.cycle);
        let is_due = state.last.is_none_or(|(last, time)| last != step || now - time >= interval(form));
        if is_due {
            match form {
                ProgressForm::Bar => draw(&bar(progress, seconds_left)),
                ProgressForm::Plain => streams::notice(&line(progress, seconds_left)),
                ProgressForm::Json => streams::notice(&object(progress, seconds_left)),
            }
            state.last = Some((step, now));
        }
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        if self.display == Display::Shown(ProgressForm::Bar) {
            draw("");
        }
    }
}

/// The longest time between two lines of a step.
fn interval(form: ProgressForm) -> Duration {
    match form {
        ProgressForm::Bar => Duration::from_millis(100),
        ProgressForm::Plain => Duration::from_secs(10),
        ProgressForm::Json => Duration::from_secs(1),
    }
}

/// Draws a line in place of the last one. The cursor stays at its beginning: a terminal that becomes narrower
/// wraps the line, and all of it is erased by the next one.
fn draw(text: &str) {
    let width =
        terminal_size::terminal_size_of(std::io::stderr()).map_or(USUAL_WIDTH, |size| size.0.0 as usize);
    let text: String = text.chars().take(width.saturating_sub(1)).collect();
    let mut stderr = std::io::stderr();
    let _ = write!(stderr, "{ERASE}{text}\r").and_then(|()| stderr.flush());
}

/// The bar and the text beside it, for example
/// `#####-------  42 %  search at 1/2 size, cycle 1, 7 views, 0:41 left`.
fn bar(progress: &Progress, seconds_left: Option<f64>) -> String {
    let full = (progress.done.clamp(0.0, 1.0) * BAR_WIDTH as f64) as usize;
    let (percent, left) = (percent(progress), left(seconds_left));
    let bar = "#".repeat(full) + &"-".repeat(BAR_WIDTH - full);
    format!("{bar} {percent:>3} %  {}, {} views{left}", step(progress), progress.views)
}

/// A line without a bar, for example `search at full size, cycle 1, 7 views: 62 % done, 0:41 left`.
fn line(progress: &Progress, seconds_left: Option<f64>) -> String {
    let (percent, left) = (percent(progress), left(seconds_left));
    format!("{}, {} views: {percent} % done{left}", step(progress), progress.views)
}

/// A line of JSON; `skep help` explains the fields.
fn object(progress: &Progress, seconds_left: Option<f64>) -> String {
    let Progress { phase, downscale, cycle, view, views, done } = *progress;
    let of_cycle = |number: u32| matches!(phase, Phase::Search | Phase::Check).then_some(number);
    let round = |value: f64, digits: f64| (value * digits).round() / digits;
    json!({
        "phase": phase.name(),
        "done": round(done, 1e4),
        "seconds_left": seconds_left.map(|seconds| round(seconds, 10.0)),
        "downscale": of_cycle(downscale),
        "cycle": of_cycle(cycle),
        "view": view,
        "views": views,
    })
    .to_string()
}

fn step(progress: &Progress) -> String {
    let phase = progress.phase.name();
    match (progress.phase, progress.downscale) {
        (Phase::Read | Phase::Fusion, _) => phase.to_owned(),
        (_, 1) => format!("{phase} at full size, cycle {}", progress.cycle + 1),
        (_, downscale) => format!("{phase} at 1/{downscale} size, cycle {}", progress.cycle + 1),
    }
}

fn percent(progress: &Progress) -> u32 {
    (progress.done * 100.0) as u32
}

fn left(seconds: Option<f64>) -> String {
    seconds.map_or(String::new(), |seconds| format!(", {} left", clock(seconds)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUARTER_DONE: Progress =
        Progress { phase: Phase::Search, downscale: 2, cycle: 0, view: 2, views: 7, done: 0.25 };

    #[test]
    fn the_bar_names_phase_size_and_cycle_counted_from_one_and_no_view_that_jumps() {
        let text = bar(&QUARTER_DONE, Some(30.0));
        assert_eq!(text, "###---------  25 %  search at 1/2 size, cycle 1, 7 views, 0:30 left");
        assert!(bar(&Progress { done: 1.0, ..QUARTER_DONE }, None).starts_with("############ 100 %"));
    }

    #[test]
    fn a_line_counts_all_views() {
        let progress = Progress { phase: Phase::Fusion, ..QUARTER_DONE };
        assert_eq!(line(&progress, Some(30.0)), "fusion, 7 views: 25 % done, 0:30 left");
        assert_eq!(line(&progress, None), "fusion, 7 views: 25 % done");
    }

    #[test]
    fn a_program_reads_objects() {
        let read = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        let found = read(&object(&QUARTER_DONE, Some(30.04)));
        let expected = json!({
            "phase": "search", "done": 0.25, "seconds_left": 30.0, "downscale": 2, "cycle": 0, "view": 2,
            "views": 7
        });
        assert_eq!(found, expected);
        let found = read(&object(&Progress { phase: Phase::Read, ..QUARTER_DONE }, None));
        assert!(found["cycle"].is_null() && found["seconds_left"].is_null(), "{found}");
    }
}
