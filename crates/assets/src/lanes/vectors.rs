//! Points of the plane, and colours, side by side.

use std::ops::{Add, Div, Mul, MulAssign, Sub};

use glam::{Vec2, Vec3};

use super::{Floats, Mask};

/// Points of the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec2s<const N: usize> {
    pub(crate) x: Floats<N>,
    pub(crate) y: Floats<N>,
}

/// Colours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3s<const N: usize> {
    pub(crate) x: Floats<N>,
    pub(crate) y: Floats<N>,
    pub(crate) z: Floats<N>,
}

impl<const N: usize> Vec2s<N> {
    #[inline(always)]
    pub(crate) fn new(x: impl Into<Floats<N>>, y: impl Into<Floats<N>>) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
        }
    }

    #[inline(always)]
    pub(crate) fn length(self) -> Floats<N> {
        (self.x * self.x + self.y * self.y).sqrt()
    }
}

impl<const N: usize> Add<Vec2> for Vec2s<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Vec2) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl<const N: usize> Sub<Vec2> for Vec2s<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Vec2) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl<const N: usize> Mul<f32> for Vec2s<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

impl<const N: usize> Div<Floats<N>> for Vec2s<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: Floats<N>) -> Self {
        Self::new(self.x / divisor, self.y / divisor)
    }
}

/// One colour in all lanes.
#[inline(always)]
pub(crate) const fn rgb<const N: usize>(r: f32, g: f32, b: f32) -> Vec3s<N> {
    Vec3s {
        x: Floats::splat(r),
        y: Floats::splat(g),
        z: Floats::splat(b),
    }
}

impl<const N: usize> Vec3s<N> {
    /// This colour where `t` is 0, `other` where it is 1.
    #[inline(always)]
    pub(crate) fn lerp(self, other: Self, t: impl Into<Floats<N>>) -> Self {
        let t = t.into();
        self * (1.0 - t) + other * t
    }
}

impl<const N: usize> From<Vec3> for Vec3s<N> {
    #[inline(always)]
    fn from(c: Vec3) -> Self {
        rgb(c.x, c.y, c.z)
    }
}

impl<const N: usize> Add for Vec3s<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl<const N: usize> Mul for Vec3s<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            x: self.x * other.x,
            y: self.y * other.y,
            z: self.z * other.z,
        }
    }
}

impl<const N: usize> Mul<Floats<N>> for Vec3s<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Floats<N>) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }
}

impl<const N: usize> Mul<f32> for Vec3s<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        self * Floats::splat(factor)
    }
}

impl<T, const N: usize> MulAssign<T> for Vec3s<N>
where
    Self: Mul<T, Output = Self>,
{
    #[inline(always)]
    fn mul_assign(&mut self, factor: T) {
        *self = *self * factor;
    }
}

impl<const N: usize> Mask<N> {
    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_colour(self, yes: Vec3s<N>, no: Vec3s<N>) -> Vec3s<N> {
        Vec3s {
            x: self.select(yes.x, no.x),
            y: self.select(yes.y, no.y),
            z: self.select(yes.z, no.z),
        }
    }
}
