//! Eight f32 lanes, and the choice of instruction set.
//!
//! Kernels are written once, over [`Isa`], and compiled twice: over arrays for any processor, and
//! over AVX2 registers. What the lanes compute is only a conservative filter (see the crate's
//! documentation), so products and sums may be fused where the processor can: no result depends on
//! it.
#![allow(
    unsafe_code,
    reason = "calling code compiled for AVX2 is unsafe; each block says why it is sound"
)]

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

/// The instruction set of any processor: loops over arrays.
///
/// They are `#[inline]`, so that the compiler simplifies each loop before it inlines it. With
/// `#[inline(always)]` it is the other way round, and takes the compiler ten times as long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

#[inline]
fn zip(a: F8, b: F8, f: impl Fn(f32, f32) -> f32) -> F8 {
    let mut out = [0.0; 8];
    for ((out, a), b) in out.iter_mut().zip(a.0).zip(b.0) {
        *out = f(a, b);
    }
    F8(out)
}

impl Isa for Portable {
    type V = F8;

    #[inline]
    fn load(self, memory: &F8) -> F8 {
        *memory
    }

    #[inline]
    fn store(self, v: F8) -> F8 {
        v
    }

    #[inline]
    fn splat(self, x: f32) -> F8 {
        F8::splat(x)
    }

    #[inline]
    fn widen(self, memory: &U8) -> F8 {
        let mut wide = [0.0; 8];
        for (wide, &narrow) in wide.iter_mut().zip(&memory.0) {
            *wide = f32::from(narrow);
        }
        F8(wide)
    }

    #[inline]
    fn sub(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| a - b)
    }

    #[inline]
    fn mul(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| a * b)
    }

    #[inline]
    fn mul_add(self, a: F8, b: F8, c: F8) -> F8 {
        zip(zip(a, b, |a, b| a * b), c, |ab, c| ab + c)
    }

    #[inline]
    fn mul_sub(self, a: F8, b: F8, c: F8) -> F8 {
        zip(zip(a, b, |a, b| a * b), c, |ab, c| ab - c)
    }

    #[inline]
    fn max(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline]
    fn min(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline]
    fn le(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| {
            f32::from_bits(if a <= b { u32::MAX } else { 0 })
        })
    }

    #[inline]
    fn and(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() & b.to_bits()))
    }

    #[inline]
    fn xor(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() ^ b.to_bits()))
    }

    #[inline]
    fn signs(self, v: F8) -> u32 {
        let mut mask = 0;
        for (i, lane) in v.0.iter().enumerate() {
            mask |= (lane.to_bits() >> 31) << i;
        }
        mask
    }

    #[inline]
    fn keys(self, distances: F8, mask: F8) -> Keys {
        let mut keys = [0; 8];
        for ((key, distance), mask) in keys.iter_mut().zip(distances.0).zip(mask.0) {
            *key = ((distance.to_bits() | !mask.to_bits()) >> 16) as u16;
        }
        Keys(keys)
    }

    #[inline]
    fn first(self, keys: &Keys) -> usize {
        let least = keys.0.iter().zip(0_u32..);
        let least = least.map(|(&key, lane)| u32::from(key) << 3 | lane).min();
        least.map_or(0, |packed| (packed & 7) as usize)
    }

    #[inline]
    fn only(self, v: F8, mask: F8) -> F8 {
        zip(v, mask, |v, mask| {
            f32::from_bits(v.to_bits() | !mask.to_bits())
        })
    }

    #[inline]
    fn all_keys(self, distances: F8) -> Keys {
        self.keys(distances, F8::splat(f32::from_bits(u32::MAX)))
    }

    #[inline]
    fn columns(self, rows: &Rows) -> [u64; 8] {
        let mut columns = [0; 8];
        for (i, row) in rows.0.iter().enumerate() {
            for (k, column) in columns.iter_mut().enumerate() {
                *column |= u64::from(row >> k & 1) << i;
            }
        }
        columns
    }

    #[inline]
    fn prefetch<T>(self, _: &T) {}
}

/// Invariant: a value exists only where the processor has AVX2, FMA, POPCNT and BMI1.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    fn detect() -> Option<Self> {
        let has = std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma")
            && std::arch::is_x86_feature_detected!("popcnt")
            && std::arch::is_x86_feature_detected!("bmi1");
        has.then_some(Self(()))
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,popcnt,bmi1")]
        fn compiled<K: Kernel>(avx2: Avx2, kernel: K) -> K::Output {
            kernel.run(avx2)
        }
        // SAFETY: the processor has what is enabled, by the invariant of `Self`.
        unsafe { compiled(self, kernel) }
    }
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

/// Arithmetic that is one instruction.
#[cfg(target_arch = "x86_64")]
macro_rules! instruction {
    ($name:ident($($arg:ident),*) = $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, $($arg: x86::__m256),*) -> x86::__m256 {
            // SAFETY: the processor has AVX2 and FMA, by the invariant of `Self`; the instruction
            // asks for no more, and touches no memory.
            unsafe { x86::$intrinsic($($arg),*) }
        }
    };
}

#[cfg(target_arch = "x86_64")]
impl Isa for Avx2 {
    type V = x86::__m256;

    #[inline(always)]
    fn load(self, memory: &F8) -> x86::__m256 {
        // SAFETY: AVX, by the invariant of `Self`; `F8` is 32 bytes and as much aligned.
        unsafe { x86::_mm256_load_ps(memory.0.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, v: x86::__m256) -> F8 {
        let mut memory = F8::splat(0.0);
        // SAFETY: AVX, by the invariant of `Self`; `F8` is 32 bytes and as much aligned.
        unsafe { x86::_mm256_store_ps(memory.0.as_mut_ptr(), v) };
        memory
    }

    #[inline(always)]
    fn splat(self, x: f32) -> x86::__m256 {
        // SAFETY: AVX, by the invariant of `Self`.
        unsafe { x86::_mm256_set1_ps(x) }
    }

    #[inline(always)]
    fn widen(self, memory: &U8) -> x86::__m256 {
        // SAFETY: AVX2, by the invariant of `Self`; `U8` is 16 bytes and as much aligned.
        unsafe {
            let narrow = x86::_mm_load_si128(memory.0.as_ptr().cast());
            x86::_mm256_cvtepi32_ps(x86::_mm256_cvtepu16_epi32(narrow))
        }
    }

    instruction!(sub(a, b) = _mm256_sub_ps);
    instruction!(mul(a, b) = _mm256_mul_ps);
    instruction!(mul_add(a, b, c) = _mm256_fmadd_ps);
    instruction!(mul_sub(a, b, c) = _mm256_fmsub_ps);
    instruction!(max(a, b) = _mm256_max_ps);
    instruction!(min(a, b) = _mm256_min_ps);
    instruction!(and(a, b) = _mm256_and_ps);
    instruction!(xor(a, b) = _mm256_xor_ps);

    #[inline(always)]
    fn le(self, a: x86::__m256, b: x86::__m256) -> x86::__m256 {
        // SAFETY: AVX, by the invariant of `Self`.
        unsafe { x86::_mm256_cmp_ps::<{ x86::_CMP_LE_OQ }>(a, b) }
    }

    #[inline(always)]
    fn signs(self, v: x86::__m256) -> u32 {
        // SAFETY: AVX, by the invariant of `Self`.
        unsafe { x86::_mm256_movemask_ps(v).cast_unsigned() }
    }

    #[inline(always)]
    fn keys(self, distances: x86::__m256, mask: x86::__m256) -> Keys {
        let mut keys = Keys::NONE;
        // SAFETY: AVX2, by the invariant of `Self`; `Keys` is 16 bytes and as much aligned.
        unsafe {
            let ones = x86::_mm256_castsi256_ps(x86::_mm256_set1_epi32(-1));
            let open = x86::_mm256_or_ps(distances, x86::_mm256_xor_ps(mask, ones));
            let upper = x86::_mm256_srli_epi32::<16>(x86::_mm256_castps_si256(open));
            let low = x86::_mm256_castsi256_si128(upper);
            let high = x86::_mm256_extracti128_si256::<1>(upper);
            let packed = x86::_mm_packus_epi32(low, high);
            x86::_mm_store_si128(keys.0.as_mut_ptr().cast(), packed);
        }
        keys
    }

    #[inline(always)]
    fn first(self, keys: &Keys) -> usize {
        // SAFETY: AVX2 and so SSE4.1, by the invariant of `Self`; `Keys` is 16 bytes and as much
        // aligned.
        let least = unsafe {
            let keys = x86::_mm_load_si128(keys.0.as_ptr().cast());
            x86::_mm_cvtsi128_si32(x86::_mm_minpos_epu16(keys))
        };
        // The key is in the lower half, the lane above it.
        least.cast_unsigned() as usize >> 16
    }

    #[inline(always)]
    fn only(self, v: x86::__m256, mask: x86::__m256) -> x86::__m256 {
        // SAFETY: AVX2, by the invariant of `Self`.
        unsafe {
            let ones = x86::_mm256_castsi256_ps(x86::_mm256_set1_epi32(-1));
            x86::_mm256_or_ps(v, x86::_mm256_xor_ps(mask, ones))
        }
    }

    #[inline(always)]
    fn all_keys(self, distances: x86::__m256) -> Keys {
        // SAFETY: AVX2, by the invariant of `Self`.
        let ones = unsafe { x86::_mm256_castsi256_ps(x86::_mm256_set1_epi32(-1)) };
        self.keys(distances, ones)
    }

    #[inline(always)]
    fn columns(self, rows: &Rows) -> [u64; 8] {
        let mut columns = [0; 8];
        // SAFETY: AVX2, by the invariant of `Self`; `Rows` is 64 bytes and as much aligned.
        unsafe {
            let half: *const x86::__m256i = rows.0.as_ptr().cast();
            let mut low = x86::_mm256_load_si256(half);
            let mut high = x86::_mm256_load_si256(half.add(1));
            // Lane 7 is in the sign bits; each doubling of the bytes moves the next lane there.
            for column in columns.iter_mut().rev() {
                let bits = |v| u64::from(x86::_mm256_movemask_epi8(v).cast_unsigned());
                *column = bits(high) << 32 | bits(low);
                low = x86::_mm256_add_epi8(low, low);
                high = x86::_mm256_add_epi8(high, high);
            }
        }
        columns
    }

    #[inline(always)]
    fn prefetch<T>(self, value: &T) {
        let first: *const i8 = std::ptr::from_ref(value).cast();
        for line in (0..size_of::<T>()).step_by(64) {
            // SAFETY: SSE, by the invariant of `Self`; the line is one of the value's.
            unsafe { x86::_mm_prefetch::<{ x86::_MM_HINT_T0 }>(first.add(line)) };
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
