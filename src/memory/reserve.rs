//! Whether there is memory for what a call is about to do.

use super::available_memory;
use crate::error::{Error, Result};

/// Returns an error unless this many bytes, which a call is about to allocate in parts, can be allocated now
/// and are not more than the machine or its control group has. Allocations that fail end the process: this is
/// asked before.
pub(crate) fn require_memory(bytes: u64, purpose: impl Into<String>) -> Result<()> {
    let is_there = || {
        let size = usize::try_from(bytes).ok()?;
        // Not touched, and so not taken from anyone.
        Vec::<u8>::new().try_reserve_exact(size).ok()
    };
    let exists = available_memory().is_none_or(|available| bytes <= available);
    match exists.then(is_there).flatten() {
        Some(()) => Ok(()),
        None => Err(Error::Memory { bytes, purpose: purpose.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_exceeds_all_memory_is_an_error_that_says_how_much_and_for_what() {
        assert_eq!(require_memory(1 << 20, "a test"), Ok(()));
        for bytes in [1 << 50, u64::MAX] {
            let error = require_memory(bytes, "the search").unwrap_err();
            assert_eq!(error, Error::Memory { bytes, purpose: "the search".to_owned() });
        }
        let text = require_memory(3 << 50, "the search").unwrap_err().to_string();
        assert_eq!(text, "not enough memory: the search needs 3072 TiB");
    }
}
