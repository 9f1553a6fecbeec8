//! What all evaluations share: threads, progress and cancelling.

use crate::interrupt::Interrupt;
use crate::progress::Display;
use crate::time_left::{TimeLeft, clock};
use rayon::prelude::*;
use skep::{Error, Result};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Time between two lines of progress.
const INTERVAL: Duration = Duration::from_secs(2);

/// The threads of a command, what it displays, and whether it goes on.
pub struct Work<'a> {
    pool: rayon::ThreadPool,
    display: Display,
    interrupt: &'a Interrupt,
}

impl<'a> Work<'a> {
    /// Starts so many threads; 0 starts one for each core.
    ///
    /// # Errors
    /// The system cannot start them.
    pub fn new(threads: usize, display: Display, interrupt: &'a Interrupt) -> Result<Work<'a>> {
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = built.map_err(|error| {
            Error::argument("--threads", threads, format!("threads that the system can start ({error})"))
        })?;
        Ok(Work { pool, display, interrupt })
    }

    /// Prints a line about what is being done.
    pub fn say(&self, line: &str) {
        self.display.print(line);
    }

    /// Whether the user wants to go on.
    pub fn control_flow(&self) -> ControlFlow<()> {
        self.interrupt.control_flow()
    }

    /// Returns an error when the user asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.control_flow().is_break() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Does something with all threads.
    pub fn on_threads<R: Send>(&self, body: impl FnOnce() -> R + Send) -> R {
        self.pool.install(body)
    }

    /// The results for all items, in their order, made by all threads. `what` names the work in the lines of
    /// progress, such as `views scored`.
    ///
    /// # Errors
    /// What `body` returns; the user asked to stop.
    pub fn map<T: Sync, R: Send>(
        &self,
        what: &str,
        items: &[T],
        body: impl Fn(&T) -> Result<R> + Sync,
    ) -> Result<Vec<R>> {
        let done = AtomicUsize::new(0);
        let last = Mutex::new((Instant::now(), TimeLeft::start()));
        let one = |item: &T| -> Result<R> {
            self.check()?;
            let result = body(item)?;
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            if let Ok(mut last) = last.try_lock()
                && last.0.elapsed() >= INTERVAL
            {
                last.0 = Instant::now();
                let seconds = last.1.update(done as f64 / items.len() as f64, Instant::now());
                let left = seconds.map(|seconds| format!(", {} left", clock(seconds))).unwrap_or_default();
                self.say(&format!("{what}: {} %{left}", done * 100 / items.len()));
            }
            Ok(result)
        };
        self.pool.install(|| items.par_iter().map(one).collect())
    }
}
