//! The SIMD levels, their detection at run time and the dispatch to a back-end.

use super::{Baseline, Scalar, Simd};

/// Environment variable that forces a level by name, see [`SimdLevel::detect`].
const LEVEL_VARIABLE: &str = "SKEP_SIMD";

/// An instruction set that the kernels are compiled for, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// Plain f32 arithmetic, lane by lane; the oracle of the tests.
    Scalar,
    /// Vectors of the compile target's baseline: SSE2, NEON or wasm simd128.
    Baseline,
    /// x86-64-v3: AVX2, BMI1, BMI2 and POPCNT.
    X86V3,
}

impl SimdLevel {
    /// All levels, ascending.
    pub const ALL: [SimdLevel; 3] = [SimdLevel::Scalar, SimdLevel::Baseline, SimdLevel::X86V3];

    /// The name of the level: `scalar`, `baseline` or `v3`.
    pub fn name(self) -> &'static str {
        match self {
            SimdLevel::Scalar => "scalar",
            SimdLevel::Baseline => "baseline",
            SimdLevel::X86V3 => "v3",
        }
    }

    /// Whether this CPU supports the level.
    pub fn is_available(self) -> bool {
        self <= SimdLevel::best()
    }

    /// The level to run at: the one that the environment variable `SKEP_SIMD` names, or the best one where
    /// the variable is unset or holds no name of a level. A level that the CPU does not support is lowered to
    /// the best.
    pub fn detect() -> SimdLevel {
        let forced = std::env::var(LEVEL_VARIABLE).ok();
        // `base` is the former name of `baseline`.
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

/// A computation that is generic over the back-end. A trait, since a closure cannot be generic.
pub trait Task {
    /// The result.
    type Output;
    /// Runs the computation on this back-end. It is expected to call [`Simd::vectorize`] itself, per tile.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a task on the back-end of a level; a level that the CPU does not support is lowered to the best one.
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
