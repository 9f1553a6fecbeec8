//! A cache with a limit of bytes.

use std::collections::HashMap;
use std::fmt::{self, Debug, Formatter};
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Keeps values up to a limit of bytes; those used longest ago make room for others. Shared by threads.
pub(crate) struct Cache<K, V> {
    limit: usize,
    kept: Mutex<Kept<K, V>>,
}

/// The values in memory.
struct Kept<K, V> {
    entries: HashMap<K, Entry<V>>,
    bytes: usize,
    uses: u64,
}

struct Entry<V> {
    value: Arc<V>,
    bytes: usize,
    last_use: u64,
}

impl<K: Eq + Hash + Copy, V> Cache<K, V> {
    /// An empty cache of at most `limit` bytes.
    pub(crate) fn new(limit: usize) -> Cache<K, V> {
        Cache { limit, kept: Mutex::new(Kept { entries: HashMap::new(), bytes: 0, uses: 0 }) }
    }

    /// The value of a key, if it is kept.
    pub(crate) fn get(&self, key: K) -> Option<Arc<V>> {
        let mut kept = self.kept();
        kept.uses += 1;
        let uses = kept.uses;
        let entry = kept.entries.get_mut(&key)?;
        entry.last_use = uses;
        Some(entry.value.clone())
    }

    /// Keeps a value of this size, in place of another one of its key. A value larger than the limit is not
    /// kept.
    pub(crate) fn insert(&self, key: K, value: Arc<V>, bytes: usize) {
        let mut kept = self.kept();
        kept.uses += 1;
        let last_use = kept.uses;
        kept.remove(key);
        kept.bytes += bytes;
        kept.entries.insert(key, Entry { value, bytes, last_use });
        while kept.bytes > self.limit {
            let oldest = kept.entries.iter().min_by_key(|(_, entry)| entry.last_use).map(|(key, _)| *key);
            let Some(oldest) = oldest else { break };
            kept.remove(oldest);
        }
    }

    /// Forgets the values of some keys.
    #[cfg(any(feature = "io", test))]
    pub(crate) fn forget(&self, is_obsolete: impl Fn(&K) -> bool) {
        let mut kept = self.kept();
        let obsolete: Vec<K> = kept.entries.keys().filter(|&key| is_obsolete(key)).copied().collect();
        obsolete.into_iter().for_each(|key| kept.remove(key));
    }

    /// Bytes of the values that are kept.
    #[cfg(test)]
    pub(crate) fn bytes(&self) -> usize {
        self.kept().bytes
    }

    fn kept(&self) -> MutexGuard<'_, Kept<K, V>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Eq + Hash, V> Kept<K, V> {
    fn remove(&mut self, key: K) {
        if let Some(entry) = self.entries.remove(&key) {
            self.bytes -= entry.bytes;
        }
    }
}

impl<K, V> Debug for Cache<K, V> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cache").field("limit", &self.limit).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_values_used_longest_ago_make_room() {
        let cache = Cache::new(20);
        (0..2).for_each(|key| cache.insert(key, Arc::new(key), 10));
        assert_eq!(cache.get(0).as_deref(), Some(&0));
        cache.insert(2, Arc::new(2), 10);
        assert_eq!([0, 1, 2].map(|key| cache.get(key).is_some()), [true, false, true]);
        cache.insert(2, Arc::new(3), 5);
        assert_eq!((cache.get(2).as_deref(), cache.bytes()), (Some(&3), 15));
        cache.insert(3, Arc::new(4), 21);
        assert_eq!((cache.get(3), cache.bytes()), (None, 0), "too large, and all others made room");
    }

    #[test]
    fn forgotten_values_free_their_bytes() {
        let cache = Cache::new(100);
        (0..5).for_each(|key| cache.insert(key, Arc::new(()), 10));
        cache.forget(|key| key % 2 == 0);
        assert_eq!(cache.bytes(), 20);
        assert!(cache.get(0).is_none() && cache.get(1).is_some());
    }
}
