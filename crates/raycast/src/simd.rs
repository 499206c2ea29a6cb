//! Eight f32 lanes, and the choice of instruction set.
//!
//! Kernels are written once, over plain arrays, and are compiled twice: for the target's baseline
//! and for AVX2, where each operation below becomes one instruction. No operation is fused, so both
//! give the same bits.
#![allow(
    unsafe_code,
    reason = "calling code compiled for AVX2 is unsafe; each block says why it is sound"
)]

/// Eight lanes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct F8(pub(crate) [f32; 8]);

impl F8 {
    #[inline(always)]
    pub(crate) fn splat(x: f32) -> Self {
        Self([x; 8])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; 8];
        for ((out, a), b) in out.iter_mut().zip(self.0).zip(other.0) {
            *out = f(a, b);
        }
        Self(out)
    }

    /// The larger; `other` if either is NaN (as the x86 instruction).
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller; `other` if either is NaN (as the x86 instruction).
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    /// All bits where `self <= other`, none elsewhere and for NaN.
    #[inline(always)]
    pub(crate) fn le(self, other: Self) -> Self {
        self.zip(other, |a, b| {
            f32::from_bits(if a <= b { u32::MAX } else { 0 })
        })
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl std::ops::$trait for F8 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    };
}
operator!(Sub, sub, -);
operator!(Mul, mul, *);

/// An instruction set: what arrays cannot say portably and well.
pub(crate) trait Isa: Copy {
    /// The sign bits of the lanes, lane 0 lowest.
    fn signs(self, lanes: F8) -> u32;
}

/// Work to be compiled for each instruction set. Implementations are `#[inline(always)]`.
pub(crate) trait Kernel {
    type Output;
    fn run<I: Isa>(self, isa: I) -> Self::Output;
}

/// The instruction set to use.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Level {
    /// The best of this processor.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }

    #[inline(always)]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(kernel),
        }
    }
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl Isa for Portable {
    #[inline(always)]
    fn signs(self, lanes: F8) -> u32 {
        let mut mask = 0;
        for (i, lane) in lanes.0.iter().enumerate() {
            mask |= (lane.to_bits() >> 31) << i;
        }
        mask
    }
}

/// Invariant: a value exists only where the processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    fn detect() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        fn compiled<K: Kernel>(avx2: Avx2, kernel: K) -> K::Output {
            kernel.run(avx2)
        }
        // SAFETY: the processor has AVX2, by the invariant of `Self`.
        unsafe { compiled(self, kernel) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Isa for Avx2 {
    #[inline(always)]
    fn signs(self, lanes: F8) -> u32 {
        use std::arch::x86_64::{_mm256_movemask_ps, _mm256_setr_ps};
        let [a, b, c, d, e, f, g, h] = lanes.0;
        // SAFETY: both need AVX only, which the processor has, by the invariant of `Self`.
        unsafe { _mm256_movemask_ps(_mm256_setr_ps(a, b, c, d, e, f, g, h)).cast_unsigned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Compare(F8, F8);

    impl Kernel for Compare {
        type Output = u32;

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> u32 {
            isa.signs(self.0.le(self.1.min(self.0.max(F8::splat(1.0)))))
        }
    }

    #[test]
    fn instruction_sets_agree_nan_included() {
        let a = F8([0.0, -0.0, 1.0, f32::NAN, 4.0, f32::NEG_INFINITY, 3.0, -1.0]);
        let b = F8([0.0, 0.0, f32::NAN, 1.0, 5.0, f32::INFINITY, 3.0, -2.0]);
        let portable = Level::Portable.run(Compare(a, b));
        assert_eq!(portable, 0b0111_0111);
        assert_eq!(Level::detect().run(Compare(a, b)), portable);
    }
}
