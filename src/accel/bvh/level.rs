//! Instruction sets, and the dispatch of a query to one of them.

use pulp::NullaryFnOnce;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

use super::lanes::{Lanes, Portable};
use super::node::WIDTH;

/// Instruction sets that traversal is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// What the build's target has.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL.
    Avx512,
}

impl SimdLevel {
    /// All levels, the best last.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The best level of this processor.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this processor has the level.
    pub fn is_available(self) -> bool {
        Dispatch::new(self).is_some()
    }
}

/// Proof that the processor has what the chosen level needs.
#[derive(Clone, Copy)]
pub enum Dispatch {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
}

impl Dispatch {
    /// The proof, if the processor has the level.
    pub fn new(level: SimdLevel) -> Option<Self> {
        match level {
            SimdLevel::Portable => Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => V3::try_new().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => V4::try_new().map(Self::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            SimdLevel::Avx2 | SimdLevel::Avx512 => None,
        }
    }
}

impl Dispatch {
    /// Runs a task on the level, compiled for it.
    #[inline(always)]
    pub fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            Self::Portable => task.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.vectorize(OnLevel { simd, task }),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.vectorize(OnLevel { simd, task }),
        }
    }
}

/// A query that can be compiled for any level.
pub trait Task {
    type Output;
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> Self::Output;
}

/// A task bound to a level.
pub struct OnLevel<S, T> {
    pub simd: S,
    pub task: T,
}

impl<S: Lanes<WIDTH>, T: Task> NullaryFnOnce for OnLevel<S, T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.task.run(self.simd)
    }
}
