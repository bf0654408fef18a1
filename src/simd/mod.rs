//! Work compiled for the vector instructions of the processor that runs it.
//!
//! The program is built for any x86-64. Work that goes through [`vectorize`] is compiled three times, for AVX-512, AVX2 and
//! what the build's target has, and the best that the processor offers is run. Only what is inlined into
//! [`NullaryFnOnce::call`] is; that must be `#[inline(always)]`, and so must what it calls. Closures can't be, and are
//! compiled for the build's target wherever the compiler does not inline them by itself: so work is a type.

mod lanes;

pub use lanes::LANES;
pub(crate) use lanes::{Lanes, each_lane, horizontal_extremes, horizontal_sum, horizontal_sums};

use pulp::NullaryFnOnce;

/// For reports: the vector instructions that [`vectorize`] takes on this processor.
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if pulp::x86::V4::try_new().is_some() {
            return "AVX-512";
        }
        if pulp::x86::V3::try_new().is_some() {
            return "AVX2";
        }
    }
    "those of the target"
}

/// Runs work with the best vector instructions there are. The result is the same whichever these are: no sum is reordered
/// and no product contracted.
#[inline(always)]
pub fn vectorize<W: NullaryFnOnce>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(simd) = pulp::x86::V4::try_new() {
            return simd.vectorize(work);
        }
        if let Some(simd) = pulp::x86::V3::try_new() {
            return simd.vectorize(work);
        }
    }
    work.call()
}
