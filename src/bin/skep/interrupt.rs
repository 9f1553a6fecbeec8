//! Ctrl-C, SIGTERM and SIGHUP: a flag that long calls poll, and the exit status of each.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// SIGINT; elsewhere than on Unix it stands for Ctrl-C.
const SIGINT: u8 = 2;
/// Exit statuses of interrupted commands are this and the number of the signal, as shells report them.
const STATUS_BASE: u8 = 128;

/// Whether the user requested to stop.
pub struct Interrupt(Arc<AtomicU8>);

impl Interrupt {
    /// Installs the handlers of Ctrl-C, SIGTERM and SIGHUP, except for those that are ignored: `nohup` and
    /// the `&` of a script ask for that. Before, the signals end the process at once, which is harmless while
    /// nothing has been written; after, the second signal does.
    pub fn watch() -> Interrupt {
        let received = Arc::new(AtomicU8::new(0));
        if let Err(error) = system::watch(&received) {
            // Files are complete even then, because writes are atomic.
            let text = format!("Ctrl-C will end the run at once, without a message: {error}");
            crate::streams::warning(&text);
        }
        Interrupt(received)
    }

    /// What a progress function returns.
    pub fn control_flow(&self) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) == 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// The exit status of the signal that came; that of Ctrl-C if none did.
    pub fn status(&self) -> u8 {
        match self.0.load(Ordering::Relaxed) {
            0 => STATUS_BASE + SIGINT,
            signal => STATUS_BASE + signal,
        }
    }
}

#[cfg(unix)]
mod system {
    use super::STATUS_BASE;
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use std::io;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU8, Ordering};
    use std::time::{Duration, Instant};

    /// A signal so soon after the first is the same one: some terminals and wrappers send it to the process
    /// and to its group.
    const SAME_SIGNAL: Duration = Duration::from_millis(500);

    /// Stores the first signal; the second one ends the process.
    pub(super) fn watch(received: &Arc<AtomicU8>) -> io::Result<()> {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = ignored_signals(&status);
        let mut signals = Signals::new(
            [SIGINT, SIGTERM, SIGHUP].iter().filter(|signal| ignored >> (**signal - 1) & 1 == 0),
        )?;
        let received = received.clone();
        let wait = move || {
            let mut first: Option<Instant> = None;
            for signal in signals.forever() {
                match first {
                    None => {
                        first = Some(Instant::now());
                        received.store(signal as u8, Ordering::Relaxed);
                    }
                    // A call that waits for a disk may not return soon.
                    Some(time) if time.elapsed() >= SAME_SIGNAL => {
                        crate::streams::notice("ended at once by a second signal; what is done is kept");
                        signal_hook::low_level::exit(i32::from(STATUS_BASE) + signal);
                    }
                    Some(_) => (),
                }
            }
        };
        std::thread::Builder::new().name("skep signals".to_owned()).spawn(wait).map(drop)
    }

    /// The signals that the process ignores, bit `n - 1` for signal `n`, in the text of Linux's
    /// `/proc/self/status`; elsewhere none are known to be ignored.
    fn ignored_signals(status: &str) -> u64 {
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    }

    #[test]
    fn ignored_signals_are_read_from_the_status_of_the_process() {
        assert_eq!(ignored_signals("Name:\tskep\nSigIgn:\t0000000000001001\nSigCgt:\t00000002"), 0x1001);
        assert_eq!((ignored_signals(""), ignored_signals("SigIgn:\tnone")), (0, 0));
    }
}

#[cfg(not(unix))]
mod system {
    use super::SIGINT;
    use std::io;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU8, Ordering};

    /// Stores Ctrl-C.
    pub(super) fn watch(received: &Arc<AtomicU8>) -> io::Result<()> {
        let received = received.clone();
        ctrlc::set_handler(move || received.store(SIGINT, Ordering::Relaxed)).map_err(io::Error::other)
    }
}
