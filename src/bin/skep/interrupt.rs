//! Ctrl-C, SIGTERM and SIGHUP: a flag that long calls poll.

use crate::streams;
use skep::{Error, Result};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user requested to stop.
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Installs the handler of Ctrl-C, SIGTERM and SIGHUP, which sets the flag. Before, they end the process
    /// at once, which is harmless while nothing has been written.
    pub fn watch() -> Interrupt {
        let raised = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&raised);
        // Without a handler the signals end the process at once; files are complete even then, because writes
        // are atomic.
        if let Err(error) = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)) {
            streams::warning(&format!("Ctrl-C will end the run at once, without a message: {error}"));
        }
        Interrupt(raised)
    }

    /// What a progress function returns.
    pub fn control_flow(&self) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// [`Error::Cancelled`] if the flag is set.
    pub fn check(&self) -> Result<()> {
        match self.control_flow() {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }
}
