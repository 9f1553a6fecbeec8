//! The bodies of the fuzz targets (`fuzz/targets/`) with the seeds of `fuzz/seeds/` and mutations of them,
//! the same in every run: no panic, and no allocation beyond a bound. A seed is accepted, unless its name
//! starts with `found`: these made the fuzzer report a fault that is mended.
//!
//! `SKEP_UPDATE_SEEDS=1 cargo test --all-features --test fuzz_seeds` writes the seeds that are made by the
//! writers of this crate; others were found by the fuzzer or written by hand.
#![cfg(all(feature = "capi", target_os = "linux"))]
// The allocator of the tests.
#![allow(unsafe_code)]

mod made;
// Both the fuzzer and this test use only a part of it.
#[allow(dead_code)]
#[path = "../../fuzz/targets/mod.rs"]
mod targets;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes of one allocation, at most: the largest input has 4 kB, and buffers of decoders are below this.
const MAX_ALLOCATION: usize = 16 << 20;
/// Mutations of a seed.
const MUTATIONS: usize = 300;
/// Those of targets that open a run or a scene for each input.
const FEW_MUTATIONS: usize = 40;
const SLOW: [&str; 3] = ["run_files", "pictures", "lists"];

/// The system's allocator, which remembers the largest allocation.
struct Watched;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all calls go to the system's allocator.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: as promised by the caller.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Ordering::Relaxed);
        // SAFETY: as promised by the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Watched = Watched;

fn seeds() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds")
}

/// The seeds of a target by name.
fn seeds_of(target: &str) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<(String, Vec<u8>)> = std::fs::read_dir(seeds().join(target))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(path).unwrap()))
        .collect();
    found.sort();
    found
}

/// A generator of pseudo-random numbers: SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// Numbers that are wrong in many places, of one to eight bytes.
const INTERESTING: [u64; 8] =
    [0, 1, u8::MAX as u64, i32::MAX as u64, u32::MAX as u64, 1 << 31, i64::MAX as u64, u64::MAX];

/// Truncated at every so many bytes, and with bits, bytes, numbers or whole parts changed.
fn mutations(seed: &[u8], count: usize) -> impl Iterator<Item = Vec<u8>> {
    let step = seed.len().div_ceil(count / 4).max(1);
    let truncated = (0..seed.len()).step_by(step).map(|length| seed[..length].to_vec());
    let mut random = Random(seed.len() as u64);
    let changed = (0..count).map(move |_| {
        let mut bytes = seed.to_vec();
        for _ in 0..1 + random.below(3) {
            if bytes.is_empty() {
                break;
            }
            // Often at the start, where headers are.
            let place = random.below(bytes.len());
            let at = if random.below(3) == 0 { place.min(random.below(64)) } else { place };
            match random.below(6) {
                0 | 1 => bytes[at] ^= 1 << random.below(8),
                2 => bytes[at] = random.next() as u8,
                3 => {
                    let number = INTERESTING[random.below(INTERESTING.len())].to_le_bytes();
                    let size = (1 << random.below(4)).min(bytes.len() - at);
                    bytes[at..at + size].copy_from_slice(&number[..size]);
                }
                4 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
                _ => {
                    let end = (at + 1 + random.below(16)).min(bytes.len());
                    let copied = bytes[at..end].to_vec();
                    bytes.splice(at..at, copied);
                }
            }
        }
        bytes
    });
    truncated.chain(changed)
}

/// Runs a target with an input, and names the input where it panics or allocates too much.
fn replay(target: &str, name: &str, number: usize, input: &[u8]) {
    LARGEST.store(0, Ordering::Relaxed);
    let outcome = std::panic::catch_unwind(|| targets::run(target, input));
    let text = String::from_utf8_lossy(&input[..input.len().min(400)]).into_owned();
    assert!(outcome.is_ok(), "{target}: mutation {number} of {name} panics: {text:?}");
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(
        largest <= MAX_ALLOCATION,
        "{target}: mutation {number} of {name} has {largest} bytes allocated: {text:?}"
    );
}

// One test: the allocator counts for the whole process.
#[test]
fn no_seed_and_no_mutation_of_one_panics_or_allocates_much() {
    if std::env::var_os("SKEP_UPDATE_SEEDS").is_some() {
        made::write(&seeds());
    }
    let wanted = std::env::var("SKEP_FUZZ_TARGET").ok();
    for (target, _) in targets::TARGETS {
        if wanted.as_deref().is_some_and(|wanted| wanted != target) {
            continue;
        }
        let started = std::time::Instant::now();
        let count = if SLOW.contains(&target) { FEW_MUTATIONS } else { MUTATIONS };
        let found = seeds_of(target);
        assert!(!found.is_empty(), "{target} has no seeds");
        let mut inputs = 0;
        // Once without a look at the allocations: what stays in memory is made by the first input.
        for (name, seed) in &found {
            let is_accepted = targets::run(target, seed);
            assert!(
                is_accepted || name.starts_with("found"),
                "{target}/{name} is refused; SKEP_UPDATE_SEEDS=1 writes the seeds of own files again"
            );
        }
        for (name, seed) in &found {
            assert!(seed.len() <= 4096, "{target}/{name} has {} bytes", seed.len());
            for (number, input) in std::iter::once(seed.clone()).chain(mutations(seed, count)).enumerate() {
                replay(target, name, number, &input);
                inputs += 1;
            }
        }
        println!("{target}: {inputs} inputs, {:.1} s", started.elapsed().as_secs_f64());
    }
}
