//! Some numbers side by side, and masks and vectors of them.
//!
//! Arithmetic is that of f32 and u32 in each lane, in the order in which it is written, so lanes
//! have the bits that one number after the other would have. They are plain arrays, which the
//! compiler keeps in the vector registers of whatever processor it compiles for.

mod vectors;

use std::ops::{Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, Neg, Shr, Sub};

pub(crate) use self::vectors::{Vec2s, Vec3s, rgb};

/// Numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Floats<const N: usize>([f32; N]);

/// Hashes or lattice coordinates. Arithmetic wraps around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub(crate) struct Words<const N: usize>([u32; N]);

/// Answers: all bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Mask<const N: usize>([u32; N]);

pub(crate) type F32x8 = Floats<8>;
pub(crate) type U32x8 = Words<8>;
pub(crate) type F32x16 = Floats<16>;
pub(crate) type U32x16 = Words<16>;
pub(crate) type Vec2x16 = Vec2s<16>;
pub(crate) type Vec3x16 = Vec3s<16>;

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
        let mut lanes = [Default::default(); N];
        for lane in 0..N {
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
        impl<const N: usize> $trait for $lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.0, other.0);
                Self(each_lane!($a, $b => $value))
            }
        }
        impl<const N: usize> $trait<$scalar> for $lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: $scalar) -> Self {
                $trait::$method(self, Self::splat(other))
            }
        }
        impl<const N: usize> $trait<$lanes<N>> for $scalar {
            type Output = $lanes<N>;
            #[inline(always)]
            fn $method(self, other: $lanes<N>) -> $lanes<N> {
                $trait::$method($lanes::splat(self), other)
            }
        }
    };
}

operator!(Floats, f32, Add::add, a, b => a + b);
operator!(Floats, f32, Sub::sub, a, b => a - b);
operator!(Floats, f32, Mul::mul, a, b => a * b);
operator!(Floats, f32, Div::div, a, b => a / b);
operator!(Words, u32, Add::add, a, b => a.wrapping_add(b));
operator!(Words, u32, Mul::mul, a, b => a.wrapping_mul(b));
operator!(Words, u32, BitAnd::bitand, a, b => a & b);
operator!(Words, u32, BitXor::bitxor, a, b => a ^ b);

/// Adding this to a number below 2²² in size leaves its nearest integer in the lowest bits.
const INTEGER_BITS: f32 = 12_582_912.0;

impl<const N: usize> Floats<N> {
    /// How many numbers are side by side.
    pub(crate) const LANES: usize = N;

    #[inline(always)]
    pub(crate) const fn splat(x: f32) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    pub(crate) const fn new(lanes: [f32; N]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    pub(crate) const fn to_array(self) -> [f32; N] {
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
    pub(crate) fn to_u32(self) -> Words<N> {
        let a = (self + INTEGER_BITS).0;
        Words(each_lane!(a => a.to_bits().wrapping_sub(INTEGER_BITS.to_bits())))
    }

    /// A function of each lane, one after the other.
    pub(crate) fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: impl Into<Self>) -> Mask<N> {
        let (a, b) = (self.0, other.into().0);
        Mask(each_lane!(a, b => if a < b { u32::MAX } else { 0 }))
    }

    #[inline(always)]
    pub(crate) fn gt(self, other: impl Into<Self>) -> Mask<N> {
        other.into().lt(self)
    }
}

impl<const N: usize> From<f32> for Floats<N> {
    #[inline(always)]
    fn from(x: f32) -> Self {
        Self::splat(x)
    }
}

impl<const N: usize> Neg for Floats<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self.0;
        Self(each_lane!(a => -a))
    }
}

impl<T, const N: usize> AddAssign<T> for Floats<N>
where
    Self: Add<T, Output = Self>,
{
    #[inline(always)]
    fn add_assign(&mut self, other: T) {
        *self = *self + other;
    }
}

impl<const N: usize> Words<N> {
    #[inline(always)]
    pub(crate) const fn new(lanes: [u32; N]) -> Self {
        Self(lanes)
    }

    /// Where words below 2³¹ are below another one.
    #[inline(always)]
    pub(crate) fn lt(self, other: u32) -> Mask<N> {
        let a = self.0;
        // Processors compare signed words.
        Mask(each_lane!(a => if (a as i32) < (other as i32) { u32::MAX } else { 0 }))
    }

    /// Where the highest bit is set.
    #[inline(always)]
    pub(crate) fn is_negative(self) -> Mask<N> {
        Mask(self.has_bit(31).0)
    }

    /// The words where the mask is set, 0 elsewhere.
    #[inline(always)]
    pub(crate) fn only(self, mask: Mask<N>) -> Self {
        self & Self(mask.0)
    }

    /// Gathers the numbers at these places of a table.
    #[inline(always)]
    pub(crate) fn gather(self, table: &[f32]) -> Floats<N> {
        // Without this the compiler would compute the places lane by lane, too.
        let a = std::hint::black_box(self).0;
        Floats(each_lane!(a => table[a as usize]))
    }

    #[inline(always)]
    pub(crate) const fn splat(x: u32) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    pub(crate) const fn to_array(self) -> [u32; N] {
        self.0
    }

    #[inline(always)]
    pub(crate) fn rotate_left(self, bits: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => a.rotate_left(bits)))
    }

    /// Words below 2³¹ as numbers.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> Floats<N> {
        let a = self.0;
        // Processors have an instruction for signed words.
        Floats(each_lane!(a => a as i32 as f32))
    }

    /// Words as the bits of numbers.
    #[inline(always)]
    pub(crate) fn bits_to_f32(self) -> Floats<N> {
        let a = self.0;
        Floats(each_lane!(a => f32::from_bits(a)))
    }

    /// All bits where bit `bit` is set, none where it is not.
    #[inline(always)]
    pub(crate) fn has_bit(self, bit: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => 0_u32.wrapping_sub((a >> bit) & 1)))
    }
}

impl<const N: usize> Shr<u32> for Words<N> {
    type Output = Self;
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        let a = self.0;
        Self(each_lane!(a => a >> bits))
    }
}

impl<const N: usize> Mask<N> {
    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, yes: impl Into<Floats<N>>, no: impl Into<Floats<N>>) -> Floats<N> {
        let (mask, yes, no) = (self.0, yes.into().0, no.into().0);
        Floats(each_lane!(mask, yes, no => {
            f32::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
        }))
    }

    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_word(self, yes: Words<N>, no: Words<N>) -> Words<N> {
        let (mask, yes, no) = (self.0, yes.0, no.0);
        Words(each_lane!(mask, yes, no => (yes & mask) | (no & !mask)))
    }

    /// 1 where the mask is set, 0 elsewhere.
    #[inline(always)]
    pub(crate) fn indicator(self) -> Floats<N> {
        self.select(1.0, 0.0)
    }

    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.0.iter().fold(0, |any, mask| any | mask) != 0
    }
}

impl<const N: usize> BitAnd for Mask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self(each_lane!(a, b => a & b))
    }
}

impl<const N: usize> BitOr for Mask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self(each_lane!(a, b => a | b))
    }
}
