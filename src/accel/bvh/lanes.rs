//! The few SIMD operations that traversal needs, behind one trait.
//!
//! Arithmetic is IEEE without contraction on every level, so that all levels return the same hits to
//! the last bit; only [`Lanes::mul_sub`] may be fused, and it is used for box tests alone, which are
//! padded against rounding.

use pulp::NullaryFnOnce;
#[cfg(target_arch = "x86_64")]
use pulp::{
    f32x8, f32x16,
    x86::{V3, V4},
};

/// `array::map` for three elements that is always inlined: what isn't inlined into the traversal functions
/// is compiled without their instruction set.
#[inline(always)]
pub fn map3<T, U>([a, b, c]: [T; 3], f: impl Fn(T) -> U) -> [U; 3] {
    [f(a), f(b), f(c)]
}

/// Vectors of `W` floats on one instruction set level.
pub trait Lanes<const W: usize>: Copy {
    /// `W` floats in registers.
    type F: Copy;

    /// Runs a task compiled for this level; whatever it calls must be inlined into it.
    ///
    /// Tasks are types of their own, since the call of a closure may come out as a function that isn't
    /// compiled for the level.
    fn vectorize<T: NullaryFnOnce>(self, task: T) -> T::Output;
    fn splat(self, value: f32) -> Self::F;
    fn load(self, values: &[f32; W]) -> Self::F;
    fn store(self, values: Self::F) -> [f32; W];
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// a·b − c with one or two roundings.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// The smaller one; `b` where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger one; `b` where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit mask of lanes with a ≤ b; unset where either is NaN.
    fn le(self, a: Self::F, b: Self::F) -> u32;
    /// Bit mask of lanes with a < b; unset where either is NaN.
    fn lt(self, a: Self::F, b: Self::F) -> u32;
    /// Bit mask of lanes with a = b; unset where either is NaN.
    fn eq(self, a: Self::F, b: Self::F) -> u32;
}

/// Plain loops over arrays, for every processor; the compiler vectorises them for the build's target.
#[derive(Clone, Copy)]
pub struct Portable;

macro_rules! portable_binary {
    ($($name:ident = $f:expr;)*) => {
        $(#[inline(always)]
        fn $name(self, a: [f32; W], b: [f32; W]) -> [f32; W] {
            let mut out = [0.0; W];
            for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
                let f: fn(f32, f32) -> f32 = $f;
                *out = f(a, b);
            }
            out
        })*
    };
}

macro_rules! portable_compare {
    ($($name:ident = $op:tt;)*) => {
        $(#[inline(always)]
        fn $name(self, a: [f32; W], b: [f32; W]) -> u32 {
            let mut mask = 0;
            for (lane, (a, b)) in a.into_iter().zip(b).enumerate() {
                mask |= u32::from(a $op b) << lane;
            }
            mask
        })*
    };
}

impl<const W: usize> Lanes<W> for Portable {
    type F = [f32; W];

    #[inline(always)]
    fn vectorize<T: NullaryFnOnce>(self, task: T) -> T::Output {
        task.call()
    }

    #[inline(always)]
    fn splat(self, value: f32) -> [f32; W] {
        [value; W]
    }

    #[inline(always)]
    fn load(self, values: &[f32; W]) -> [f32; W] {
        *values
    }

    #[inline(always)]
    fn store(self, values: [f32; W]) -> [f32; W] {
        values
    }

    #[inline(always)]
    fn mul_sub(self, a: [f32; W], b: [f32; W], c: [f32; W]) -> [f32; W] {
        Lanes::sub(self, Lanes::mul(self, a, b), c)
    }

    portable_binary! {
        add = |a, b| a + b;
        sub = |a, b| a - b;
        mul = |a, b| a * b;
        div = |a, b| a / b;
        min = |a, b| if a < b { a } else { b };
        max = |a, b| if a > b { a } else { b };
    }

    portable_compare! {
        le = <=;
        lt = <;
        eq = ==;
    }
}

#[cfg(target_arch = "x86_64")]
macro_rules! x86_lanes {
    ($token:ty, $width:literal, $vector:ty, $suffix:literal, $mask:expr,
     $splat:ident $add:ident $sub:ident $mul:ident $div:ident $mul_sub:ident $min:ident $max:ident
     $le:ident $lt:ident $eq:ident) => {
        #[doc = $suffix]
        impl Lanes<$width> for $token {
            type F = $vector;

            #[inline(always)]
            fn vectorize<T: NullaryFnOnce>(self, task: T) -> T::Output {
                <$token>::vectorize(self, task)
            }

            #[inline(always)]
            fn splat(self, value: f32) -> $vector {
                self.$splat(value)
            }

            #[inline(always)]
            fn load(self, values: &[f32; $width]) -> $vector {
                pulp::cast(*values)
            }

            #[inline(always)]
            fn store(self, values: $vector) -> [f32; $width] {
                pulp::cast(values)
            }

            #[inline(always)]
            fn add(self, a: $vector, b: $vector) -> $vector {
                self.$add(a, b)
            }

            #[inline(always)]
            fn sub(self, a: $vector, b: $vector) -> $vector {
                self.$sub(a, b)
            }

            #[inline(always)]
            fn mul(self, a: $vector, b: $vector) -> $vector {
                self.$mul(a, b)
            }

            #[inline(always)]
            fn div(self, a: $vector, b: $vector) -> $vector {
                self.$div(a, b)
            }

            #[inline(always)]
            fn mul_sub(self, a: $vector, b: $vector, c: $vector) -> $vector {
                self.$mul_sub(a, b, c)
            }

            #[inline(always)]
            fn min(self, a: $vector, b: $vector) -> $vector {
                self.$min(a, b)
            }

            #[inline(always)]
            fn max(self, a: $vector, b: $vector) -> $vector {
                self.$max(a, b)
            }

            #[inline(always)]
            fn le(self, a: $vector, b: $vector) -> u32 {
                $mask(self, self.$le(a, b))
            }

            #[inline(always)]
            fn lt(self, a: $vector, b: $vector) -> u32 {
                $mask(self, self.$lt(a, b))
            }

            #[inline(always)]
            fn eq(self, a: $vector, b: $vector) -> u32 {
                $mask(self, self.$eq(a, b))
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
x86_lanes!(V3, 8, f32x8, "AVX2 and FMA, 256 bits.",
    |simd: V3, m: pulp::m32x8| simd.avx._mm256_movemask_ps(pulp::cast(m)) as u32,
    splat_f32x8 add_f32x8 sub_f32x8 mul_f32x8 div_f32x8 mul_sub_f32x8 min_f32x8 max_f32x8
    cmp_le_f32x8 cmp_lt_f32x8 cmp_eq_f32x8);

#[cfg(target_arch = "x86_64")]
x86_lanes!(V4, 8, f32x8, "AVX-512 masks on 256 bits.",
    |_, m: pulp::b8| u32::from(m.0),
    splat_f32x8 add_f32x8 sub_f32x8 mul_f32x8 div_f32x8 mul_sub_f32x8 min_f32x8 max_f32x8
    cmp_le_f32x8 cmp_lt_f32x8 cmp_eq_f32x8);

#[cfg(target_arch = "x86_64")]
x86_lanes!(V4, 16, f32x16, "AVX-512, 512 bits.",
    |_, m: pulp::b16| u32::from(m.0),
    splat_f32x16 add_f32x16 sub_f32x16 mul_f32x16 div_f32x16 mul_sub_f32x16 min_f32x16 max_f32x16
    cmp_le_f32x16 cmp_lt_f32x16 cmp_eq_f32x16);
