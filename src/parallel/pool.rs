//! A thread pool that joins its threads when dropped, so that a host can unload the library.

use crate::error::{Error, Result};
use std::thread::JoinHandle;

/// Number of threads for each core above which more of them only wait for each other: idle threads look for
/// work at those that have some.
const MAX_THREADS_PER_CORE: usize = 4;

/// The number of threads for the option `threads`, which is an upper bound (0: one for each core), and for so
/// many units of work that can be done at the same time.
pub(crate) fn useful_threads(wanted: usize, units: usize) -> usize {
    threads_on(std::thread::available_parallelism().map_or(1, usize::from), wanted, units)
}

fn threads_on(cores: usize, wanted: usize, units: usize) -> usize {
    let wanted = if wanted == 0 { cores } else { wanted };
    wanted.min(cores * MAX_THREADS_PER_CORE).min(units).max(1)
}

/// A rayon pool whose threads are joined when it is dropped; dropping rayon's own does not wait for them.
pub(crate) struct JoinedPool {
    /// `None` only while it is dropped.
    pool: Option<rayon::ThreadPool>,
    threads: Vec<JoinHandle<()>>,
}

impl JoinedPool {
    /// Starts this many threads.
    ///
    /// # Errors
    /// The system cannot start them.
    pub(crate) fn new(threads: usize) -> Result<JoinedPool> {
        let mut handles = Vec::new();
        let spawn = |thread: rayon::ThreadBuilder| {
            let builder = std::thread::Builder::new().name(format!("skep {}", thread.index()));
            handles.push(builder.spawn(|| thread.run())?);
            Ok(())
        };
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(spawn).build();
        match built {
            Ok(pool) => Ok(JoinedPool { pool: Some(pool), threads: handles }),
            Err(error) => {
                // Rayon has signaled the started threads to end.
                handles.into_iter().for_each(|handle| drop(handle.join()));
                let expected = format!("a number of threads that the system can start ({error})");
                Err(Error::argument("options.threads", threads, expected))
            }
        }
    }

    /// Runs `work` on the pool and waits for it.
    pub(crate) fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.as_ref().expect("only dropping takes the pool").install(work)
    }
}

impl Drop for JoinedPool {
    fn drop(&mut self) {
        self.pool = None;
        // A panic has already been propagated to the caller that waited for the work.
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn threads_are_limited_by_the_option_the_cores_and_the_work() {
        assert_eq!([0, 1, 3, 16, 17, 4096].map(|wanted| threads_on(4, wanted, 1000)), [4, 1, 3, 16, 16, 16]);
        assert_eq!([0, 1, 4096].map(|wanted| threads_on(64, wanted, 10)), [10, 1, 10]);
        assert_eq!(threads_on(4, 4096, 0), 1);
    }

    #[test]
    fn dropping_the_pool_joins_its_threads() {
        let witness = Arc::new(());
        let pool = JoinedPool::new(3).unwrap();
        use std::cell::RefCell;
        thread_local!(static KEPT: RefCell<Option<Arc<()>>> = const { RefCell::new(None) });
        pool.install(|| {
            rayon::broadcast(|_| KEPT.with(|kept| *kept.borrow_mut() = Some(witness.clone())));
        });
        assert_eq!(Arc::strong_count(&witness), 4);
        drop(pool);
        // Thread-local values are dropped when their thread ends.
        assert_eq!(Arc::strong_count(&witness), 1);
    }
}
