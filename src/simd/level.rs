//! The levels there are, and the choice among them.

use super::{Base, Scalar, Simd};

/// An instruction set the kernels are compiled for, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// One lane at a time; the oracle of the tests.
    Scalar,
    /// Vectors of the compile target's baseline (SSE2, NEON, wasm simd128).
    Base,
    /// x86-64-v3: AVX2.
    X86V3,
}

impl Level {
    /// All levels, ascending.
    pub const ALL: [Level; 3] = [Level::Scalar, Level::Base, Level::X86V3];

    /// Its name: `scalar`, `base` or `v3`.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Base => "base",
            Level::X86V3 => "v3",
        }
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        self <= Level::best()
    }

    /// The level to run at: the one the environment variable `SKEP_SIMD` names, lowered to what the machine has, else
    /// the best.
    pub fn detect() -> Level {
        let forced = std::env::var("SKEP_SIMD").ok();
        let forced = Level::ALL.into_iter().find(|level| Some(level.name()) == forced.as_deref());
        forced.unwrap_or(Level::X86V3).min(Level::best())
    }

    #[cfg(target_arch = "x86_64")]
    fn best() -> Level {
        if super::X86V3::new().is_some() { Level::X86V3 } else { Level::Base }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn best() -> Level {
        Level::Base
    }
}

/// Work that runs on any back-end.
pub trait Task {
    /// What it gives.
    type Output;
    /// Runs on this back-end.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a task on the back-end of this level, lowered to what the machine has.
pub fn dispatch<T: Task>(level: Level, task: T) -> T::Output {
    match level {
        Level::Scalar => task.run(Scalar),
        Level::Base => task.run(Base),
        #[cfg(target_arch = "x86_64")]
        Level::X86V3 => match super::X86V3::new() {
            Some(v3) => task.run(v3),
            None => task.run(Base),
        },
        #[cfg(not(target_arch = "x86_64"))]
        Level::X86V3 => task.run(Base),
    }
}
