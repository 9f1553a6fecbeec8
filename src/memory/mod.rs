//! Memory: how much a run may take, and caches that keep to a limit.

mod cache;
mod limits;
mod reserve;

pub(crate) use cache::Cache;
pub use limits::{available_memory, format_bytes, parse_bytes};
pub(crate) use reserve::require_memory;
