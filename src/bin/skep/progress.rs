//! Progress on standard error: a bar on a terminal, plain lines elsewhere.

use crate::streams;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use skep::{Phase, Progress};
use std::io::IsTerminal;
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Steps of the bar; finer ones are not visible.
const BAR_STEPS: f64 = 1000.0;
/// Fraction of the run below which the estimate of the remaining time is too uncertain to print.
const FIRST_ESTIMATE: f64 = 0.01;

/// How progress is shown.
#[derive(Clone, Copy)]
pub enum Display {
    Silent,
    Lines,
    Bar,
}

/// Displays the progress of one call; dropping it removes the bar and keeps printed lines.
pub struct Reporter {
    display: Display,
    bar: ProgressBar,
    started: Instant,
    last: Mutex<Option<Shown>>,
    /// The fraction that was done at the first report: by an earlier run that this one goes on with.
    first: OnceLock<f64>,
}

/// What was shown last: only changes are drawn.
#[derive(Clone, Copy, PartialEq)]
struct Shown {
    step: (Phase, u32, u32),
    view: usize,
    bar_steps: u64,
}

impl Display {
    /// A bar on a terminal, lines elsewhere, nothing at all when `quiet`.
    pub fn new(quiet: bool) -> Display {
        match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Display::Silent,
            (false, false) => Display::Lines,
            (false, true) => Display::Bar,
        }
    }

    /// Prints a line about work that has no progress.
    pub fn print(self, line: &str) {
        match self {
            Display::Silent => (),
            Display::Lines | Display::Bar => streams::notice(line),
        }
    }

    /// Starts the clock of a call, from which the remaining time is estimated.
    pub fn start(self) -> Reporter {
        let bar = match self {
            Display::Silent | Display::Lines => ProgressBar::hidden(),
            Display::Bar => bar(),
        };
        Reporter {
            display: self,
            bar,
            started: Instant::now(),
            last: Mutex::new(None),
            first: OnceLock::new(),
        }
    }
}

impl Reporter {
    /// Displays the progress, from any thread; returns at once while another thread is drawing, so that
    /// workers never wait.
    pub fn show(&self, progress: &Progress) {
        let Ok(mut last) = self.last.try_lock() else { return };
        let shown = Shown {
            step: (progress.phase, progress.downscale, progress.cycle),
            view: progress.view,
            bar_steps: (progress.done * BAR_STEPS) as u64,
        };
        // Another thread may have drawn later progress already: the bar never moves back.
        if last.is_some_and(|last| last == shown || shown.bar_steps < last.bar_steps) {
            return;
        }
        let first = *self.first.get_or_init(|| progress.done);
        match self.display {
            Display::Silent => (),
            Display::Lines if last.is_some_and(|last| last.step == shown.step) => (),
            Display::Lines => streams::notice(&line(progress, first, self.started.elapsed())),
            Display::Bar => {
                self.bar.set_message(message(progress, first, self.started.elapsed()));
                self.bar.set_position(shown.bar_steps);
            }
        }
        *last = Some(shown);
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn bar() -> ProgressBar {
    let template = ProgressStyle::with_template("{bar:12} {percent:>3} %  {wide_msg}");
    let style = template.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(BAR_STEPS as u64), ProgressDrawTarget::stderr()).with_style(style)
}

/// The text beside the bar, for example `search at 1/2 size, cycle 1, view 3 of 7, 0:41 left`.
fn message(progress: &Progress, first: f64, elapsed: Duration) -> String {
    let view = format!("view {} of {}", progress.view + 1, progress.views);
    format!("{}, {view}{}", step(progress), left(progress.done, first, elapsed))
}

/// A line without a bar, for example `search at full size, cycle 1, 7 views: 62 % done, 0:41 left`.
fn line(progress: &Progress, first: f64, elapsed: Duration) -> String {
    let percent = (progress.done * 100.0) as u32;
    let left = left(progress.done, first, elapsed);
    format!("{}, {} views: {percent} % done{left}", step(progress), progress.views)
}

fn step(progress: &Progress) -> String {
    let phase = progress.phase.name();
    match (progress.phase, progress.downscale) {
        (Phase::Read | Phase::Fusion, _) => phase.to_owned(),
        (_, 1) => format!("{phase} at full size, cycle {}", progress.cycle + 1),
        (_, downscale) => format!("{phase} at 1/{downscale} size, cycle {}", progress.cycle + 1),
    }
}

/// `, 0:41 left`, or nothing while too little is done for an estimate; a fraction `first` was done before.
fn left(done: f64, first: f64, elapsed: Duration) -> String {
    if done - first < FIRST_ESTIMATE {
        return String::new();
    }
    let seconds = (elapsed.as_secs_f64() * (1.0 - done.min(1.0)) / (done - first)).round() as u64;
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match hours {
        0 => format!(", {minutes}:{seconds:02} left"),
        _ => format!(", {hours}:{minutes:02}:{seconds:02} left"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUARTER_DONE: Progress =
        Progress { phase: Phase::Search, downscale: 2, cycle: 0, view: 2, views: 7, done: 0.25 };

    #[test]
    fn the_time_left_follows_from_the_fraction_done_and_the_time_elapsed() {
        assert_eq!(left(0.25, 0.0, Duration::from_secs(10)), ", 0:30 left");
        assert_eq!(left(0.5, 0.0, Duration::from_secs(3725)), ", 1:02:05 left");
        assert_eq!(left(1.0, 0.0, Duration::from_secs(10)), ", 0:00 left");
        assert_eq!(
            left(0.75, 0.5, Duration::from_secs(10)),
            ", 0:10 left",
            "half was done by an earlier run"
        );
    }

    #[test]
    fn no_time_left_is_printed_without_progress() {
        assert_eq!(left(0.0, 0.0, Duration::from_secs(10)), "");
    }

    #[test]
    fn the_bar_names_phase_size_cycle_and_view_counted_from_one() {
        let text = message(&QUARTER_DONE, 0.0, Duration::from_secs(10));
        assert_eq!(text, "search at 1/2 size, cycle 1, view 3 of 7, 0:30 left");
    }

    #[test]
    fn a_line_counts_all_views() {
        let progress = Progress { phase: Phase::Fusion, ..QUARTER_DONE };
        assert_eq!(line(&progress, 0.0, Duration::from_secs(10)), "fusion, 7 views: 25 % done, 0:30 left");
    }
}
