//! A thread pool that joins its threads when dropped, so that a host can unload the library.

use crate::error::{Error, Result};
use std::thread::JoinHandle;

/// A rayon pool whose threads are joined when it is dropped; dropping rayon's own does not wait for them.
pub(crate) struct JoinedPool {
    /// `None` only while it is dropped.
    pool: Option<rayon::ThreadPool>,
    threads: Vec<JoinHandle<()>>,
}

impl JoinedPool {
    /// Starts this many threads; 0 takes one for each core.
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
