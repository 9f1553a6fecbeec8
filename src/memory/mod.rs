//! Memory: how much a run may take, and caches that keep to a limit.

mod cache;
mod limits;
mod reserve;

pub(crate) use cache::Cache;
#[cfg(feature = "io")]
pub(crate) use limits::memory_budget;
pub use limits::{available_memory, format_bytes, parse_bytes};
pub(crate) use reserve::require_memory;
