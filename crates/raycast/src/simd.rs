//! Eight f32 lanes, and the choice of instruction set.
//!
//! Kernels are written once, over [`Isa`], and compiled twice: over arrays for any processor, and
//! over AVX2 registers. What the lanes compute is only a conservative filter (see the crate's
//! documentation), so products and sums may be fused where the processor can: no result depends on
//! it.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;

#[cfg(target_arch = "x86_64")]
use self::avx2::Avx2;
use self::portable::Portable;

/// Eight numbers in memory.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct F8(pub(crate) [f32; 8]);

impl F8 {
    pub(crate) const fn splat(x: f32) -> Self {
        Self([x; 8])
    }
}

/// Eight small numbers in memory.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(crate) struct U8(pub(crate) [u16; 8]);

/// Sort keys of eight lanes: the upper halves of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub(crate) struct Keys([u16; 8]);

/// The key of a lane that is done, which sorts after all others.
const DONE: u16 = u16::MAX;

impl Keys {
    pub(crate) const NONE: Self = Self([DONE; 8]);

    /// Marks a lane as done.
    #[inline(always)]
    pub(crate) fn remove(&mut self, lane: usize) {
        const STRIKE: [[u16; 8]; 8] = {
            let mut rows = [[0; 8]; 8];
            let mut lane = 0;
            while lane < 8 {
                rows[lane][lane] = DONE;
                lane += 1;
            }
            rows
        };
        for (key, strike) in self.0.iter_mut().zip(STRIKE[lane & 7]) {
            *key |= strike;
        }
    }
}

/// Lanes of 64 rays: bit `k` of row `i` for lane `k` of ray `i`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Rows(pub(crate) [u8; 64]);

impl Rows {
    pub(crate) const NONE: Self = Self([0; 64]);
}

/// An instruction set: arithmetic on eight lanes.
pub(crate) trait Isa: Copy {
    /// Eight numbers in a register. Masks have all bits of a lane set, or none.
    type V: Copy;

    fn load(self, memory: &F8) -> Self::V;
    fn store(self, v: Self::V) -> F8;
    fn splat(self, x: f32) -> Self::V;
    /// Converts small numbers to f32, exactly.
    fn widen(self, memory: &U8) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a b + c`, with one or two roundings.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `a b − c`, with one or two roundings.
    fn mul_sub(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// The larger; `b` if either is NaN.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// The smaller; `b` if either is NaN.
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    /// The mask of `a <= b`, which is false for NaN.
    fn le(self, a: Self::V, b: Self::V) -> Self::V;
    fn and(self, a: Self::V, b: Self::V) -> Self::V;
    fn xor(self, a: Self::V, b: Self::V) -> Self::V;
    /// The sign bits of the lanes, lane 0 lowest.
    fn signs(self, v: Self::V) -> u32;
    /// The keys of distances; lanes outside the mask are marked as done.
    fn keys(self, distances: Self::V, mask: Self::V) -> Keys;
    /// A lane with the least key; any lane if all are done.
    fn first(self, keys: &Keys) -> usize;
    /// The lanes in the mask, and NaN outside of it.
    fn only(self, v: Self::V, mask: Self::V) -> Self::V;
    /// The keys of all distances.
    fn all_keys(self, distances: Self::V) -> Keys;
    /// Turns rows into columns: bit `i` of number `k` is that of lane `k` of ray `i`.
    fn columns(self, rows: &Rows) -> [u64; 8];
    /// Asks the processor to fetch a value that is needed soon.
    fn prefetch<T>(self, value: &T);
}

/// Eight vectors of three.
///
/// Plain functions: closures, and so `array::map`, cannot be told to be inlined, and code that is
/// not inlined into a kernel is not compiled for its instruction set.
#[derive(Clone, Copy)]
pub(crate) struct V3<I: Isa>(pub(crate) I::V, pub(crate) I::V, pub(crate) I::V);

impl<I: Isa> V3<I> {
    #[inline(always)]
    pub(crate) fn load(isa: I, [x, y, z]: &[F8; 3]) -> Self {
        Self(isa.load(x), isa.load(y), isa.load(z))
    }

    #[inline(always)]
    pub(crate) fn splat(isa: I, [x, y, z]: [f32; 3]) -> Self {
        Self(isa.splat(x), isa.splat(y), isa.splat(z))
    }

    #[inline(always)]
    pub(crate) fn sub(self, isa: I, b: Self) -> Self {
        Self(
            isa.sub(self.0, b.0),
            isa.sub(self.1, b.1),
            isa.sub(self.2, b.2),
        )
    }

    #[inline(always)]
    pub(crate) fn scale(self, isa: I, s: I::V) -> Self {
        Self(isa.mul(self.0, s), isa.mul(self.1, s), isa.mul(self.2, s))
    }

    #[inline(always)]
    pub(crate) fn dot(self, isa: I, b: Self) -> I::V {
        let yz = isa.mul_add(self.1, b.1, isa.mul(self.2, b.2));
        isa.mul_add(self.0, b.0, yz)
    }

    #[inline(always)]
    pub(crate) fn cross(self, isa: I, b: Self) -> Self {
        Self(
            isa.mul_sub(self.1, b.2, isa.mul(self.2, b.1)),
            isa.mul_sub(self.2, b.0, isa.mul(self.0, b.2)),
            isa.mul_sub(self.0, b.1, isa.mul(self.1, b.0)),
        )
    }
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
    /// The best instruction set of this processor.
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

#[cfg(test)]
mod tests {
    use super::*;

    const A: F8 = F8([0.0, -0.0, 1.0, f32::NAN, 4.0, f32::NEG_INFINITY, 3.0, -1.0]);
    const B: F8 = F8([0.0, 0.0, f32::NAN, 1.0, 5.0, f32::INFINITY, 3.0, -2.0]);

    /// The results of every operation, as bits.
    struct Everything;

    impl Kernel for Everything {
        type Output = (Vec<[u32; 8]>, Vec<u32>, Vec<(Keys, Vec<usize>)>);

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> Self::Output {
            let (a, b, one) = (isa.load(&A), isa.load(&B), isa.splat(1.0));
            // The products are exact, so fused and separate operations give the same result.
            let c = isa.splat(8.0);
            let all = [
                isa.sub(c, one),
                isa.mul(c, b),
                isa.mul_add(c, c, one),
                isa.mul_sub(c, c, one),
                isa.max(a, b),
                isa.max(b, a),
                isa.min(a, b),
                isa.min(b, a),
                isa.le(a, b),
                isa.le(b, a),
                isa.and(a, b),
                isa.xor(a, b),
            ];
            let bits = all.map(|v| isa.store(v).0.map(f32::to_bits)).to_vec();
            let signs = all.map(|v| isa.signs(v)).to_vec();
            let distances = isa.load(&F8([5.0, 0.0, 7.0, 1e30, 6.0, 5.5, f32::INFINITY, 3.0]));
            let keys = [isa.le(a, b), isa.le(b, b)].map(|mask| {
                let keys = isa.keys(distances, mask);
                let mut left = keys;
                let mut order = Vec::new();
                while left != Keys::NONE {
                    order.push(isa.first(&left));
                    left.remove(isa.first(&left));
                }
                (keys, order)
            });
            (bits, signs, keys.to_vec())
        }
    }

    #[test]
    fn instruction_sets_agree_nan_included() {
        // Only the sign of NaN is not specified.
        let tame = |mut r: <Everything as Kernel>::Output| {
            let nan = |bits: &mut u32| {
                if f32::from_bits(*bits).is_nan() && *bits != u32::MAX {
                    *bits = f32::NAN.to_bits();
                }
            };
            r.0.iter_mut().flatten().for_each(nan);
            r
        };
        let portable = tame(Level::Portable.run(Everything));
        assert_eq!(portable.1[8], 0b0111_0011);
        assert_eq!(portable.2[0].1, [1, 0, 5, 4, 6]);
        assert_eq!(portable.2[1].1, [1, 7, 0, 5, 4, 3, 6]);
        let detected = tame(Level::detect().run(Everything));
        assert_eq!(detected, portable);
    }
}
