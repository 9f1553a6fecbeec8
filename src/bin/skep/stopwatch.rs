//! Wall and CPU seconds of each stage of a run.

use cpu_time::ProcessTime;
use serde::Serialize;
use skep::Phase;
use std::time::{Duration, Instant};

/// A stage of a run that is timed by itself.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    Reading,
    Search,
    Check,
    Fusion,
    Writing,
}

impl From<Phase> for Stage {
    fn from(phase: Phase) -> Stage {
        match phase {
            Phase::Read => Stage::Reading,
            Phase::Search => Stage::Search,
            Phase::Check => Stage::Check,
            Phase::Fusion => Stage::Fusion,
        }
    }
}

/// Time spent, in seconds; CPU seconds are those of all threads together.
#[derive(Clone, Copy, Default, Serialize)]
pub struct Seconds {
    pub wall_seconds: f64,
    pub cpu_seconds: f64,
}

/// The times of every stage.
#[derive(Clone, Copy, Default, Serialize)]
pub struct Times {
    pub reading: Seconds,
    pub search: Seconds,
    pub check: Seconds,
    pub fusion: Seconds,
    pub writing: Seconds,
}

impl Times {
    fn of(&mut self, stage: Stage) -> &mut Seconds {
        match stage {
            Stage::Reading => &mut self.reading,
            Stage::Search => &mut self.search,
            Stage::Check => &mut self.check,
            Stage::Fusion => &mut self.fusion,
            Stage::Writing => &mut self.writing,
        }
    }

    /// All stages together.
    pub fn total(&self) -> Seconds {
        [self.reading, self.search, self.check, self.fusion, self.writing].iter().fold(
            Seconds::default(),
            |sum, stage| Seconds {
                wall_seconds: sum.wall_seconds + stage.wall_seconds,
                cpu_seconds: sum.cpu_seconds + stage.cpu_seconds,
            },
        )
    }
}

/// Measures the stages, in any order and any number of times.
pub struct Stopwatch {
    stage: Stage,
    started: Instant,
    cpu_at_start: Duration,
    times: Times,
}

impl Stopwatch {
    /// Starts with reading. What the process used before does not count: a program that became this one by
    /// `exec` may have worked for long.
    pub fn start() -> Stopwatch {
        Stopwatch {
            stage: Stage::Reading,
            started: Instant::now(),
            cpu_at_start: cpu_now(),
            times: Times::default(),
        }
    }

    /// Begins a stage; no effect when it is the current one.
    pub fn enter(&mut self, stage: Stage) {
        if stage != self.stage {
            self.add_elapsed();
            self.stage = stage;
        }
    }

    /// The times up to now.
    pub fn times(&mut self) -> Times {
        self.add_elapsed();
        self.times
    }

    /// Adds the time since the last call to the current stage.
    fn add_elapsed(&mut self) {
        let (now, cpu) = (Instant::now(), cpu_now());
        let spent = self.times.of(self.stage);
        spent.wall_seconds += (now - self.started).as_secs_f64();
        spent.cpu_seconds += cpu.saturating_sub(self.cpu_at_start).as_secs_f64();
        (self.started, self.cpu_at_start) = (now, cpu);
    }
}

/// CPU time of the whole process since it began; 0 where the system does not report it.
fn cpu_now() -> Duration {
    ProcessTime::try_now().map_or(Duration::ZERO, |time| time.as_duration())
}
