//! Eight numbers side by side, and masks and vectors of them.
//!
//! Arithmetic is that of f32 and u32 in each lane, in the order in which it is written, so lanes
//! have the bits that one number after the other would have. They are plain arrays, which the
//! compiler keeps in the vector registers of whatever processor it compiles for.

mod vectors;

use std::ops::{Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, Neg, Shr, Sub};

pub(crate) use self::vectors::{Vec2x8, Vec3x8, rgb};

/// How many numbers are side by side.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct F32x8([f32; LANES]);

/// Eight hashes or lattice coordinates. Arithmetic wraps around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub(crate) struct U32x8([u32; LANES]);

/// Eight answers: all bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Mask8([u32; LANES]);

/// Functions whose bodies are compiled for each set of vector instructions that `pulp` knows; a
/// call runs the one for the widest registers that the processor has. What a body calls must be
/// inlined into it.
macro_rules! for_each_instruction_set {
    ($(
        $(#[$attribute:meta])*
        $visibility:vis fn $name:ident $(<$lifetime:lifetime>)? (
            $($argument:ident: $type:ty),* $(,)?
        ) -> $output:ty $body:block
    )*) => {$(
        $(#[$attribute])*
        $visibility fn $name $(<$lifetime>)? ($($argument: $type),*) -> $output {
            struct Call $(<$lifetime>)? {
                $($argument: $type),*
            }
            impl $(<$lifetime>)? pulp::NullaryFnOnce for Call $(<$lifetime>)? {
                type Output = $output;
                #[inline(always)]
                fn call(self) -> $output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            pulp::Arch::new().dispatch(Call { $($argument),* })
        }
    )*};
}
pub(crate) use for_each_instruction_set;

/// Applies an expression to each lane. (Loops over arrays become vector instructions; closures, and
/// so `array::map`, cannot be told to be inlined.)
macro_rules! each_lane {
    ($($array:ident),+ => $value:expr) => {{
        let mut lanes = [Default::default(); LANES];
        for lane in 0..LANES {
            $(let $array = $array[lane];)+
            lanes[lane] = $value;
        }
        lanes
    }};
}

/// Implements an operator between lanes, and between lanes and one number for all of them.
macro_rules! operator {
    (
        $lanes:ident, $scalar:ident, $trait:ident::$method:ident, $a:ident, $b:ident => $value:expr
    ) => {
        impl $trait for $lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.0, other.0);
                Self(each_lane!($a, $b => $value))
            }
        }
        impl $trait<$scalar> for $lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: $scalar) -> Self {
                $trait::$method(self, Self::splat(other))
            }
        }
        impl $trait<$lanes> for $scalar {
            type Output = $lanes;
            #[inline(always)]
            fn $method(self, other: $lanes) -> $lanes {
                $trait::$method($lanes::splat(self), other)
            }
        }
    };
}

operator!(F32x8, f32, Add::add, a, b => a + b);
operator!(F32x8, f32, Sub::sub, a, b => a - b);
operator!(F32x8, f32, Mul::mul, a, b => a * b);
operator!(F32x8, f32, Div::div, a, b => a / b);
operator!(U32x8, u32, Add::add, a, b => a.wrapping_add(b));
operator!(U32x8, u32, Mul::mul, a, b => a.wrapping_mul(b));
operator!(U32x8, u32, BitAnd::bitand, a, b => a & b);
operator!(U32x8, u32, BitXor::bitxor, a, b => a ^ b);

/// Adding this to a number below 2²² in size leaves its nearest integer in the lowest bits.
const INTEGER_BITS: f32 = 12_582_912.0;

impl F32x8 {
    #[inline(always)]
    pub(crate) const fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    pub(crate) const fn new(lanes: [f32; LANES]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    pub(crate) const fn to_array(self) -> [f32; LANES] {
        self.0
    }

    #[inline(always)]
    pub(crate) fn min(self, other: impl Into<Self>) -> Self {
        let (a, b) = (self.0, other.into().0);
        Self(each_lane!(a, b => if a < b { a } else { b }))
    }

    #[inline(always)]
    pub(crate) fn max(self, other: impl Into<Self>) -> Self {
        let (a, b) = (self.0, other.into().0);
        Self(each_lane!(a, b => if a > b { a } else { b }))
    }

    #[inline(always)]
    pub(crate) fn clamp(self, low: f32, high: f32) -> Self {
        self.max(low).min(high)
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        let a = self.0;
        Self(each_lane!(a => a.abs()))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        let a = self.0;
        Self(each_lane!(a => a.sqrt()))
    }

    /// The largest integer not above a number whose size is below 2²². (`f32::floor` is a call on
    /// baseline x86-64.)
    #[inline(always)]
    pub(crate) fn floor(self) -> Self {
        let nearest = (self + INTEGER_BITS) - INTEGER_BITS;
        nearest - self.lt(nearest).indicator()
    }

    /// Integers of a size below 2²² as words; negative ones wrap around.
    #[inline(always)]
    pub(crate) fn to_u32(self) -> U32x8 {
        let a = (self + INTEGER_BITS).0;
        U32x8(each_lane!(a => a.to_bits().wrapping_sub(INTEGER_BITS.to_bits())))
    }

    /// A function of each lane, one after the other.
    pub(crate) fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: impl Into<Self>) -> Mask8 {
        let (a, b) = (self.0, other.into().0);
        Mask8(each_lane!(a, b => if a < b { u32::MAX } else { 0 }))
    }

    #[inline(always)]
    pub(crate) fn gt(self, other: impl Into<Self>) -> Mask8 {
        other.into().lt(self)
    }
}

impl From<f32> for F32x8 {
    #[inline(always)]
    fn from(x: f32) -> Self {
        Self::splat(x)
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self.0;
        Self(each_lane!(a => -a))
    }
}

impl<T> AddAssign<T> for F32x8
where
    Self: Add<T, Output = Self>,
{
    #[inline(always)]
    fn add_assign(&mut self, other: T) {
        *self = *self + other;
    }
}

impl U32x8 {
    #[inline(always)]
    pub(crate) const fn new(lanes: [u32; LANES]) -> Self {
        Self(lanes)
    }

    /// Where words below 2³¹ are below another one.
    #[inline(always)]
    pub(crate) fn lt(self, other: u32) -> Mask8 {
        let a = self.0;
        // Processors compare signed words.
        Mask8(each_lane!(a => if (a as i32) < (other as i32) { u32::MAX } else { 0 }))
    }

    /// Where the highest bit is set.
    #[inline(always)]
    pub(crate) fn is_negative(self) -> Mask8 {
        Mask8(self.has_bit(31).0)
    }

    /// The words where the mask is set, 0 elsewhere.
    #[inline(always)]
    pub(crate) fn only(self, mask: Mask8) -> Self {
        self & Self(mask.0)
    }

    /// Gathers the numbers at these places of a table.
    #[inline(always)]
    pub(crate) fn gather(self, table: &[f32]) -> F32x8 {
        // Without this the compiler would compute the places lane by lane, too.
        let a = std::hint::black_box(self).0;
        F32x8(each_lane!(a => table[a as usize]))
    }

    #[inline(always)]
    pub(crate) const fn splat(x: u32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    pub(crate) const fn to_array(self) -> [u32; LANES] {
        self.0
    }

    #[inline(always)]
    pub(crate) fn rotate_left(self, bits: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => a.rotate_left(bits)))
    }

    /// Words below 2³¹ as numbers.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> F32x8 {
        let a = self.0;
        // Processors have an instruction for signed words.
        F32x8(each_lane!(a => a as i32 as f32))
    }

    /// Words as the bits of numbers.
    #[inline(always)]
    pub(crate) fn bits_to_f32(self) -> F32x8 {
        let a = self.0;
        F32x8(each_lane!(a => f32::from_bits(a)))
    }

    /// All bits where bit `bit` is set, none where it is not.
    #[inline(always)]
    pub(crate) fn has_bit(self, bit: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => 0_u32.wrapping_sub((a >> bit) & 1)))
    }
}

impl Shr<u32> for U32x8 {
    type Output = Self;
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => a >> bits))
    }
}

impl Mask8 {
    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, yes: impl Into<F32x8>, no: impl Into<F32x8>) -> F32x8 {
        let (mask, yes, no) = (self.0, yes.into().0, no.into().0);
        F32x8(each_lane!(mask, yes, no => {
            f32::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
        }))
    }

    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_word(self, yes: U32x8, no: U32x8) -> U32x8 {
        let (mask, yes, no) = (self.0, yes.0, no.0);
        U32x8(each_lane!(mask, yes, no => (yes & mask) | (no & !mask)))
    }

    /// 1 where the mask is set, 0 elsewhere.
    #[inline(always)]
    pub(crate) fn indicator(self) -> F32x8 {
        self.select(1.0, 0.0)
    }

    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.0.iter().fold(0, |any, mask| any | mask) != 0
    }
}

impl BitAnd for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self(each_lane!(a, b => a & b))
    }
}

impl BitOr for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self(each_lane!(a, b => a | b))
    }
}
