//! Threads.

mod pool;

pub use pool::JoinedPool;
