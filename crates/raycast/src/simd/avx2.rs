//! The instruction set AVX2, with FMA, POPCNT and BMI1.
#![allow(
    unsafe_code,
    reason = "calling code compiled for AVX2 is unsafe; each block says why it is sound"
)]

use std::arch::x86_64 as x86;

use super::{F8, Isa, Kernel, Keys, Rows, U8};

/// Invariant: a value exists only where the processor has AVX2, FMA, POPCNT and BMI1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    pub(super) fn detect() -> Option<Self> {
        let has = std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma")
            && std::arch::is_x86_feature_detected!("popcnt")
            && std::arch::is_x86_feature_detected!("bmi1");
        has.then_some(Self(()))
    }

    #[inline(always)]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,popcnt,bmi1")]
        fn compiled<K: Kernel>(avx2: Avx2, kernel: K) -> K::Output {
            kernel.run(avx2)
        }
        // SAFETY: the processor has what is enabled, by the invariant of `Self`.
        unsafe { compiled(self, kernel) }
    }
}

/// Arithmetic that is one instruction.
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
