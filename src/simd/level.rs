//! The levels there are, and the choice among them.

use super::{Baseline, Scalar, Simd};

/// An instruction set the kernels are compiled for, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// One lane at a time; the oracle of the tests.
    Scalar,
    /// Vectors of the compile target's baseline (SSE2, NEON, wasm simd128).
    Baseline,
    /// x86-64-v3: AVX2.
    X86V3,
}

impl SimdLevel {
    /// All levels, ascending.
    pub const ALL: [SimdLevel; 3] = [SimdLevel::Scalar, SimdLevel::Baseline, SimdLevel::X86V3];

    /// Its name: `scalar`, `baseline` or `v3`.
    pub fn name(self) -> &'static str {
        match self {
            SimdLevel::Scalar => "scalar",
            SimdLevel::Baseline => "baseline",
            SimdLevel::X86V3 => "v3",
        }
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        self <= SimdLevel::best()
    }

    /// The level to run at: the one the environment variable `SKEP_SIMD` names, lowered to what the machine has, else
    /// the best.
    pub fn detect() -> SimdLevel {
        let forced = std::env::var("SKEP_SIMD").ok();
        // `base` is what programs wrote before the name was spelled out.
        let forced = forced.as_deref().map(|name| if name == "base" { "baseline" } else { name });
        let forced = SimdLevel::ALL.into_iter().find(|level| Some(level.name()) == forced);
        forced.unwrap_or(SimdLevel::X86V3).min(SimdLevel::best())
    }

    #[cfg(target_arch = "x86_64")]
    fn best() -> SimdLevel {
        if super::X86V3::new().is_some() { SimdLevel::X86V3 } else { SimdLevel::Baseline }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn best() -> SimdLevel {
        SimdLevel::Baseline
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
pub fn dispatch<T: Task>(level: SimdLevel, task: T) -> T::Output {
    match level {
        SimdLevel::Scalar => task.run(Scalar),
        SimdLevel::Baseline => task.run(Baseline),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::X86V3 => match super::X86V3::new() {
            Some(v3) => task.run(v3),
            None => task.run(Baseline),
        },
        #[cfg(not(target_arch = "x86_64"))]
        SimdLevel::X86V3 => task.run(Baseline),
    }
}
