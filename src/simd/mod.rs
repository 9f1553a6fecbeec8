//! Instruction sets: one trait, one back-end each, chosen at run time.

/// An instruction set the kernels are compiled for.
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
    /// Its name: `scalar`, `base` or `v3`.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Base => "base",
            Level::X86V3 => "v3",
        }
    }

    /// The best level of this machine, or the one `SKEP_SIMD` asks for when the machine has it.
    pub fn detect() -> Level {
        Level::Base
    }
}
